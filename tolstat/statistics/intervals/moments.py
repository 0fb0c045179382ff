"""Mean and standard deviation (sigma), with intervals for any distribution.

No sample bounds the mean of an arbitrary response: one unit in a thousand, far enough
away, changes the mean and is mostly missing from the sample. So each interval holds for
any distribution between two ends. The ends are those of the declared range (a share: 0
to 1). Without one, no unit is assumed to lie more than twice the range of trials and
limit outside that range; the assumption is printed with the number.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import betaincinv

from tolstat.arrays import Array, Integers
from tolstat.statistics.estimate import Estimate, Lack, NoInterval, enclosing
from tolstat.statistics.intervals.weights import Weights, mean_between

Ends = tuple[float, float]
OPEN: Ends = (-math.inf, math.inf)

LEAST_TRIALS = 20  # trials from which an interval is narrower than its ends
REACH = 2.0  # assumed distance outside trials and limit, over their range
LEAST_LEAVING = 20  # trials outside a point mass from which sigma has an interval
MOST_EQUAL = 0.5  # least share of the trials in such a point mass
PILOT = 10  # one trial in so many gives the centre of the squares
SHARED = 0.8  # of the error of sigma for the squares; the rest is for the mean


def unseen(trials: int) -> float:
    """Return the share of the units that may lie outside all independent trials.

    With 95 % confidence no larger share lies below the least or above the largest.

    References
    ----------
    S. S. Wilks, Ann. Math. Stat. 12 (1941) 91-96: the share between the extremes has a
    beta distribution.
    """
    if trials < 2:
        return 1.0
    return float(1 - betaincinv(trials - 1, 2, 1 - 0.95))


class Reach(NamedTuple):
    """The ends between which a response is assumed to lie."""

    # range that no unit can leave; an open end is infinite
    declared: Ends | None = None
    # permitted values: they give the scale of a relevant deviation
    limit: Ends | None = None

    def times(self, factor: float) -> Reach:
        """Return the reach in another unit."""
        return Reach(*(ends and (factor * ends[0], factor * ends[1]) for ends in self))

    @property
    def known(self) -> bool:
        """Whether both ends are declared."""
        return self.declared is not None and all(map(math.isfinite, self.declared))

    def ends(self, values: Array) -> Ends:
        """Return the ends, from float64[n] trials; equal where there is no scale."""
        seen = [float(values.min()), float(values.max())]
        seen += [end for end in self.limit or () if math.isfinite(end)]
        least, largest = min(seen), max(seen)
        distance = REACH * (largest - least)
        lower, upper = self.declared or OPEN
        return (
            lower if math.isfinite(lower) else least - distance,
            upper if math.isfinite(upper) else largest + distance,
        )


ANYWHERE = Reach()


def mean_of(
    values: Array,
    reach: Reach = ANYWHERE,
    confidence: float = 0.95,
    weights: Weights | None = None,
) -> Estimate:
    """Estimate the mean of independent trials.

    The interval holds for any distribution between the ends; see `mean_between`. There
    is none if all trials are equal and no end is known.
    """
    mean = _average(values, weights) if len(values) else math.nan
    if reason := _missing(values, reach, weights):
        return Estimate(mean, reason=reason)
    order = order_of(len(values))
    lower, upper = mean_between(
        values[order], *reach.ends(values), confidence, weights and weights.part(order)
    )
    return enclosing(mean, lower, upper)


def sigma_of(
    values: Array,
    reach: Reach = ANYWHERE,
    confidence: float = 0.95,
    weights: Weights | None = None,
) -> Estimate:
    """Estimate the standard deviation, as `mean_of` does the mean.

    The interval comes from that of the mean of squares. There is none if fewer than
    twenty trials differ from a value that half of all share: these dominate sigma.
    """
    sigma = float(values.std(ddof=1)) if len(values) > 1 else math.nan
    met = values
    if weights and len(values):
        squared = (values - _average(values, weights)) ** 2
        sigma, met = math.sqrt(_average(squared, weights)), values[weights.values > 0]
    if reason := _missing(values, reach, weights) or few_leave(met, reach):
        return Estimate(sigma, reason=reason)
    lower, upper = reach.ends(values)
    order = order_of(len(values))
    values, mixed = values[order], weights and weights.part(order)
    # E(x - c)^2 = sigma^2 + (mean - c)^2, and a tenth of the trials give a good c
    pilot = max(len(values) // PILOT, 1)
    first, rest = np.split(np.arange(len(values)), [pilot])
    c = _average(values[:pilot], mixed and mixed.part(first))
    largest = max((lower - c) ** 2, (upper - c) ** 2)
    miss = 1 - confidence
    squares = (values[pilot:] - c) ** 2
    low, high = mean_between(
        squares, 0.0, largest, 1 - SHARED * miss, mixed and mixed.part(rest)
    )
    a, b = mean_between(values, lower, upper, 1 - (1 - SHARED) * miss, mixed)
    least, most = max(a - c, c - b, 0.0) ** 2, max((a - c) ** 2, (b - c) ** 2)
    low, high = (math.sqrt(max(x, 0.0)) for x in (low - most, high - least))
    return enclosing(sigma, low, high)


def few_leave(values: Array, reach: Reach = ANYWHERE) -> NoInterval | None:
    """Return a reason if few trials differ from the value that half of all share.

    None otherwise, and with a declared range: few trials cannot dominate there.
    """
    if not len(values) or reach.known:
        return None
    ordered = np.sort(values)
    middle = ordered[len(ordered) // 2]
    first, after = np.searchsorted(ordered, [middle, np.nextafter(middle, math.inf)])
    leaving = len(ordered) - int(after - first)
    if leaving >= LEAST_LEAVING or leaving > (1 - MOST_EQUAL) * len(ordered):
        return None
    if leaving == 1:
        return NoInterval(Lack.ONE_MORE_APART)
    return NoInterval(Lack.MORE_APART, trials=leaving)


def _average(values: Array, weights: Weights | None) -> float:
    """Return the mean of float64[n] trials, or of the units that they stand for."""
    if weights is None or not weights.values.any():
        return float(values.mean())
    return float(np.average(values, weights=weights.values))


def _missing(values: Array, reach: Reach, weights: Weights | None) -> NoInterval | None:
    """Return why there is no interval; None if there is one."""
    if not len(values):
        return NoInterval(Lack.ANY_DONE)
    if weights and (reason := weights.too_few):
        return reason
    if len(values) < LEAST_TRIALS:
        return NoInterval(Lack.TRIALS, needed=LEAST_TRIALS)
    lower, upper = reach.ends(values)
    if lower == upper:
        share = unseen(weights.number if weights else len(values))
        return NoInterval(Lack.UNEQUAL_TRIALS, units=math.floor(1 / share))
    return None


@lru_cache(maxsize=8)
def order_of(n: int) -> Integers:
    """Return the order in which n trials are bet on, independent of their values."""
    # the numbers of this generator never change
    return np.random.RandomState(n).permutation(n)
