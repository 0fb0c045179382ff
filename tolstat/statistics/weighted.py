"""Shares of other machines than were drawn, from weighted trials."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from tolstat.statistics.estimate import Estimate

Array = NDArray[np.float64]

LEAST_EFFECTIVE = 150  # with fewer one heavy trial more or less decides it


def effective_number(weights: Array) -> int:
    """Return how many independent trials float64[trial] weights are worth.

    References
    ----------
    L. Kish, Survey Sampling, Wiley 1965, 11.7.
    """
    squares = float(np.sum(weights**2))
    return round(float(weights.sum()) ** 2 / squares) if squares > 0 else 0


def weighted_share(
    machines: NDArray[np.bool_], weights: Array, confidence: float = 0.95
) -> Estimate:
    """Estimate the share that machines would have if others were drawn.

    Parameters
    ----------
    machines : bool[trial]
        Which of them have the property; the trials independent.
    weights : float64[trial]
        Density of each where others are drawn over that as it was.
    confidence : float
        Of the interval.

    Returns
    -------
    Estimate
        With the gamma interval of a sum of weighted counts. The heaviest of all trials
        stands for the next machine beyond, which may be anywhere: conservative, and
        above zero even where no machine is beyond.

    References
    ----------
    M. P. Fay, E. J. Feuer, Confidence intervals for directly standardized rates,
    Statistics in Medicine 16 (1997) 791-801.
    """
    number = effective_number(weights)
    if number < LEAST_EFFECTIVE:
        return Estimate(math.nan, reason=f"{number} effective trials are too few")
    n = len(weights)
    counted = weights[machines] / n
    y, v, heaviest = counted.sum(), np.sum(counted**2), weights.max() / n
    miss = (1 - confidence) / 2
    lower = v / y * gammaincinv(y**2 / v, miss) if v > 0 else 0.0
    one_more, its_square = y + heaviest, v + heaviest**2
    shape, scale = one_more**2 / its_square, its_square / one_more
    upper = scale * gammaincinv(shape, 1 - miss)
    return Estimate(float(min(y, 1.0)), float(lower), float(min(upper, 1.0)))
