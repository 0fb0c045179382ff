"""A number with its interval."""

from __future__ import annotations

import math
from typing import NamedTuple

from tolstat.statistics.reason import Lack, Reason

CONFIDENCE = 0.95  # of every printed interval
RANDOM_ONLY = Reason(Lack.RANDOM_TRIALS)
FAILED_THERE = Reason(Lack.FAILED_TRIALS)
MORE_TRIALS = {Lack.TRIALS, Lack.GROUPS, Lack.SALTELLI}


class Estimate(NamedTuple):
    """A number with its 95 % interval.

    Attributes
    ----------
    value : float
        The estimate; NaN if there is none.
    lower, upper : float
        Ends of the interval; NaN if no trustworthy one exists.
    reason : str
        Reason why there is no interval: a `Reason` of these statistics, or a sentence
        of another floor; empty with an interval.
    """

    value: float
    lower: float = math.nan
    upper: float = math.nan
    reason: str = ""

    def __repr__(self) -> str:
        if self.sure:
            return f"{self.value:.6g} ({self.lower:.6g} to {self.upper:.6g})"
        return f"{self.value:.6g} (no interval: {self.reason})"

    @property
    def sure(self) -> bool:
        """Whether there is an interval."""
        return not (math.isnan(self.lower) or math.isnan(self.upper))

    @property
    def lack(self) -> Lack | None:
        """What its interval lacks; None with an interval, or a reason in words."""
        return self.reason.lack if isinstance(self.reason, Reason) else None

    @property
    def needs_more(self) -> bool:
        """Whether more trials would give an interval: the reason says how many."""
        return self.lack in MORE_TRIALS

    def times(self, factor: float) -> Estimate:
        """Return the estimate in another unit; the factor is above 0."""
        value, lower, upper = (factor * number for number in self[:3])
        return Estimate(value, lower, upper, self.reason)

    @property
    def complement(self) -> Estimate:
        """Share of all other units, if the number is a share."""
        ends = 1 - self.upper, 1 - self.lower
        return Estimate(1 - self.value, *ends, self.reason)


NONE_DONE = Estimate(math.nan, reason=Reason(Lack.ANY_DONE))


def enclosing(value: float, lower: float, upper: float) -> Estimate:
    """Return an estimate whose interval always holds its value.

    An infinite end means that failed trials may lie there: there is no interval then.
    """
    if not math.isfinite(lower + upper):
        finite = value if math.isfinite(value) else math.nan
        return Estimate(finite, reason=FAILED_THERE)
    return Estimate(value, min(lower, value), max(upper, value))


def without_interval(estimate: Estimate) -> Estimate:
    """Return an estimate without its interval, which dependent trials mislead."""
    return Estimate(estimate.value, reason=RANDOM_ONLY) if estimate.sure else estimate
