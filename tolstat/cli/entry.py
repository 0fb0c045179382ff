"""Where the command line begins: Ctrl-C ends in a sentence while it still loads."""

from __future__ import annotations

from tolstat.cli.interrupting import leave, on_interrupt


def entry() -> None:
    """Run the command line; the entry point of the package."""
    on_interrupt(leave)
    # only now: loading click takes as long as Python itself
    import warnings

    from tolstat.cli.main import main, note

    warnings.showwarning = note  # type: ignore[assignment]
    main()
