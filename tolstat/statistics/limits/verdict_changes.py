"""How many trials near a limit change sides when they are integrated precisely."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.limits.limit import within

Array = NDArray[np.float64]


class VerdictChanges(NamedTuple):
    """The effect of integration errors on the share of units out of limit.

    Attributes
    ----------
    near : int
        Trials nearest to the limit that were integrated again, without a gap.
    changed : int
        Trials integrated again that are within the limit one time only.
    gap : float
        Distance from the limit of the nearest trial that was not integrated again:
        while no error of these is as large, only the changed ones change sides.
        Infinite if there is none.
    at_most : float
        Greatest change of the share out of limit then: the changed ones, of all done.
    """

    near: int
    changed: int
    gap: float
    at_most: float


def verdict_changes(
    values: Array,
    trials: NDArray[np.int64],
    precise: Array,
    limit: tuple[float, float],
) -> VerdictChanges:
    """Count the trials that change sides of a limit.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    trials : int64[n]
        Which of them were integrated again, done both times.
    precise : float64[n]
        Their precise response.
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
    return VerdictChanges(near, changed, gap, changed / done if done else math.nan)
