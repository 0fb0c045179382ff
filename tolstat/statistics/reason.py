"""Why a number has no interval."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Any


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
    SECOND_END = "the limit has one end"
    SPREAD = "the response does not spread"
    MORE_SPREAD = "over {most:g}: hardly any spread"
    LEAST_SIGMA = "sigma may be nearly zero"
    UNEQUAL_HALVES = "half of the units have the same value"
    UNEQUAL_OUTERMOST = "the outermost units have the same value"
    ANY_OUT = "none out of limit in either"


class Reason(str):
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

    def __new__(cls, lack: Lack, **numbers: float) -> Reason:
        """Return the reason, worded."""
        reason = super().__new__(cls, lack.value.format(**numbers))
        reason.lack, reason.numbers = lack, numbers
        return reason

    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]:
        """Return what a copy, or another process, makes it from."""
        return (self.lack,), dict(self.numbers)
