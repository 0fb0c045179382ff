"""Intervals of shares: exact, anytime-valid, and of weighted counts."""

import math

import numpy as np
from scipy.special import betainc, betaincinv, betaln, gammaincinv

from tolstat.arrays import Array
from tolstat.statistics.estimate import CONFIDENCE, Estimate

PRIOR = 0.5  # of Jeffreys' beta distribution, both parameters: it mixes the bets


def proportion(count: float, trials: float, confidence: float = 0.95) -> Estimate:
    """Estimate a share from a count, with the interval of Clopper and Pearson.

    Count and trials may be those that dependent ones are worth.

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


def anytime_valid(count: int, trials: int) -> Estimate:
    """Estimate a share, with an anytime-valid interval.

    The interval is 1.2 (count 0) to 2.2 times as wide as that of Clopper and Pearson.
    Theirs holds only at one number of trials, chosen beforehand; this one holds the
    share after every added trial with a probability of 95 %, each side errs with at
    most half of the rest.

    References
    ----------
    H. Robbins, Statistical methods related to the law of the iterated logarithm, Ann.
    Math. Stat. 41 (1970) 1397-1409: mixtures of likelihood ratios, and Ville's
    inequality.
    """
    evidence = math.log(2 / (1 - CONFIDENCE))
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
