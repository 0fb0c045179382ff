"""Quantiles with exact order-statistic intervals."""

import math
from collections.abc import Iterable

import numpy as np
from scipy.special import bdtr, bdtrik

from tolstat.arrays import Array
from tolstat.statistics.estimate import (
    FAILED_THERE,
    NONE_DONE,
    Estimate,
    Lack,
    NoInterval,
)


def quantiles(
    values: Array,
    shares: Iterable[float],
    confidence: float = 0.95,
    failed: int = 0,
    worst: int = 0,
) -> dict[float, Estimate]:
    """Estimate quantiles of a random sample by their shares.

    Parameters
    ----------
    failed : int
        Trials that have no value.
    worst : int
        Where these count: 1 above all others, -1 below, 0 unknown. If unknown, the
        interval holds for any place, and the value is that of the others.

    Returns
    -------
    dict of float to Estimate
        Median-unbiased quantiles of all units, failed ones included. The interval holds
        for any continuous distribution; with point masses it is conservative. There is
        none if no order statistic bounds a side, or if failed trials may lie there.

    References
    ----------
    H. A. David, H. N. Nagaraja, Order Statistics, 3rd ed., section 7.1.

    Examples
    --------
    >>> quantiles(np.arange(1.0, 101.0), [0.5])
    {0.5: 50.5 (40 to 61)}
    """
    ordered = np.sort(values)
    if not failed:
        return {share: _of_ordered(ordered, share, confidence) for share in shares}
    missing = np.full(failed, math.inf)
    above = np.concatenate([ordered, missing])
    below = np.concatenate([-missing, ordered])
    estimates = {}
    for share in shares:
        low = _of_ordered(above if worst > 0 else below, share, confidence)
        high = _of_ordered(below if worst < 0 else above, share, confidence)
        value = low.value if worst else median_unbiased(ordered, share)
        estimates[share] = Estimate(value, low.lower, high.upper)
        if not math.isfinite(low.lower + value + high.upper):
            finite = value if math.isfinite(value) else math.nan
            reason = low.reason or high.reason or FAILED_THERE
            estimates[share] = Estimate(finite, reason=reason)
    return estimates


def worst_side(permitted: tuple[float, float] | None) -> int:
    """Return the side on which failed trials count: 1 above, -1 below, 0 unknown."""
    lower, upper = permitted or (-math.inf, math.inf)
    return int(math.isfinite(upper)) - int(math.isfinite(lower))


def _of_ordered(ordered: Array, share: float, confidence: float) -> Estimate:
    n, miss = len(ordered), (1 - confidence) / 2
    if n == 0:
        return NONE_DONE
    value = median_unbiased(ordered, share)
    # P(X_(rank) > q) = P(fewer than rank of n lie below q)
    low_rank = _binomial_quantile(miss, n, share)
    high_rank = _binomial_quantile(1 - miss, n, share) + 1
    if low_rank < 1 or high_rank > n:
        # the least number from which the outermost trials bound it
        needed = math.ceil(math.log(miss) / math.log(max(share, 1 - share)))
        return Estimate(value, reason=NoInterval(Lack.TRIALS, needed=needed))
    return Estimate(value, float(ordered[low_rank - 1]), float(ordered[high_rank - 1]))


def median_unbiased(ordered: Array, share: float) -> float:
    """Interpolate a quantile of ascending values: Hyndman and Fan's method 8.

    `numpy.quantile` returns the same, but sorts again.
    """
    position = min(max((len(ordered) + 1 / 3) * share - 2 / 3, 0.0), len(ordered) - 1.0)
    below = int(position)
    above = min(below + 1, len(ordered) - 1)
    low, high = float(ordered[below]), float(ordered[above])
    # both may be infinite: failed trials
    return low if low == high else low + (position - below) * (high - low)


def _binomial_quantile(probability: float, n: int, share: float) -> int:
    """Return the least k with P(at most k of n) >= probability.

    `scipy.stats.binom.ppf` returns the same; importing it takes a second.
    """
    k: int = max(0, math.ceil(float(bdtrik(probability, n, share))))
    one_less = k > 0 and bool(bdtr(k - 1, n, share) >= probability)
    return k - 1 if one_less else k
