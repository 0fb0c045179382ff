"""Intervals of a mean that hold for any distribution between two ends."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Array = NDArray[np.float64]

MOST_STAKED = 0.75  # of the capital in one bet, so that none ruins
PRECISION = 1e-6  # of an end, relative


def mean_between(
    values: Array, lower: float, upper: float, confidence: float = 0.95
) -> tuple[float, float]:
    """Bound the mean of a distribution that lies between two ends.

    Whoever bets in each trial that the mean is more than m, and stakes what the trials
    before suggest, multiplies his capital by 2/(1 - confidence) with at most half of
    the rest of the probability if the mean is m. Those m that have not made him so rich
    in the end, nor one who bets on less, are the interval. Nothing else is asked of the
    distribution: no moment, no shape, no number of trials. Of a normal one the interval
    is 1.4 times as wide as Student's if the ends are near, and more the farther off
    they are: with ends at 16 sigmas, 2.6 times at 200 trials and 1.4 at 10 000.

    Parameters
    ----------
    values : float64[n]
        Independent, none NaN, in an order that has nothing to do with their size.
    lower, upper : float
        Ends of the distribution; no value lies beyond them.
    confidence : float
        Of the interval; each side errs with at most half the rest.

    Returns
    -------
    tuple of float
        Both ends of the interval.

    References
    ----------
    I. Waudby-Smith, A. Ramdas, Estimating means of bounded random variables by betting,
    J. R. Statist. Soc. B 86 (2024) 1-27: the capitals of (23) to (26), each by itself.
    """
    miss = (1 - confidence) / 2
    return (
        least_mean(values, lower, miss),
        -least_mean(-values, -upper, miss),
    )


def least_mean(values: Array, lower: float, miss: float) -> float:
    """Bound the mean from below; the distribution may reach up as far as it will.

    Parameters
    ----------
    values : float64[n]
        As of `mean_between`.
    lower : float
        Least possible value.
    miss : float
        Probability with which the bound may lie above the mean.
    """
    # only the size of the first stakes hangs on it: measured to do no harm
    scale = float(values.max()) - lower
    if scale <= 0:
        return lower
    y = (values - lower) / scale
    wanted, tiny = math.log(1 / miss), 1e-300
    bets = y, _stakes(y, wanted), wanted
    if not _gain(tiny, *bets) > 0:
        return lower
    # nobody wins who bets on more than the largest; a closure would stay in memory
    m = brentq(_gain, tiny, 1.0, args=bets, xtol=1e-15, rtol=PRECISION)
    return lower + scale * float(m)


def _stakes(y: Array, wanted: float) -> Array:
    """Choose what is staked in each trial."""
    n = len(y)
    count = np.arange(1, n + 1)
    mean = (0.5 + np.cumsum(y)) / (count + 1)
    variance = (0.25 + np.cumsum((y - mean) ** 2)) / (count + 1)
    # each stake knows the trials before it, and not its own, but for the scale
    return np.asarray(np.sqrt(2 * wanted / (n * np.append(0.25, variance[:-1]))))


def _gain(m: float, y: Array, stake: Array, wanted: float) -> float:
    """Return the logarithm of the capital over what is wanted."""
    capital = np.minimum(stake, MOST_STAKED / m)
    capital *= y - m
    return float(np.log1p(capital, out=capital).sum()) - wanted
