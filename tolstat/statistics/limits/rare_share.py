"""The share of rare machines, from trials that were drawn where these are."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.gamma_interval import gamma_ends
from tolstat.statistics.reweighting.weights import effective_number

Array = NDArray[np.float64]

ENOUGH = 100  # machines beyond that the weighted ones are worth
COUNTED = 10  # machines beyond, from which their count is nearly normal


def rare_share(
    beyond: NDArray[np.bool_], weights: Array, confidence: float = 0.95
) -> Estimate:
    """Estimate the share of machines beyond a limit.

    Parameters
    ----------
    beyond : bool[trial]
        Which machines are, of independent trials.
    weights : float64[trial]
        Density of each in the study over that as it was drawn.
    confidence : float
        Of the interval.

    Returns
    -------
    Estimate
        With the gamma interval of a sum of weighted counts. The heaviest of those
        beyond stands for the next one; where they are worth fewer than a hundred the
        heaviest of all, so that the interval is wide. Where none is beyond it is what
        `unmet` says.
    """
    n = len(weights)
    if n == 0:
        return Estimate(math.nan, reason="the last stage has not run")
    if not beyond.any():
        return Estimate(0.0, 0.0, unmet(weights, confidence))
    counts = weights[beyond] / n
    next_one = counts if effective_number(counts) >= ENOUGH else weights / n
    lower, upper = gamma_ends(counts, float(next_one.max()), confidence)
    return Estimate(float(min(counts.sum(), 1.0)), lower, min(upper, 1.0))


def unmet(weights: Array, confidence: float = 0.95) -> float:
    """Return the largest share that a kind of machine may have which was never met.

    Parameters
    ----------
    weights : float64[trial]
        As of `rare_share`.
    confidence : float
        With which it is no larger, but for half of the rest.
    """
    # a share p was drawn with p over the largest weight at least
    missed = (1 - confidence) / 2
    n, most = len(weights), float(weights.max())
    return float(min(most * -math.expm1(math.log(missed) / n), 1.0))


def plain_trials(share: Estimate, confidence: float = 0.95) -> float:
    """Return how many plain trials would have as narrow an interval.

    NaN where they would be too few for a normal distribution of their count.

    Parameters
    ----------
    share : Estimate
        Of machines beyond.
    confidence : float
        Of its interval.
    """
    width, p = share.upper - share.lower, share.value
    if not (share.sure and p > 0 and width > 0):
        return math.nan
    sigmas = 2 * float(ndtri(1 - (1 - confidence) / 2))
    trials = math.ceil(p * (1 - p) * (sigmas / width) ** 2)
    return float(trials) if trials * min(p, 1 - p) >= COUNTED else math.nan
