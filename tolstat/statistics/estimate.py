"""A number with its interval, or the reason why it has none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from typing import Any, NamedTuple


class Lack(Enum):
    """What an interval lacks; the value is the sentence, with its numbers."""

    RANDOM_TRIALS = "for random trials only"
    FAILED_TRIALS = "failed trials may lie there"
    ANY_DONE = "no trial is done"
    ANY_RUN = "no trial has run"
    LAST_STAGE = "the last stage has not run"
    TRIALS = "needs {needed}"
    GROUPS = "needs {needed} groups of {size} trials, {trials} in all"
    SALTELLI = 'needs a run with sampling = "saltelli": too many for neighbours'
    TRIALS_FOR_SHARES = "no trustworthy interval at {trials} trials"
    LIGHT_TAILS = "no trustworthy interval: few trials dominate the variance"
    ONE_MORE_APART = "only 1 trial differs from all others"
    MORE_APART = "only {trials} trials differ from all others"
    UNEQUAL_TRIALS = "all trials are equal: 1 unit in {units} may differ"
    UNEQUAL_REPLICATES = "all trials are equal"
    REPLICATES = "no replicates of {size} trials"
    LIGHT_WEIGHTS = "{trials} trials are too few with these weights"
    EFFECTIVE_TRIALS = "effective sample size {effective}; {needed} needed"
    FEWEST_PARTS = "needs {needed} parts"
    FEWEST_LOTS = "needs {needed} lots"
    NORMAL_PARTS = "the parts are not normal"
    SECOND_END = "the limit has one end"
    SPREAD = "the response does not spread"
    MORE_SPREAD = "over {most:g}: hardly any spread"
    LEAST_SIGMA = "sigma may be nearly zero"
    UNEQUAL_HALVES = "half of the units have the same value"
    UNEQUAL_OUTERMOST = "the outermost units have the same value"
    PARTS = "only {parts} measured parts: 10 are needed, 50 decide most limits"
    EQUAL_PARTS = "all measured parts are equal: they tell no spread"
    ANY_OUT = "none out of limit in either"
    ENDS = "either may be infinite"


class NoInterval(str):
    """The reason why a number has no interval; as text, the sentence.

    Attributes
    ----------
    lack : Lack
        What is missing: decisions look at it, never at the sentence.
    numbers : dict of str to float
        Those of the sentence, such as the trials needed.
    """

    lack: Lack
    numbers: Mapping[str, float]

    def __new__(cls, lack: Lack, **numbers: float) -> NoInterval:
        """Return the reason, worded."""
        reason = super().__new__(cls, lack.value.format(**numbers))
        reason.lack, reason.numbers = lack, numbers
        return reason

    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]:
        """Return what a copy, or another process, makes it from."""
        return (self.lack,), dict(self.numbers)


CONFIDENCE = 0.95  # of every printed interval
RANDOM_ONLY = NoInterval(Lack.RANDOM_TRIALS)
FAILED_THERE = NoInterval(Lack.FAILED_TRIALS)
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
        Why there is no interval: a `NoInterval` of these statistics, or a sentence of
        another floor; empty with an interval.
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
        return self.reason.lack if isinstance(self.reason, NoInterval) else None

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


NONE_DONE = Estimate(math.nan, reason=NoInterval(Lack.ANY_DONE))


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
