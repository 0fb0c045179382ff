"""Intervals of Latin hypercube and Sobol' samples, from their replicates.

The scatter between replicates shows how well the trials average. It does not show units
so rare that no replicate contains one: every interval is widened by their possible
contribution.
"""

import math
from bisect import bisect_left

import numpy as np
from scipy.special import stdtrit

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.estimate import Estimate, Lack, NoInterval, enclosing
from tolstat.statistics.intervals.moments import ANYWHERE, Reach, few_leave
from tolstat.statistics.intervals.quantiles import median_unbiased

LEAST_IN_EACH = 16
LEAST_OUTSIDE = 30  # expected trials outside a quantile
WIDER = 1.1  # times Student's interval: replicates of skewed statistics are not normal


def never_met(trials: int, replicates: int, confidence: float = 0.95) -> float:
    """Return the share of the units that all replicates may have missed.

    It follows by Chebyshev's one-sided inequality for the number of units in each
    replicate, whose variance is assumed to be at most that of independent trials. A
    larger share is missed with a probability of half of 1 - confidence.

    References
    ----------
    A. B. Owen, Monte Carlo variance of scrambled net quadrature, SIAM J. Numer. Anal.
    34 (1997) 1884-1910: true of Latin hypercubes but for a factor n/(n - 1); scrambled
    nets may have a larger factor. The bound was measured to hold.
    """
    if not trials:
        return 1.0
    met = ((1 - confidence) / 2) ** (-1 / replicates) - 1
    return float(min(met * replicates / trials, 1.0))


def mean_of_replicates(
    values: Array,
    replicate: Integers,
    reach: Reach = ANYWHERE,
    confidence: float = 0.95,
) -> Estimate:
    """Estimate the mean of Latin hypercube or Sobol' trials.

    The interval is Student's, of the replicates' means, a tenth wider, and wider by the
    possible contribution of units that no replicate contains.

    Parameters
    ----------
    values : float64[trial]
        The response, none NaN.
    replicate : int64[trial]
        Number of the independent randomisation that each trial belongs to.

    References
    ----------
    A. B. Owen, Monte Carlo Theory, Methods and Examples, chapter 17: randomised
    quasi-Monte Carlo, replicates.
    """
    value = float(values.mean()) if len(values) else math.nan
    if reason := missing(values, replicate):
        return Estimate(value, reason=reason)
    lower, upper = reach.ends(values)
    if lower == upper:
        return Estimate(value, reason=NoInterval(Lack.UNEQUAL_REPLICATES))
    means = np.bincount(replicate, values) / np.bincount(replicate)
    return _between(means, value, len(values), lower, upper, confidence)


def _between(
    means: Array,
    value: float,
    trials: int,
    lower: float,
    upper: float,
    confidence: float,
) -> Estimate:
    """Return a mean with its interval, from the means of replicates."""
    half = half_width(means, confidence)
    rare = never_met(trials, len(means), confidence)
    low, high = value - half, value + half
    # replicates may contain too many or too few units, by that share
    most = rare * max(low - lower, upper - high)
    return Estimate(value, max(low - most, lower), min(high + most, upper))


def sigma_of_replicates(
    values: Array,
    replicate: Integers,
    reach: Reach = ANYWHERE,
    confidence: float = 0.95,
) -> Estimate:
    """Estimate the standard deviation, with the interval of the mean of squares."""
    value = float(values.std(ddof=1)) if len(values) > 1 else math.nan
    if reason := missing(values, replicate) or few_leave(values, reach):
        return Estimate(value, reason=reason)
    centre, (lower, upper) = float(values.mean()), reach.ends(values)
    squares = (values - centre) ** 2
    between = Reach((0.0, max(upper - centre, centre - lower) ** 2))
    mean_square = mean_of_replicates(squares, replicate, between, confidence)
    if mean_square.reason:
        return Estimate(value, reason=mean_square.reason)
    low, high = math.sqrt(max(mean_square.lower, 0.0)), math.sqrt(mean_square.upper)
    return enclosing(value, low, high)


def share_from_replicates(units: Truths, replicate: Integers) -> Estimate:
    """Estimate a share of Latin hypercube or Sobol' trials, as `mean_of_replicates`.

    A property of bool[trial] units that no trial has may be as frequent as `never_met`.
    """
    share = Reach((0.0, 1.0))
    return mean_of_replicates(units.astype(np.float64), replicate, share)


def quantile_of_replicates(
    values: Array, replicate: Integers, share: float, confidence: float = 0.95
) -> Estimate:
    """Estimate a quantile of Latin hypercube or Sobol' trials.

    At each value, the fraction of units below it has an interval. The quantile may be
    any value whose interval contains `share`. There is no interval if fewer than thirty
    trials are expected outside. Other arguments are as of `mean_of_replicates`.

    References
    ----------
    R. S. Woodruff, Confidence intervals for medians and other position measures, J. Am.
    Statist. Assoc. 47 (1952) 635-646.
    """
    ordered = np.sort(values)
    value = median_unbiased(ordered, share) if len(values) else math.nan
    if reason := missing(values, replicate):
        return Estimate(value, reason=reason)
    n, sizes = len(values), np.bincount(replicate)
    needed = math.ceil(LEAST_OUTSIDE / min(share, 1 - share))
    if n < needed:
        return Estimate(value, reason=NoInterval(Lack.TRIALS, needed=needed))
    in_order = replicate[np.argsort(values)]

    def share_of(stop: int) -> Estimate:
        """Estimate the share of the units below the value at a place."""
        shares = np.bincount(in_order[:stop], minlength=len(sizes)) / sizes
        return _between(shares, stop / n, n, 0.0, 1.0, confidence)

    def from_below(k: int) -> bool:
        return share_of(int(np.searchsorted(ordered, ordered[k]))).upper >= share

    def from_above(k: int) -> bool:
        stop = int(np.searchsorted(ordered, ordered[k], "right"))
        return share_of(stop).lower >= share

    low = bisect_left(range(n), True, key=from_below) - 1
    high = min(bisect_left(range(n), True, key=from_above), n - 1)
    return enclosing(value, float(ordered[low]), float(ordered[high]))


def missing(values: Array, replicate: Integers) -> NoInterval | None:
    """Return why replicates give no interval; None if they give one."""
    if not len(values):
        return NoInterval(Lack.ANY_DONE)
    sizes = np.bincount(replicate)
    if len(sizes) < 2 or sizes.min() < LEAST_IN_EACH:
        return NoInterval(Lack.REPLICATES, size=LEAST_IN_EACH)
    return None


def half_width(means: Array, confidence: float = 0.95) -> float:
    """Return half of Student's interval of the replicates' means, a tenth wider."""
    z = float(stdtrit(len(means) - 1, 0.5 + confidence / 2))
    return WIDER * z * float(means.std(ddof=1)) / math.sqrt(len(means))
