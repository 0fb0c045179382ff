"""Shares with exact binomial intervals."""

from __future__ import annotations

from scipy.special import betaincinv

from tolstat.statistics.estimate import Estimate


def proportion(count: int, trials: int, confidence: float = 0.95) -> Estimate:
    """Estimate a share from a count, with the interval of Clopper and Pearson.

    Parameters
    ----------
    count : int
        Trials that have the property.
    trials : int
        All trials, at least one.
    confidence : float
        Of the interval.

    References
    ----------
    C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404-413.
    """
    miss = (1 - confidence) / 2
    lower = betaincinv(count, trials - count + 1, miss) if count > 0 else 0.0
    upper = betaincinv(count + 1, trials - count, 1 - miss) if count < trials else 1.0
    return Estimate(count / trials, float(lower), float(upper))
