"""A number and how sure it is."""

from __future__ import annotations

import math
from typing import NamedTuple

RANDOM_ONLY = "for random trials only"


class Estimate(NamedTuple):
    """A number with its 95 % interval.

    Attributes
    ----------
    value : float
        The estimate; NaN where there is none.
    lower, upper : float
        Ends of the interval; NaN where no trustworthy one exists.
    reason : str
        Why there is none.
    """

    value: float
    lower: float = math.nan
    upper: float = math.nan
    reason: str = ""

    @property
    def sure(self) -> bool:
        """Whether there is an interval."""
        return not (math.isnan(self.lower) or math.isnan(self.upper))

    @property
    def needs_more(self) -> bool:
        """Whether more trials would give one: the reason says how many."""
        return self.reason.startswith("needs")

    @property
    def complement(self) -> Estimate:
        """Of a share: that of all other machines."""
        ends = 1 - self.upper, 1 - self.lower
        return Estimate(1 - self.value, *ends, self.reason)


NONE_DONE = Estimate(math.nan, reason="no trial is done")
