"""Performance of a simulated response against its limit: Pp and Ppk.

Simulated machines prove no stable process, so it is performance (Pp, Ppk) and not
capability (Cp, Cpk), ISO 22514-1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from tolstat.statistics.estimate import NONE_DONE, Estimate, untrustworthy
from tolstat.statistics.moments import WIDER, moments, moments_are_trustworthy
from tolstat.statistics.quantiles import quantiles

Array = NDArray[np.float64]
Limit = tuple[float, float]

LOW, MIDDLE, HIGH = 0.00135, 0.5, 0.99865


class Performance(NamedTuple):
    """Pp (NaN for a limit with one end) and Ppk."""

    pp: Estimate
    ppk: Estimate


def by_percentiles(
    values: Array, limit: Limit, confidence: float = 0.95
) -> Performance:
    """Estimate Pp and Ppk from percentiles: for responses of any shape.

    Parameters
    ----------
    values : float64[n]
        Independent, none NaN.
    limit : tuple of float
        Least and greatest permitted value; an open end is infinite.
    confidence : float
        Of the intervals.

    Returns
    -------
    Performance
        Pp = (U - L)/(X99.865 - X0.135), Ppk the lesser of (U - X50)/(X99.865 - X50) and
        (X50 - L)/(X50 - X0.135). The intervals follow from exact ones of the
        percentiles, each with its share of the error: conservative. They need 2 700 or
        more trials.

    References
    ----------
    ISO 22514-2:2017, method M4 (percentiles).
    """
    lower, upper = limit
    # up to three percentiles stand behind one number: share the error among them
    shared = 1 - (1 - confidence) / 3
    low, middle, high = quantiles(values, (LOW, MIDDLE, HIGH), shared).values()
    if len(values) == 0:
        return Performance(NONE_DONE, NONE_DONE)
    ends = [(upper, high, 1), (lower, low, -1)]
    sides = [
        _side(end, middle, far, sign) for end, far, sign in ends if math.isfinite(end)
    ]
    unsure = not all(side.sure for side in sides)
    ppk = Estimate(
        min(side.value for side in sides),
        math.nan if unsure else min(side.lower for side in sides),
        math.nan if unsure else min(side.upper for side in sides),
    )
    pp = Estimate(math.nan, reason="the limit has one end")
    if math.isfinite(lower) and math.isfinite(upper):
        width = upper - lower
        pp = Estimate(
            _ratio(width, high.value - low.value),
            _ratio(width, high.upper - low.lower),
            _ratio(width, high.lower - low.upper),
        )
    return Performance(_explained(pp, high), _explained(ppk, high))


def _side(end: float, middle: Estimate, far: Estimate, sign: int) -> Estimate:
    """Estimate one side of Ppk: the end's distance over the far percentile's."""

    def ratio(m: float, f: float) -> float:
        return _ratio(sign * (end - m), sign * (f - m))

    value = ratio(middle.value, far.value)
    # monotonous in either percentile: the extremes lie at the corners
    corners = [
        ratio(m, f)
        for m in (middle.lower, middle.upper)
        for f in (far.lower, far.upper)
    ]
    if any(math.isnan(corner) for corner in corners):
        return Estimate(value)
    return Estimate(value, min(corners), max(corners))


def _ratio(distance: float, spread: float) -> float:
    """Divide distances of one sign; what does not spread is infinitely good, or bad."""
    if spread == 0 and distance != 0:
        return math.inf if distance > 0 else -math.inf
    return distance / spread if spread != 0 else math.nan


def _explained(estimate: Estimate, far: Estimate) -> Estimate:
    """Say why an interval is missing."""
    if estimate.sure or estimate.reason:
        return estimate
    reason = "the response does not spread" if far.sure else f"{far.reason} trials"
    return estimate._replace(reason=reason)


def by_moments(values: Array, limit: Limit, confidence: float = 0.95) -> Performance:
    """Estimate Pp and Ppk from mean and sigma, as for normal responses.

    Parameters
    ----------
    values, limit, confidence
        As of `by_percentiles`.

    Returns
    -------
    Performance
        Pp = (U - L)/6s, Ppk the lesser of (U - mean)/3s and (mean - L)/3s, with
        intervals from the sample's own third and fourth moments where these are to be
        trusted. What they say about the share beyond a limit holds for normal responses
        alone.
    """
    lower, upper = limit
    m = moments(values)
    if not m.sigma > 0:
        none = Estimate(math.nan, reason="the response does not spread")
        return Performance(none, none)
    pp = Estimate(math.nan, reason="the limit has one end")
    trusted = moments_are_trustworthy(m)
    z = WIDER * float(stdtrit(max(m.n - 1, 1), 0.5 + confidence / 2))
    if math.isfinite(lower) and math.isfinite(upper):
        value = (upper - lower) / (6 * m.sigma)
        half = z * math.sqrt((m.kurtosis + 2) / (4 * m.n))
        pp = Estimate(value, value * math.exp(-half), value * math.exp(half))
        pp = pp if trusted else untrustworthy(value, m.n)
    # distances to the ends in sigmas; the skewness counts towards the end
    above = (upper - m.mean) / m.sigma
    below = (m.mean - lower) / m.sigma
    d, skewness = (above, m.skewness) if above <= below else (below, -m.skewness)
    variance = (1 + d * skewness + d * d * (m.kurtosis + 2) / 4) / m.n
    half = z * math.sqrt(max(variance, 0.0)) / 3
    ppk = Estimate(d / 3, d / 3 - half, d / 3 + half)
    return Performance(pp, ppk if trusted else untrustworthy(d / 3, m.n))
