"""Which trials near a limit change sides once they are integrated precisely."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.limits.limit import within

Array = NDArray[np.float64]


class Sides(NamedTuple):
    """What integration errors do to the share of machines beyond a limit.

    Attributes
    ----------
    near : int
        Trials nearest to the limit that were integrated again, without a gap.
    changed : int
        Trials integrated again that lie within one time and beyond the other.
    gap : float
        Distance from the limit of the nearest trial that was not integrated again:
        while none of those errs by as much, only the changed ones change sides.
        Infinite if there is none.
    at_most : float
        By how much the share beyond then moves at most: the changed ones, of all done.
    """

    near: int
    changed: int
    gap: float
    at_most: float


def changing_sides(
    values: Array,
    trials: NDArray[np.int64],
    precise: Array,
    limit: tuple[float, float],
) -> Sides:
    """Count the trials that change sides of a limit.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    trials : int64[n]
        Which of them were integrated again, done both times.
    precise : float64[n]
        What was found then.
    limit : tuple of float
        Least and greatest permitted value.
    """
    lower, upper = limit
    distance = np.fmin(np.abs(values - lower), np.abs(values - upper))
    others = np.isfinite(values)
    done = int(np.count_nonzero(others))
    others[trials] = False
    gap = float(distance[others].min()) if others.any() else math.inf
    near = int(np.count_nonzero(distance[trials] < gap))
    before, after = within(values[trials], limit), within(precise, limit)
    changed = int(np.count_nonzero(before != after))
    return Sides(near, changed, gap, changed / done if done else math.nan)
