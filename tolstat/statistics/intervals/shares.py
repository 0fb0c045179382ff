"""Intervals of shares: exact, anytime-valid, and of weighted counts; exact quantiles.

A quantile is the value below which a share of the units lies.
"""

import math
from collections.abc import Iterable

import numpy as np
from scipy.special import bdtr, bdtrik, betainc, betaincinv, betaln, gammaincinv

from tolstat.arrays import Array
from tolstat.statistics.estimate import FAILED_THERE, NONE_DONE, Estimate, Lack, Reason

PRIOR = 0.5  # of Jeffreys' beta distribution, both parameters: it mixes the bets


def proportion(count: int, trials: int, confidence: float = 0.95) -> Estimate:
    """Estimate a share from a count, with the interval of Clopper and Pearson.

    References
    ----------
    C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404-413.

    Examples
    --------
    >>> proportion(3, 1000)
    0.003 (0.0006191 to 0.00874202)
    """
    miss = (1 - confidence) / 2
    lower = betaincinv(count, trials - count + 1, miss) if count > 0 else 0.0
    upper = betaincinv(count + 1, trials - count, 1 - miss) if count < trials else 1.0
    return Estimate(count / trials, float(lower), float(upper))


def anytime_valid(count: int, trials: int, confidence: float = 0.95) -> Estimate:
    """Estimate a share, with an anytime-valid interval.

    The interval is 1.2 (count 0) to 2.2 times as wide as that of Clopper and Pearson.
    Theirs holds only at one number of trials, chosen beforehand.

    Parameters
    ----------
    confidence : float
        Probability that the interval holds the share after every added trial; each
        side errs with at most half of 1 - confidence.

    References
    ----------
    H. Robbins, Statistical methods related to the law of the iterated logarithm, Ann.
    Math. Stat. 41 (1970) 1397-1409: mixtures of likelihood ratios, and Ville's
    inequality.
    """
    evidence = math.log(2 / (1 - confidence))
    upper = _most(count, trials, evidence)
    lower = 1 - _most(trials - count, trials, evidence)
    return Estimate(count / trials, lower, upper)


def evidence_against(count: int, trials: int, share: float) -> float:
    """Return the log evidence that the property is rarer than a share.

    The ratio is the likelihood of smaller shares, averaged over Jeffreys' prior, over
    that of this share. If the true share is not smaller, the evidence ever exceeds
    log(k) with a probability of at most 1/k.
    """
    a, b = count + PRIOR, trials - count + PRIOR
    below = betainc(a, b, share)
    if below == 0:
        return -math.inf
    averaged = betaln(a, b) + math.log(below)
    averaged -= betaln(PRIOR, PRIOR) + math.log(betainc(PRIOR, PRIOR, share))
    return float(
        averaged - count * math.log(share) - (trials - count) * math.log1p(-share)
    )


def _most(count: int, trials: int, evidence: float) -> float:
    """Return the largest share against which the evidence is not enough."""
    from scipy.optimize import brentq  # slow to import

    if count == trials:
        return 1.0

    def excess(share: float) -> float:
        return max(evidence_against(count, trials, share), -1.0) - evidence

    nearly = 1 - 1e-15
    if excess(nearly) <= 0:
        return 1.0
    return float(brentq(excess, max(count / trials, 1e-15), nearly, rtol=1e-10))


def gamma_ends(
    counts: Array, one_more: float, confidence: float = 0.95
) -> tuple[float, float]:
    """Return the ends of the interval of the expectation of a sum.

    Parameters
    ----------
    counts : float64[unit]
        Contribution of each counted unit to the sum.
    one_more : float
        Possible contribution of the next unit; above 0.

    References
    ----------
    M. P. Fay, E. J. Feuer, Confidence intervals for directly standardized rates,
    Statistics in Medicine 16 (1997) 791-801.
    """
    y, v = counts.sum(), np.sum(counts**2)
    miss = (1 - confidence) / 2
    lower = v / y * gammaincinv(y**2 / v, miss) if v > 0 else 0.0
    more, its_square = y + one_more, v + one_more**2
    shape, scale = more**2 / its_square, its_square / more
    return float(lower), float(scale * gammaincinv(shape, 1 - miss))


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
        return Estimate(value, reason=Reason(Lack.TRIALS, needed=needed))
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
