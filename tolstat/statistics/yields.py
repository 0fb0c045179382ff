"""Share of machines within a limit, when some trials failed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.proportions import proportion

DEMANDED = 0.9973  # yield that a limit asks for where the study says nothing


class Yield(NamedTuple):
    """Share of machines within a limit.

    Attributes
    ----------
    beyond : Estimate
        Share beyond, every failed trial counted as beyond.
    least, most : Estimate
        Yield if every failed trial were bad, and if every one were good.
    verdict : str
        "met" when the whole interval of the yield lies at or above what is demanded,
        "not met" when it lies below, else "undecided"; failed trials count against.
    needed : int
        Trials that would decide an undecided one, if the share stays; 0 otherwise.
    """

    beyond: Estimate
    least: Estimate
    most: Estimate
    verdict: str
    needed: int


def yield_of(
    values: NDArray[np.float64],
    failed: int,
    limit: tuple[float, float],
    demanded: float = DEMANDED,
) -> Yield:
    """Estimate the yield of a limit.

    Parameters
    ----------
    values : float64[n]
        The response in the trials that are done, independent.
    failed : int
        Trials that failed.
    limit : tuple of float
        Least and greatest permitted value.
    demanded : float
        Share of machines that is to be within.

    Returns
    -------
    Yield
        With exact binomial intervals (Clopper and Pearson).
    """
    lower, upper = limit
    within = int(np.count_nonzero((values >= lower) & (values <= upper)))
    trials = len(values) + failed
    bad = proportion(trials - within, trials)
    least = proportion(within, trials)
    most = proportion(within + failed, trials)
    if least.lower >= demanded:
        verdict, needed = "met", 0
    elif least.upper < demanded:
        verdict, needed = "not met", 0
    else:
        verdict, needed = "undecided", _needed(within / trials, trials, demanded)
    return Yield(Estimate(*bad), Estimate(*least), Estimate(*most), verdict, needed)


def _needed(share: float, trials: int, demanded: float) -> int:
    """Return the least doubling of the trials that would decide; 0 if none would."""
    for doubling in range(1, 21):
        more: int = trials * 2**doubling
        found = proportion(round(share * more), more)
        if found.lower >= demanded or found.upper < demanded:
            return more
    return 0
