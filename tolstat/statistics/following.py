"""Shares judged again and again while trials are added, and when that will end."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import bdtr, betainc, betaincinv, betaln

from tolstat.statistics.estimate import Estimate

PRIOR = 0.5  # of Jeffreys' beta distribution, both parameters: it mixes the bets
CHANCE = 0.8  # with which the trials that are said to be needed decide
GROWTH = 1.25  # between numbers of trials that are tried
MOST_TRIALS = 10**9
POSTERIOR = 200  # shares that stand for what the trials leave open


def followed(count: int, trials: int, confidence: float = 0.95) -> Estimate:
    """Estimate a share, with an interval that holds however often one looks.

    Parameters
    ----------
    count : int
        Trials that have the property.
    trials : int
        All trials, at least one.
    confidence : float
        That the interval holds the share after every trial, from the first to the last
        that is ever added; each side errs with at most half the rest.

    Returns
    -------
    Estimate
        Whose interval is 1.2 to 2.2 times as wide as that of Clopper and Pearson, which
        holds at one number of trials, chosen beforehand: least with none, more with
        more machines.

    References
    ----------
    H. Robbins, Statistical methods related to the law of the iterated logarithm, Ann.
    Math. Stat. 41 (1970) 1397-1409: mixtures of likelihood ratios, and Ville's
    inequality.
    """
    wanted = math.log(2 / (1 - confidence))
    upper = _most(count, trials, wanted)
    lower = 1 - _most(trials - count, trials, wanted)
    return Estimate(count / trials, lower, upper)


def against(count: int, trials: int, share: float) -> float:
    """Return the evidence that the property is rarer than a share: a logarithm.

    Parameters
    ----------
    count, trials
        As of `followed`.
    share : float
        Between 0 and 1.

    Returns
    -------
    float
        Of the likelihood of smaller shares, averaged over Jeffreys' prior, over that of
        this one: if the share is this or larger, it ever exceeds log(k) with a
        probability of at most 1/k.
    """
    a, b = count + PRIOR, trials - count + PRIOR
    left = betainc(a, b, share)
    if left == 0:
        return -math.inf
    averaged = betaln(a, b) + math.log(left)
    averaged -= betaln(PRIOR, PRIOR) + math.log(betainc(PRIOR, PRIOR, share))
    return float(
        averaged - count * math.log(share) - (trials - count) * math.log1p(-share)
    )


def _most(count: int, trials: int, wanted: float) -> float:
    """Return the largest share that the evidence against is not wanted at."""
    if count == trials:
        return 1.0

    def excess(share: float) -> float:
        return max(against(count, trials, share), -1.0) - wanted

    nearly = 1 - 1e-15
    if excess(nearly) <= 0:
        return 1.0
    return float(brentq(excess, max(count / trials, 1e-15), nearly, rtol=1e-10))


def trials_that_decide(count: int, trials: int, share: float, confidence: float) -> int:
    """Return how many trials will tell whether the property is rarer than a share.

    Parameters
    ----------
    count, trials, confidence
        As of `followed`.
    share : float
        That is to be exceeded or not.

    Returns
    -------
    int
        The least number, of those about a quarter apart, that decides with a chance of
        80 %, over what the trials so far leave open of the share (Jeffreys'
        posterior), and at which it can be found rarer; 0 if that is beyond 1e9.
    """
    wanted = math.log(2 / (1 - confidence))
    a, b = count + PRIOR, trials - count + PRIOR
    possible = betaincinv(a, b, (np.arange(POSTERIOR) + 0.5) / POSTERIOR)

    def decides(growth: int) -> bool:
        n = grown(trials * GROWTH**growth)
        fewest, most = _deciding(n, share, wanted)
        if fewest < count:  # even with no more beyond it could not be met
            return False
        rarer = _at_most(fewest - count, n - trials, possible)
        oftener = 1 - _at_most(most - count - 1, n - trials, possible)
        return float(np.mean(rarer + oftener)) >= CHANCE

    most = math.ceil(math.log(MOST_TRIALS / trials, GROWTH))
    growth = _last(lambda k: not decides(k), 0, most) + 1
    return grown(trials * GROWTH**growth) if growth <= most else 0


def grown(n: float) -> int:
    """Round a number of trials up to two digits."""
    unit: int = 10 ** max(math.floor(math.log10(n)) - 1, 0)
    return unit * math.ceil(n / unit)


def _deciding(trials: int, share: float, wanted: float) -> tuple[int, int]:
    """Return the largest count that tells "rarer", and the least that tells "not"."""

    def rarer(count: int) -> bool:
        return against(count, trials, share) >= wanted

    def oftener(count: int) -> bool:
        return against(trials - count, trials, 1 - share) >= wanted

    return (
        _last(rarer, -1, math.floor(share * trials)),
        _last(lambda k: not oftener(k), math.floor(share * trials), trials) + 1,
    )


def _last(holds: Callable[[int], bool], known: int, end: int) -> int:
    """Return the last number from `known` to `end` for which something holds."""
    low, high = known, end + 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _at_most(
    count: int, trials: int, shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the probability of at most so many."""
    if count < 0:
        return np.zeros_like(shares)
    return np.asarray(bdtr(min(count, trials), trials, shares))
