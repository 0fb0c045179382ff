"""Memory and time of the trials of a study, and whether the memory suffices."""

from tolstat.model.description import Description
from tolstat.operating_system import memory

NUMBER = 8  # bytes
RATE = 1000  # trials per second, assumed for times
LARGE = 0.25  # share of the memory above which there is a warning
TIMES = (("years", 3.156e7), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0))


def too_large(trials: int, description: Description) -> str:
    """Return why the memory cannot hold so many trials; empty if it can."""
    needed, there = trials * _row(description), memory()
    if needed <= there:
        return ""
    most = there // _row(description)
    most -= most % 10 ** max(0, len(f"{most:.0f}") - 2)  # two figures, rounded down
    return (
        f"{_takes(trials, needed)}, and this process may have {_gigabytes(there)}; "
        f"give at most about {most:.0f}"
    )


def large(trials: int, description: Description) -> str:
    """Return a warning if trials take much memory; else an empty text."""
    needed = trials * _row(description)
    if needed <= LARGE * memory():
        return ""
    return f"{_takes(trials, needed)}, and as much on the disk"


def _row(description: Description) -> int:
    """Return the bytes of a trial: unit samples, deviations, responses."""
    contributors, responses = description
    return NUMBER * (2 * len(contributors) + len(responses) + 4)


def _takes(trials: int, needed: float) -> str:
    seconds = trials / RATE
    unit, length = next(
        ((unit, length) for unit, length in TIMES if seconds >= 2 * length),
        ("seconds", 1.0),
    )
    return (
        f"{trials} trials take about {_gigabytes(needed)} of memory and, at {RATE} a "
        f"second, {seconds / length:.3g} {unit}"
    )


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"
