"""The yield of a limit, with failed trials, and its verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.limit import DEMANDED, within
from tolstat.statistics.limits.sample_size import (
    grown,
    replicates_that_decide,
    trials_that_decide,
)
from tolstat.statistics.sample import Sample

Ends = tuple[float, float]

MET, NOT_MET, UNDECIDED = "met", "not met", "undecided"
INTEGRATION_ERROR = "integration error"  # why a verdict is undecided
WORST_FIRST = (NOT_MET, UNDECIDED, MET)


class Yield(NamedTuple):
    """The share of units within a limit.

    Attributes
    ----------
    fraction_out_of_limit : Estimate
        Every failed trial counts as out of limit.
    within, within_at_most : Estimate
        Yield if every failed trial were out of limit, and if every one were within.
    verdict : str
        "met" when the whole interval of the yield lies at or above the demanded one,
        "not met" when it lies below, else "undecided"; failed trials count against.
        Also "undecided" if integration errors can change it.
    needed : int
        Trials that decide an undecided verdict with a chance of 80 %; 0 otherwise,
        above 1e9, and if integration errors leave it undecided.
    reason : str
        "integration error" if these leave it undecided; otherwise empty.
    """

    fraction_out_of_limit: Estimate
    within: Estimate
    within_at_most: Estimate
    verdict: str
    needed: int
    reason: str = ""

    @property
    def words(self) -> str:
        """The verdict, and its reason where it has one."""
        return f"{self.verdict} ({self.reason})" if self.reason else self.verdict


def yield_of(
    values: Array,
    sample: Sample,
    limit: Ends,
    demanded: float = DEMANDED,
    ends: tuple[Array, Array] | None = None,
) -> Yield:
    """Estimate the yield of a limit.

    `ends` are the least and the largest response of each trial that integration errors
    allow; see `tolstat.statistics.integration_error.response_ends`.

    Returns
    -------
    Yield
        For independent trials intervals are anytime-valid: adding trials until there is
        a verdict does not raise the error. Otherwise intervals come from replicates or
        weighted counts.
    """
    ran = sample.ran
    good = within(values, limit) & sample.done
    least = _most(good, sample)
    found = verdict(least, demanded)
    needed, reason = 0, ""
    if ends and turned(
        found, demanded, ends, limit, sample.done, lambda units: _most(units, sample)
    ):
        found, reason = UNDECIDED, INTEGRATION_ERROR
    elif found == UNDECIDED and sample.replicates:
        needed = replicates_that_decide(good[ran], sample.replicate[ran], demanded)
    elif found == UNDECIDED and not sample.weights:
        out, trials = np.count_nonzero(ran & ~good), np.count_nonzero(ran)
        needed = trials_that_decide(int(out), int(trials), 1 - demanded)
        needed = grown(needed * sample.each) if needed else 0
    most = _most(good | ~sample.done, sample)
    return Yield(sample.share(~good, ran), least, most, found, needed, reason)


def turned(
    found: str,
    demanded: float,
    ends: tuple[Array, Array],
    limit: Ends,
    done: Truths,
    share: Callable[[Truths], Estimate],
) -> bool:
    """Tell whether integration errors can change a verdict.

    It has to be the same for the trials that are within the limit for any of their
    errors, and for those that are within for some. `share` estimates the yield.
    """
    (least, largest), (lower, upper) = ends, limit
    certain = done & (least >= lower) & (largest <= upper)
    possible = (least <= upper) & (largest >= lower)
    return any(verdict(share(each), demanded) != found for each in (certain, possible))


def joint_yield(
    responses: Mapping[str, Array], sample: Sample, limits: Mapping[str, Ends]
) -> Estimate:
    """Estimate the yield, all limits, of at least one limit by response, SI."""
    good = np.all(
        [within(responses[name], limit) for name, limit in limits.items()], axis=0
    )
    return _most(good & sample.done, sample)


def verdict(share: Estimate, demanded: float) -> str:
    """Return the verdict on a yield; undecided without an interval."""
    if share.lower >= demanded:
        return MET
    return NOT_MET if share.upper < demanded else UNDECIDED


def _most(units: Truths, sample: Sample) -> Estimate:
    """Estimate a share of the trials that ran, expected to be most of them."""
    if sample.weights:
        return sample.share(~units, sample.ran).complement
    return sample.share(units, sample.ran)
