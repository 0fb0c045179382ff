"""Intervals of samples whose trials depend on each other, from their replicates."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from tolstat.statistics.estimate import NONE_DONE, Estimate

Array = NDArray[np.float64]
LEAST_IN_EACH = 16
WIDER = 1.1  # than Student's interval: replicates of skewed statistics are not normal


def from_replicates(
    statistic: Callable[[Array], float],
    values: Array,
    replicate: NDArray[np.int64],
    confidence: float = 0.95,
) -> Estimate:
    """Estimate a statistic of Latin hypercube or Sobol' trials.

    Parameters
    ----------
    statistic : callable
        Of float64[n].
    values : float64[trial]
        The response, none NaN.
    replicate : int64[trial]
        Number of the independent randomisation that each trial belongs to.
    confidence : float
        Of the interval.

    Returns
    -------
    Estimate
        The statistic of all trials, with Student's interval, a tenth wider, from the
        scatter of the same statistic between the replicates.

    References
    ----------
    A. B. Owen, Monte Carlo Theory, Methods and Examples, chapter 17: randomised
    quasi-Monte Carlo, replicates.
    """
    if len(values) == 0:
        return NONE_DONE
    value = statistic(values)
    groups = [values[replicate == number] for number in np.unique(replicate)]
    if len(groups) < 2 or min(len(group) for group in groups) < LEAST_IN_EACH:
        return Estimate(value, reason=f"no replicates of {LEAST_IN_EACH} trials")
    each = np.array([statistic(group) for group in groups])
    if np.ptp(each) == 0:
        return Estimate(value, reason="alike in all replicates")
    count = len(each)
    z = float(stdtrit(count - 1, 0.5 + confidence / 2))
    half = WIDER * z * float(each.std(ddof=1)) / math.sqrt(count)
    return Estimate(value, value - half, value + half)


def share_from_replicates(
    machines: NDArray[np.bool_], replicate: NDArray[np.int64]
) -> Estimate:
    """Estimate a share of Latin hypercube or Sobol' trials.

    Parameters
    ----------
    machines : bool[trial]
        Which of them have the property.
    replicate : int64[trial]
        Number of the independent randomisation that each trial belongs to.

    Returns
    -------
    Estimate
        With an interval kept within 0 and 1.
    """
    found = from_replicates(np.mean, machines.astype(float), replicate)
    return found._replace(lower=max(found.lower, 0.0), upper=min(found.upper, 1.0))
