"""How an estimate converges as trials are added."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.intervals.statistic import Statistic
from tolstat.statistics.sample import Sample

Array = NDArray[np.float64]

FEWEST = 32
POINTS = 40


class Running(NamedTuple):
    """A statistic of the first trials of a run.

    Attributes
    ----------
    trials : int64[point]
        How many, ascending; the last is all of them.
    value, lower, upper : float64[point]
        The estimate and its 95 % interval; NaN where there is none yet.
    """

    trials: NDArray[np.int64]
    value: Array
    lower: Array
    upper: Array


def running(
    statistic: Statistic,
    values: Array,
    sample: Sample,
    limit: tuple[float, float] | None = None,
) -> Running:
    """Estimate a statistic from ever more trials.

    Parameters
    ----------
    statistic : Statistic
        Of the response.
    values : float64[trial]
        The response; NaN in trials that are not done.
    sample : Sample
        The trials.
    limit : tuple of float, optional
        Least and greatest permitted value, for the share out of limit.

    Returns
    -------
    Running
        At forty numbers of trials, evenly spaced on a logarithmic scale.
    """
    n = len(values)
    fewest = min(FEWEST, n)
    trials = np.unique(np.geomspace(fewest, n, POINTS).round().astype(np.int64))
    found = [
        statistic.of(values[:each], sample.first(int(each)), limit) for each in trials
    ]
    table = np.array([(each.value, each.lower, each.upper) for each in found])
    return Running(trials, *table.T)
