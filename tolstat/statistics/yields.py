"""Share of machines within a limit, when some trials failed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limit import DEMANDED
from tolstat.statistics.proportions import proportion
from tolstat.statistics.replicates import share_from_replicates

MET, NOT_MET, UNDECIDED = "met", "not met", "undecided"


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
    within = int(np.count_nonzero(_within(values, limit)))
    trials = len(values) + failed
    bad = proportion(trials - within, trials)
    least = proportion(within, trials)
    most = proportion(within + failed, trials)
    verdict, needed = _verdict(least, demanded), 0
    if verdict == UNDECIDED:
        needed = _needed(within / trials, trials, demanded)
    return Yield(bad, least, most, verdict, needed)


def yield_of_replicates(
    values: NDArray[np.float64],
    done: NDArray[np.bool_],
    replicate: NDArray[np.int64],
    limit: tuple[float, float],
    demanded: float = DEMANDED,
) -> Yield:
    """Estimate the yield of a limit from trials that depend on each other.

    Parameters
    ----------
    values : float64[n]
        The response in all trials that ran.
    done : bool[n]
        Which of them did not fail.
    replicate : int64[n]
        Number of the randomisation that each belongs to.
    limit, demanded
        As of `yield_of`.

    Returns
    -------
    Yield
        With intervals from the scatter between replicates, kept within 0 and 1.
    """
    good = done & _within(values, limit)

    least = share_from_replicates(good, replicate)
    verdict = _verdict(least, demanded) if least.sure else UNDECIDED
    beyond = share_from_replicates(~good, replicate)
    most = share_from_replicates(good | ~done, replicate)
    return Yield(beyond, least, most, verdict, 0)


def _within(
    values: NDArray[np.float64], limit: tuple[float, float]
) -> NDArray[np.bool_]:
    lower, upper = limit
    inside: NDArray[np.bool_] = (values >= lower) & (values <= upper)
    return inside


def _verdict(least: Estimate, demanded: float) -> str:
    if least.lower >= demanded:
        return MET
    return NOT_MET if least.upper < demanded else UNDECIDED


def _needed(share: float, trials: int, demanded: float) -> int:
    """Return the least doubling of the trials that would decide; 0 if none would."""
    for doubling in range(1, 21):
        more: int = trials * 2**doubling
        found = proportion(round(share * more), more)
        if found.lower >= demanded or found.upper < demanded:
            return more
    return 0
