"""Shares and quantiles of other machines than were drawn, from weighted trials."""

from __future__ import annotations

import math
from bisect import bisect_left

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import NONE_DONE, Estimate
from tolstat.statistics.intervals.betting import surely_more
from tolstat.statistics.intervals.gamma_interval import gamma_ends
from tolstat.statistics.intervals.moments import order_of
from tolstat.statistics.reweighting.weights import Weights

Array = NDArray[np.float64]


def weighted_share(
    machines: NDArray[np.bool_], weights: Weights, confidence: float = 0.95
) -> Estimate:
    """Estimate the share that machines would have if others were drawn.

    Parameters
    ----------
    machines : bool[trial]
        Which of them have the property; the trials independent.
    weights : Weights
        Of the trials.
    confidence : float
        Of the interval.

    Returns
    -------
    Estimate
        With the gamma interval of a sum of weighted counts. The heaviest of all trials
        stands for the next machine beyond, which may be anywhere: conservative, and
        above zero even where no machine is beyond. The value of more than half is what
        the others leave: without any of them it is one.
    """
    if weights.too_few:
        return Estimate(math.nan, reason=weights.too_few)
    each, n = weights.values, len(weights.values)
    counted = weights.capped[machines] / n
    lower, upper = gamma_ends(counted, weights.most / n, confidence)
    upper = min(upper + weights.cut, 1.0)
    value, others = (each[machines] / n).sum(), (each[~machines] / n).sum()
    if value > others:
        value = 1 - others
        upper = max(upper, value)
    value = min(value, upper)
    return Estimate(float(value), float(min(lower, value)), float(upper))


def share_left(
    machines: NDArray[np.bool_], weights: Weights, confidence: float = 0.95
) -> Estimate:
    """Estimate a share by that of the few machines left, as `weighted_share` does."""
    return weighted_share(~machines, weights, confidence).complement


def weighted_quantile(
    values: Array, weights: Weights, share: float, confidence: float = 0.95
) -> Estimate:
    """Estimate a quantile of other machines than were drawn.

    Parameters
    ----------
    values : float64[trial]
        None NaN; infinite where a failed trial stands.
    weights, confidence
        As of `weighted_share`.
    share : float
        Between 0 and 1.

    Returns
    -------
    Estimate
        Between the trials of which bets do not tell that more, or fewer, machines lie
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
    lower, upper = float(at[low]), float(at[high])
    if not math.isfinite(lower + upper):
        return Estimate(shown, reason="failed trials reach there")
    return Estimate(value, min(lower, value), max(upper, value))
