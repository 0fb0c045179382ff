"""Shares and quantiles of other distributions, from weighted trials."""

import math
from collections.abc import Callable, Iterable
from itertools import count

import numpy as np
from scipy.special import ndtri

from tolstat.arrays import Array, Truths
from tolstat.statistics.estimate import (
    CONFIDENCE,
    NONE_DONE,
    Estimate,
    Lack,
    NoInterval,
    enclosing,
)
from tolstat.statistics.intervals.moments import order_of
from tolstat.statistics.intervals.shares import gamma_ends
from tolstat.statistics.intervals.weights import Weights, effective_number, log_gain

ENOUGH = 100  # effective sample size of the trials out of limit
FEW = 10  # up to here the largest weight of all trials counts, too
MOST_TRIES = 8  # of expected places, before halves
COUNTED = 10  # units out of limit from which their count is nearly normal


def weighted_share(units: Truths, weights: Weights) -> Estimate:
    """Estimate a share of the units of other distributions.

    Returns
    -------
    Estimate
        With the gamma interval of a sum of weighted counts. The next unit is assumed as
        heavy as the heaviest trial: conservative, and above zero even if no trial has
        the property. Of trials that were searched, that of `rare_share`, unless other
        distributions leave few of them. A value above one half is 1 less the share of
        the other units.
    """
    values, n = weights.values, len(weights.values)
    if weights.searched:
        # other distributions than the study's: no kind of unit limits the next weight
        few = weights.uncovered and effective_number(values[units]) <= FEW
        if not few:
            return rare_share(units, values, weights.uncovered)
    if weights.too_few:
        return Estimate(math.nan, reason=weights.too_few)
    counted = weights.capped[units] / n
    lower, upper = gamma_ends(counted, weights.most / n)
    upper = min(upper + weights.cut, 1.0)
    value, others = (values[units] / n).sum(), (values[~units] / n).sum()
    if value > others:
        value = 1 - others
        upper = max(upper, value)
    value = min(value, upper)
    return Estimate(float(value), float(min(lower, value)), float(upper))


def weighted_quantiles(
    values: Array, weights: Weights, shares: Iterable[float], confidence: float = 0.95
) -> dict[float, Estimate]:
    """Estimate quantiles of other distributions, by share.

    Values are infinite in failed trials. The ends are the trials at which bets do not
    show that more, or fewer, units lie below. There is no interval if the heaviest
    trials leave an end open.
    """
    if not len(values):
        return dict.fromkeys(shares, NONE_DONE)
    n, miss = len(values), (1 - confidence) / 2
    ordered = np.argsort(values, kind="stable")
    ascending, below = values[ordered], np.cumsum(weights.values[ordered])
    last = np.flatnonzero(np.append(ascending[1:] != ascending[:-1], True))  # of ties
    ends, order = ascending[last], order_of(n)
    mixed, mixed_weights = values[order], weights.part(order)
    counts = weights.capped[ordered]
    units, squares = np.cumsum(counts)[last], np.cumsum(counts**2)[last]

    def end(share: float, side: int) -> int:
        """Return the first value below which more, or not fewer, units surely lie."""

        def gain(k: int) -> float:
            below = mixed <= ends[k]
            flagged = below if side > 0 else ~below
            return side * log_gain(flagged, share, miss, mixed_weights)

        S, Q = (c if side > 0 else c[-1] - c for c in (units, squares))
        variance = (1 - 2 * share) * Q + share**2 * squares[-1]
        excess = S - share * (units[-1] + n * weights.cut)
        e = 2 * math.log(1 / miss)  # evidence: the stakes of each bet nearly agree
        return _first_gain(gain, side * (np.sqrt(e / variance) * excess - e))

    estimates = {}
    for share in shares:
        position = int(np.searchsorted(below, share * below[-1]))
        value = float(ascending[min(position, n - 1)])
        finite = value if math.isfinite(value) else math.nan
        if weights.too_few:
            estimates[share] = Estimate(finite, reason=weights.too_few)
            continue
        low, high = end(1 - share, -1), end(share, 1)
        all_trials = np.ones(n, np.bool_)
        if high == len(ends) or (
            low == 0 and not log_gain(all_trials, 1 - share, miss, mixed_weights) > 0
        ):
            reason = NoInterval(Lack.LIGHT_WEIGHTS, trials=n)
            estimates[share] = Estimate(finite, reason=reason)
        else:
            estimates[share] = enclosing(value, float(ends[low]), float(ends[high]))
    return estimates


def _first_gain(gain: Callable[[int], float], expected: Array) -> int:
    """Return the first place with a gain above 0, their number if there is none.

    Gains rise nearly as the expected ones, which a few exact gains correct.
    """
    low, high, error = -1, len(expected), 0.0
    for tries in count():
        if high - low == 1:
            break
        k = int(np.searchsorted(expected, -error, "right"))
        k = min(max(k, low + 1), high - 1) if tries < MOST_TRIES else (low + high) // 2
        exact = gain(k)
        error = exact - float(expected[k])
        low, high = (low, k) if exact > 0 else (k, high)
    return high


def rare_share(out: Truths, weights: Array, uncovered: float = 0.0) -> Estimate:
    """Estimate the share of units out of limit.

    Parameters
    ----------
    out : bool[trial]
        Which of the independent trials are out of limit.
    weights : float64[trial]
        Density of each trial in the study over its density in the sample.
    uncovered : float
        Greatest share of the units that no trial stands for: they may be out of limit.

    Returns
    -------
    Estimate
        With the gamma interval of a sum of weighted counts. It needs the weight of one
        more unit out of limit: the largest weight of these trials. If their effective
        sample size n is below 100, it is 100/n times as large; up to 10, at least the
        largest weight of all trials. If none is out of limit, the upper end is `unmet`.
    """
    n = len(weights)
    if n == 0:
        return Estimate(math.nan, reason=NoInterval(Lack.LAST_STAGE))
    if not out.any():
        return Estimate(0.0, 0.0, unmet(weights))
    counts = weights[out] / n
    # weights of nearly zero have no effective sample size
    worth = max(effective_number(counts), FEW)
    next_one = counts.max() * max(1.0, ENOUGH / worth)
    if worth == FEW:
        next_one = max(next_one, weights.max() / n)
    lower, upper = gamma_ends(counts, float(next_one))
    value, upper = float(min(counts.sum(), 1.0)), min(upper + uncovered, 1.0)
    return Estimate(value, min(lower, 1.0), upper)


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
