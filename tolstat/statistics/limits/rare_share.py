"""The share out of limit of a rare run, whose trials were drawn near the limit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.gamma_interval import gamma_ends
from tolstat.statistics.reweighting.weights import effective_number

Array = NDArray[np.float64]

ENOUGH = 100  # effective sample size of the trials out of limit
COUNTED = 10  # units out of limit from which their count is nearly normal


def rare_share(out: NDArray[np.bool_], weights: Array) -> Estimate:
    """Estimate the share of units out of limit.

    Parameters
    ----------
    out : bool[trial]
        Which of the independent trials are out of limit.
    weights : float64[trial]
        Density of each in the study over that of the sample.

    Returns
    -------
    Estimate
        With the gamma interval of a sum of weighted counts. The next one out of limit
        is assumed as heavy as the heaviest of these, or, where their effective sample
        size is below a hundred, of all trials. Where none is out of limit the upper end
        is that of `unmet`.
    """
    n = len(weights)
    if n == 0:
        return Estimate(math.nan, reason="the last stage has not run")
    if not out.any():
        return Estimate(0.0, 0.0, unmet(weights))
    counts = weights[out] / n
    next_one = counts if effective_number(counts) >= ENOUGH else weights / n
    lower, upper = gamma_ends(counts, float(next_one.max()))
    return Estimate(float(min(counts.sum(), 1.0)), lower, min(upper, 1.0))


def unmet(weights: Array, confidence: float = 0.95) -> float:
    """Return the largest share of a kind of unit that no trial met.

    Parameters
    ----------
    weights : float64[trial]
        As of `rare_share`.
    confidence : float
        The share is larger with half the rest.
    """
    # a kind of share p has at least p over the largest weight in the sample
    missed = (1 - confidence) / 2
    n, most = len(weights), float(weights.max())
    return float(min(most * -math.expm1(math.log(missed) / n), 1.0))


def plain_trials(share: Estimate) -> float:
    """Return how many random trials would give as narrow an interval.

    NaN where these would be too few for a normal distribution of their count.

    Parameters
    ----------
    share : Estimate
        Of units out of limit.
    """
    width, p = share.upper - share.lower, share.value
    if not (share.sure and p > 0 and width > 0):
        return math.nan
    sigmas = 2 * float(ndtri(1 - (1 - 0.95) / 2))
    trials = math.ceil(p * (1 - p) * (sigmas / width) ** 2)
    return float(trials) if trials * min(p, 1 - p) >= COUNTED else math.nan
