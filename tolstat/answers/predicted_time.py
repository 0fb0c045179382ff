"""How long more trials of a run take, at its own rate."""

from tolstat.store.stored_run import Run

UNITS = (("hours", 3600.0), ("minutes", 60.0))


def predicted_time(run: Run, trials: int) -> str:
    """Return about how long a run takes until it has so many trials, in words.

    At the rate of its trials so far. They took the compilation and the audit, too: so
    it may take less.
    """
    seconds = run.times["seconds"] / max(run.ended, 1) * max(trials - run.ended, 0)
    for unit, length in UNITS:
        if seconds >= length:
            return f"about {max(seconds / length, 2):.0f} {unit}"
    return "less than a minute"
