"""Shares and quantiles of other distributions, from weighted trials."""

from __future__ import annotations

import math
from bisect import bisect_left

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import NONE_DONE, Estimate, enclosing
from tolstat.statistics.intervals.betting import surely_more
from tolstat.statistics.intervals.gamma_interval import gamma_ends
from tolstat.statistics.intervals.moments import order_of
from tolstat.statistics.reweighting.weights import Weights

Array = NDArray[np.float64]


def weighted_share(units: NDArray[np.bool_], weights: Weights) -> Estimate:
    """Estimate a share of the units of other distributions.

    Parameters
    ----------
    units : bool[trial]
        Which of the independent trials have the property.
    weights : Weights
        Of the trials.

    Returns
    -------
    Estimate
        With the gamma interval of a sum of weighted counts. The next unit is assumed as
        heavy as the heaviest of all trials: conservative, and above zero even where no
        trial has the property. A value above one half is one less that of the others.
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


def share_by_complement(units: NDArray[np.bool_], weights: Weights) -> Estimate:
    """Estimate a share from that of the few other units, as `weighted_share` does."""
    return weighted_share(~units, weights).complement


def weighted_quantile(
    values: Array, weights: Weights, share: float, confidence: float = 0.95
) -> Estimate:
    """Estimate a quantile of other distributions; values are infinite in failed trials.

    The ends are the trials at which bets do not show that more, or fewer, units lie
    below; none where the heaviest trials would leave one of them open.
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
