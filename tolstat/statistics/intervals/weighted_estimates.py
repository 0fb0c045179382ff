"""Shares and quantiles of other distributions, from weighted trials."""

from __future__ import annotations

import math
from bisect import bisect_left

import numpy as np
from scipy.special import ndtri

from tolstat.arrays import Array, Truths
from tolstat.statistics.estimate import CONFIDENCE, NONE_DONE, Estimate, enclosing
from tolstat.statistics.intervals.betting import surely_more
from tolstat.statistics.intervals.moments import order_of
from tolstat.statistics.intervals.shares import gamma_ends
from tolstat.statistics.intervals.weights import Weights, effective_number

ENOUGH = 100  # effective sample size of the trials out of limit
COUNTED = 10  # units out of limit from which their count is nearly normal


def weighted_share(units: Truths, weights: Weights) -> Estimate:
    """Estimate a share of the units of other distributions.

    Returns
    -------
    Estimate
        With the gamma interval of a sum of weighted counts. The next unit is assumed as
        heavy as the heaviest trial: conservative, and above zero even if no trial has
        the property. A value above one half is 1 less the share of the other units.
    """
    if weights.too_few:
        return Estimate(math.nan, reason=weights.too_few)
    each, n = weights.values, len(weights.values)
    counted = weights.capped[units] / n
    lower, upper = gamma_ends(counted, weights.most / n)
    upper = min(upper + weights.cut, 1.0)
    value, others = (each[units] / n).sum(), (each[~units] / n).sum()
    if value > others:
        value = 1 - others
        upper = max(upper, value)
    value = min(value, upper)
    return Estimate(float(value), float(min(lower, value)), float(upper))


def weighted_quantile(
    values: Array, weights: Weights, share: float, confidence: float = 0.95
) -> Estimate:
    """Estimate a quantile of other distributions; values are infinite in failed trials.

    The ends are the trials at which bets do not show that more, or fewer, units lie
    below. There is no interval if the heaviest trials leave an end open.
    """
    if not len(values):
        return NONE_DONE
    ordered = np.argsort(values, kind="stable")
    below = np.cumsum(weights.values[ordered])
    place = int(np.searchsorted(below, share * below[-1]))
    value = float(values[ordered[min(place, len(values) - 1)]])
    shown = value if math.isfinite(value) else math.nan
    if weights.too_few:
        return Estimate(shown, reason=weights.too_few)
    n, miss = len(values), (1 - confidence) / 2
    mixed, at = values[order_of(n)], values[ordered]
    mixed_weights = weights.part(order_of(n))

    def not_above(k: int) -> bool:
        return not surely_more(mixed > at[k], 1 - share, miss, mixed_weights)

    def above(k: int) -> bool:
        return surely_more(mixed <= at[k], share, miss, mixed_weights)

    low, high = (bisect_left(range(n), True, key=of) for of in (not_above, above))
    everything = np.ones(n, np.bool_)
    from_below = surely_more(everything, 1 - share, miss, mixed_weights)
    if not from_below or high == n:
        return Estimate(shown, reason=f"{n} trials are too few with these weights")
    return enclosing(value, float(at[low]), float(at[high]))


def rare_share(out: Truths, weights: Array) -> Estimate:
    """Estimate the share of units out of limit.

    Parameters
    ----------
    out : bool[trial]
        Which of the independent trials are out of limit.
    weights : float64[trial]
        Density of each trial in the study over its density in the sample.

    Returns
    -------
    Estimate
        With the gamma interval of a sum of weighted counts. The next unit is assumed as
        heavy as the heaviest trial out of limit. If the effective sample size of these
        is below 100, it is as heavy as the heaviest of all. If none is out of limit,
        the upper end is `unmet`.
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


def unmet(weights: Array) -> float:
    """Return the largest share of a kind of unit that is in no weighted trial.

    A larger one is missed with a chance of at most 2.5 %.
    """
    # a kind of share p has at least p over the largest weight in the sample
    missed = (1 - CONFIDENCE) / 2
    n, most = len(weights), float(weights.max())
    return float(min(most * -math.expm1(math.log(missed) / n), 1.0))


def plain_trials(share: Estimate) -> float:
    """Return the number of random trials with an equally narrow interval of a share.

    NaN if their count out of limit is too small for a normal distribution.
    """
    width, p = share.upper - share.lower, share.value
    if not (share.sure and p > 0 and width > 0):
        return math.nan
    sigmas = 2 * float(ndtri(1 - (1 - CONFIDENCE) / 2))
    trials = math.ceil(p * (1 - p) * (sigmas / width) ** 2)
    return float(trials) if trials * min(p, 1 - p) >= COUNTED else math.nan
