"""The share of machines within a limit, when some trials failed, and its verdict."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.replicates import share_from_replicates
from tolstat.statistics.limits.limit import DEMANDED, within
from tolstat.statistics.limits.repeated_looks import followed
from tolstat.statistics.limits.sample_size import (
    grown,
    replicates_that_decide,
    trials_that_decide,
)
from tolstat.statistics.reweighting.weighted_estimates import share_left, weighted_share
from tolstat.statistics.sample import Sample

Array = NDArray[np.float64]
Ends = tuple[float, float]

MET, NOT_MET, UNDECIDED = "met", "not met", "undecided"
CONFIDENCE = 0.95


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
        Trials that decide an undecided one with a chance of 80 %; 0 otherwise, and
        where that is beyond 1e9.
    """

    beyond: Estimate
    least: Estimate
    most: Estimate
    verdict: str
    needed: int


def yield_of(
    values: Array, sample: Sample, limit: Ends, demanded: float = DEMANDED
) -> Yield:
    """Estimate the yield of a limit.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    sample : Sample
        The trials.
    limit : tuple of float
        Least and greatest permitted value.
    demanded : float
        Share of machines that is to be within.

    Returns
    -------
    Yield
        Of independent trials with intervals that hold however often one looks while
        trials are added, so that following a verdict until it falls errs no oftener;
        else from the scatter between replicates, or of weighted counts.
    """
    return _judged(within(values, limit) & sample.done, sample, demanded)


def joint_yield(
    responses: Mapping[str, Array], sample: Sample, limits: Mapping[str, Ends]
) -> Estimate:
    """Estimate the share of machines that are within all limits at once.

    Parameters
    ----------
    responses : mapping of str to float64[trial]
        By name.
    sample : Sample
        The trials; failed ones are within none.
    limits : mapping of str to tuple of float
        Least and greatest permitted value of each limited response; at least one.
    """
    good = np.all(
        [within(responses[name], limit) for name, limit in limits.items()], axis=0
    )
    return _most((good & sample.done)[sample.ran], sample)


def verdict(share: Estimate, demanded: float) -> str:
    """Judge the share of machines within by what is demanded of it.

    Parameters
    ----------
    share : Estimate
        Of the machines; without an interval nothing is decided.
    demanded : float
        Share that is to be within.
    """
    if share.lower >= demanded:
        return MET
    return NOT_MET if share.upper < demanded else UNDECIDED


def _judged(good: NDArray[np.bool_], sample: Sample, demanded: float) -> Yield:
    """Judge which machines are good.

    Parameters
    ----------
    good : bool[trial]
        Of trials that are done.
    sample, demanded
        As of `yield_of`.
    """
    ran, done = sample.ran, sample.done
    good, missing = good[ran], ~done[ran]

    least = _most(good, sample)
    found = verdict(least, demanded)
    needed = 0
    if found == UNDECIDED and sample.replicates:
        needed = replicates_that_decide(good, sample.replicate[ran], demanded)
    elif found == UNDECIDED and not sample.weights:
        beyond, trials = int(np.count_nonzero(~good)), len(good)
        needed = trials_that_decide(beyond, trials, 1 - demanded, CONFIDENCE)
        needed = grown(needed * sample.each) if needed else 0
    most = _most(good | missing, sample)
    return Yield(_share(~good, sample), least, most, found, needed)


def _most(machines: NDArray[np.bool_], sample: Sample) -> Estimate:
    """Estimate the share of those of the trials that ran that most should be."""
    if sample.weights:
        return share_left(machines, sample.weights.of(sample.ran))
    return _share(machines, sample)


def _share(machines: NDArray[np.bool_], sample: Sample) -> Estimate:
    """Estimate a share of the trials that ran."""
    if sample.replicates:
        return share_from_replicates(machines, sample.replicate[sample.ran])
    if sample.weights:
        return weighted_share(machines, sample.weights.of(sample.ran))
    return followed(int(machines.sum()), len(machines), CONFIDENCE)
