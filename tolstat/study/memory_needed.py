"""Memory and time of the trials of a study, and whether the memory suffices."""

import os
from contextlib import suppress
from pathlib import Path

from tolstat.model.description import Description

NUMBER = 8  # bytes
RATE = 1000  # trials per second, assumed for times
LARGE = 0.25  # share of the memory above which there is a warning
LIMITS = (  # of the group of processes that this one belongs to
    "/sys/fs/cgroup/memory.max",
    "/sys/fs/cgroup/memory/memory.limit_in_bytes",
)
TIMES = (("years", 3.156e7), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0))


def too_large(trials: int, description: Description) -> str:
    """Return why the memory cannot hold so many trials; empty if it can."""
    needed, available = trials * _row(description), memory()
    if needed <= available:
        return ""
    most = available // _row(description)
    most -= most % 10 ** max(0, len(f"{most:.0f}") - 2)  # two figures, rounded down
    return (
        f"{_takes(trials, needed)}, and this process may have {_gigabytes(available)}; "
        f"give at most about {most:.0f}"
    )


def large(trials: int, description: Description) -> str:
    """Return a warning if trials take much memory; else an empty text."""
    needed = trials * _row(description)
    if needed <= LARGE * memory():
        return ""
    return f"{_takes(trials, needed)}, and as much on the disk"


def memory() -> float:
    """Return how much memory this process may have, bytes."""
    bounds = []
    with suppress(AttributeError, ValueError, OSError):  # not on every system
        bounds.append(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    with suppress(ImportError):
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        if limit != resource.RLIM_INFINITY:
            bounds.append(limit)
    for path in LIMITS:
        with suppress(OSError, ValueError):  # ValueError: "max"
            bounds.append(int(Path(path).read_text()))
    return float(min(bounds, default=2**63))


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
