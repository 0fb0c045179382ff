"""Performance of a simulated response against its limit: Pp and Ppk.

Simulated machines prove no stable process, so it is performance (Pp, Ppk) and not
capability (Cp, Cpk), ISO 22514-1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import NONE_DONE, Estimate
from tolstat.statistics.intervals.moments import Ends, Reach
from tolstat.statistics.intervals.statistic import mean, quantiles_at, sigma
from tolstat.statistics.limits.limit import Limit, ppk_of
from tolstat.statistics.sample import Sample

Array = NDArray[np.float64]

LOW, MIDDLE, HIGH = 0.00135, 0.5, 0.99865
FAR = 100.0  # Ppk above which the spread is too small to be a measure
ONE_END = Estimate(math.nan, reason="the limit has one end")
STILL = Estimate(math.nan, reason="the response does not spread")


class Performance(NamedTuple):
    """Pp (NaN for a limit with one end) and Ppk."""

    pp: Estimate
    ppk: Estimate


def by_percentiles(
    values: Array, sample: Sample, limit: Limit, confidence: float = 0.95
) -> Performance:
    """Estimate Pp and Ppk from percentiles: for responses of any shape.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    sample : Sample
        The trials.
    limit : Limit
        What is permitted.
    confidence : float
        Of the intervals.

    Returns
    -------
    Performance
        Pp = (U - L)/(X99.865 - X0.135), Ppk the lesser of (U - X50)/(X99.865 - X50) and
        (X50 - L)/(X50 - X0.135). The intervals follow from those of the percentiles,
        each with its share of the error: conservative. Independent trials need 3544.

    References
    ----------
    ISO 22514-2:2017, method M4 (percentiles).
    """
    lower, upper = limit.permitted
    # up to three percentiles stand behind one number: share the error among them
    shared = 1 - (1 - confidence) / 3
    shares = (LOW, MIDDLE, HIGH)
    found = quantiles_at(values, sample, shares, limit.permitted, shared)
    low, middle, high = found.values()
    if not sample.done.any():
        return Performance(NONE_DONE, NONE_DONE)
    if np.ptp(values[sample.done]) == 0:  # no number of trials would say more
        return Performance(STILL, STILL)
    ends = [(upper, high, 1), (lower, low, -1)]
    sides = [
        _side(end, middle, far, sign) for end, far, sign in ends if math.isfinite(end)
    ]
    reason = next((side.reason for side in sides if side.reason), "")
    values_of = [side.value for side in sides]
    ppk = Estimate(
        math.nan if np.isnan(values_of).any() else min(values_of),
        min(side.lower for side in sides),
        min(side.upper for side in sides),
        reason,
    )
    pp = ONE_END
    if limit.ends == 2:
        width = upper - lower
        pp = Estimate(
            _ratio(width, high.value - low.value),
            _ratio(width, high.upper - low.lower),
            _ratio(width, high.lower - low.upper),
            reason,
        )
    return Performance(_worth_saying(pp), _worth_saying(ppk))


def _side(end: float, middle: Estimate, far: Estimate, sign: int) -> Estimate:
    """Estimate one side of Ppk: the end's distance over the far percentile's."""

    def ratio(m: float, f: float) -> float:
        return _ratio(sign * (end - m), sign * (f - m))

    value = ratio(middle.value, far.value)
    if not (middle.sure and far.sure):
        return Estimate(value, reason=far.reason or middle.reason)
    if middle.lower == far.lower or middle.upper == far.upper:
        return Estimate(math.nan, reason="half of the machines share one value")
    if far.lower == far.upper:
        return Estimate(math.nan, reason="the outermost machines share one value")
    # monotonous in either percentile: the extremes lie at the corners
    corners = [
        ratio(m, f)
        for m in (middle.lower, middle.upper)
        for f in (far.lower, far.upper)
    ]
    return Estimate(value, min(corners), max(corners))


def _ratio(distance: float, spread: float) -> float:
    """Divide distances of one sign; what does not spread is infinitely good, or bad."""
    if spread == 0 and distance != 0:
        return math.inf if distance > 0 else -math.inf
    return distance / spread if spread != 0 else math.nan


def _worth_saying(found: Estimate) -> Estimate:
    """Say why there is no interval, or that the number is none."""
    if found.value > FAR or (found.sure and found.lower > FAR):
        return Estimate(math.nan, reason=f"over {FAR:g}: hardly any spread")
    if found.reason or not found.sure:
        return Estimate(found.value, reason=found.reason)
    return found


def by_moments(
    values: Array,
    sample: Sample,
    limit: Limit,
    declared: Ends | None = None,
    confidence: float = 0.95,
) -> Performance:
    """Estimate Pp and Ppk from mean and sigma, as for normal responses.

    Parameters
    ----------
    values, sample, limit, confidence
        As of `by_percentiles`.
    declared : tuple of float, optional
        Declared range of the response; an open end is infinite.

    Returns
    -------
    Performance
        Pp = (U - L)/6s, Ppk the lesser of (U - mean)/3s and (mean - L)/3s, with
        intervals from those of mean and sigma, each with half the error. What they say
        about the share beyond a limit holds for normal responses alone.
    """
    done = values[sample.done]
    if not len(done):
        return Performance(NONE_DONE, NONE_DONE)
    half = 1 - (1 - confidence) / 2
    reach = Reach(declared, limit.permitted)
    middle = mean(values, sample, reach, half)
    spread = sigma(values, sample, reach, half)
    if not spread.value > 0:
        return Performance(STILL, STILL)
    reason = middle.reason or spread.reason
    if spread.sure and spread.lower <= 0:
        reason = "sigma may be next to nothing"
    lower, upper = limit.permitted
    ends_of_ppk = [
        [
            _ratio(sign * (end - m), 3 * s)
            for m in (middle.value, middle.lower, middle.upper)
            for s in (spread.value, spread.lower, spread.upper)
        ]
        for end, sign in ((upper, 1), (lower, -1))
        if math.isfinite(end)
    ]
    ppk = Estimate(
        min(of[0] for of in ends_of_ppk),
        min(min(of) for of in ends_of_ppk),
        min(max(of) for of in ends_of_ppk),
        reason,
    )
    pp = ONE_END
    if limit.ends == 2:
        width = (upper - lower) / 6
        pp = Estimate(
            width / spread.value,
            width / spread.upper,
            _ratio(width, spread.lower),
            reason,
        )
    return Performance(_worth_saying(pp), _worth_saying(ppk))


def by_share(beyond: Estimate, limit: Limit) -> Estimate:
    """Estimate the Ppk of a normal response that has as many machines beyond.

    Of a limit with two ends: of one in the middle, with half of them beyond each.

    Parameters
    ----------
    beyond : Estimate
        Share of the machines beyond the limit.
    limit : Limit
        What is permitted.
    """

    def of(share: float) -> float:
        return ppk_of(share, limit.ends)

    if not beyond.sure:
        return Estimate(of(beyond.value), reason=beyond.reason)
    return Estimate(of(beyond.value), of(beyond.upper), of(beyond.lower))
