"""Trials picked by a response: next to a limit, the worst, over the range."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.limits.limit import Limit, margins
from tolstat.status import Status

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]

WORST = 10  # trials of each limited response


def next_to(values: Array, limit: Limit, end: float, number: int) -> Numbers:
    """Find the places of values next to an end of a limit, as many on either side."""
    distance = np.abs(values - end)
    within = values >= end if end == limit.lower else values <= end
    sides = [np.flatnonzero(side) for side in (within, ~within)]
    return np.concatenate(
        [side[np.argsort(distance[side], kind="stable")[:number]] for side in sides]
    )


def spread(values: Array, number: int) -> Numbers:
    """Choose values spread evenly from the least to the largest.

    By value and not by rank: a rare kind of trial that takes much of the range, as
    one that jams, is met as often as the many others. Places of these, ascending; fewer
    where many values are alike. No value is NaN.
    """
    if not len(values):
        return np.zeros(0, np.int64)
    order = np.argsort(values, kind="stable")
    ascending = values[order]
    middles = (ascending[1:] + ascending[:-1]) / 2
    wanted = np.linspace(ascending[0], ascending[-1], number)
    return np.unique(order[np.searchsorted(middles, wanted)])


def worst_trials(values: Array, status: NDArray[np.uint8], limit: Limit) -> list[int]:
    """Return the ten trials nearest to a limit, or farthest out; the worst first."""
    margin = margins(values, limit.permitted)
    margin[status != Status.DONE] = np.inf
    order: list[int] = np.argsort(margin, kind="stable")[:WORST].tolist()
    return [trial for trial in order if margin[trial] < np.inf]
