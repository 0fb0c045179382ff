"""A run verified, on the screen."""

from __future__ import annotations

from pathlib import Path

from tolstat.cli.showing import screen
from tolstat.execution.verification import findings, verify, why_otherwise
from tolstat.store.commands import to_resume, to_run_again


def verify_run(path: Path, *, every: bool, workers: int | None) -> bool:
    """Print what of a run is not as it was written; tell whether all of it is."""
    found = verify(path, every=every, workers=workers)
    console = screen()
    for line in findings(found):
        console.print(line)
    if found.whole:
        console.print(f"{path} is as it was written")
    elif found.run.damage:
        advice = to_resume(path, found.run.machine)
        console.print(f"{path} is damaged; `{advice}` repairs it", soft_wrap=True)
    else:
        console.print(
            f"{path} is as it was written, but its study gives something else here: "
            f"{why_otherwise(found)}; {to_run_again(found.run)}",
            soft_wrap=True,
        )
    return found.whole
