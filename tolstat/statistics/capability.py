"""Capability of measured parts against a tolerance: Cp, Cpk, Pp, Ppk.

Intervals are those of normal parts: Student's of the mean, chi-square of sigma and Pp,
noncentral t of Ppk.

References
----------
ISO 22514-1:2014, ISO 22514-2:2017 (method M1): Pp and Ppk from the sigma of all parts,
Cp and Cpk from that within lots.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri, nctdtrinc, stdtrit

from tolstat.arrays import Array
from tolstat.statistics.estimate import CONFIDENCE, Estimate, Lack, NoInterval
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.summary import NO_SPREAD, ONE_END

TAIL = (1 - CONFIDENCE) / 2
FEWEST = 5  # parts with an interval
MANY = 30  # parts whose mean is normal, whatever they are
ABNORMAL = NoInterval(Lack.NORMAL_PARTS)


class Tolerance(NamedTuple):
    """The permitted values of a drawing; an open end is infinite."""

    lower: float = -math.inf
    upper: float = math.inf

    @property
    def finite(self) -> list[float]:
        """The ends that there are."""
        return [end for end in self if math.isfinite(end)]


class Capability(NamedTuple):
    """Measured parts against a tolerance; numbers are SI."""

    parts: int
    mean: Estimate
    sigma: Estimate
    # of all parts; NaN without a tolerance, Pp also with one end
    pp: Estimate
    ppk: Estimate
    # from the sigma within lots; NaN without lots
    cp: Estimate
    cpk: Estimate
    below: int  # parts below the tolerance
    above: int
    outside: Estimate  # share outside, for any distribution


NONE = Estimate(math.nan)


def capability_of(
    values: Array,
    tolerance: Tolerance,
    lots: Sequence[str] = (),
    *,
    normal: bool = True,
) -> Capability:
    """Return the capability of float64[part] parts.

    Parameters
    ----------
    lots : sequence of str
        The lot of each; none without lots.
    normal : bool
        Whether they may be normal. Without that only the share outside has an interval,
        and the mean of many.
    """
    parts, mean = len(values), float(values.mean())
    freedom = parts - 1
    # equal parts have none, whatever their mean is rounded to
    spread = float(values.std(ddof=1)) if parts > 1 else math.nan
    sigma = spread if parts < 2 or np.ptp(values) > 0 else 0.0
    reason: str = "" if normal else ABNORMAL
    if parts < FEWEST:
        reason = NoInterval(Lack.FEWEST_PARTS, needed=FEWEST)
    half = float(stdtrit(max(freedom, 1), 1 - TAIL)) * sigma / math.sqrt(parts)
    below = int(np.count_nonzero(values < tolerance.lower))
    above = int(np.count_nonzero(values > tolerance.upper))
    pp, ppk = _indices(mean, sigma, parts, freedom, tolerance, reason)
    within, degrees = sigma_within(values, lots)
    widest, narrowest = _ratios(freedom)
    cp = cpk = NONE
    if degrees:
        cp, cpk = _indices(mean, within, parts, degrees, tolerance, reason)
    return Capability(
        parts,
        _with_interval(
            mean, mean - half, mean + half, "" if parts >= MANY else reason
        ),
        _with_interval(sigma, sigma / widest, sigma / narrowest, reason),
        pp, ppk, cp, cpk, below, above,
        proportion(below + above, parts) if tolerance.finite else NONE,
    )  # fmt: skip


def by_lot(values: Array, lots: Sequence[str]) -> dict[str, Array]:
    """Return the parts of each lot, in the order of the lots; none without lots."""
    names = np.array(lots)
    return {lot: values[names == lot] for lot in dict.fromkeys(lots)}


def sigma_within(values: Array, lots: Sequence[str]) -> tuple[float, int]:
    """Return the pooled sigma within lots, and its degrees of freedom; 0 without."""
    groups = by_lot(values, lots).values()
    freedom = len(values) - len(groups)
    if len(groups) < 2 or freedom < 1:
        return math.nan, 0
    squares = sum(float(((group - group.mean()) ** 2).sum()) for group in groups)
    return math.sqrt(squares / freedom), freedom


def _indices(
    mean: float,
    sigma: float,
    parts: int,
    freedom: int,
    tolerance: Tolerance,
    reason: str,
) -> tuple[Estimate, Estimate]:
    """Return Pp and Ppk with a sigma of so many degrees of freedom."""
    if not tolerance.finite:
        return NONE, NONE
    if not sigma > 0:
        return NO_SPREAD, NO_SPREAD
    sides = [
        distance / (3 * sigma)
        for distance in (tolerance.upper - mean, mean - tolerance.lower)
        if math.isfinite(distance)
    ]
    ppk, root = min(sides), 3 * math.sqrt(parts)
    lower, upper = (
        float(nctdtrinc(freedom, share, root * ppk)) / root
        for share in (1 - TAIL, TAIL)
    )
    nearer = _with_interval(ppk, lower, upper, reason)
    if len(sides) < 2:
        return ONE_END, nearer
    pp = (tolerance.upper - tolerance.lower) / (6 * sigma)
    least, most = sorted(pp * x for x in _ratios(freedom))
    return _with_interval(pp, least, most, reason), nearer


def _ratios(freedom: int) -> tuple[float, float]:
    """Return the ends of the interval of s over sigma."""
    if freedom < 1:
        return math.nan, math.nan
    upper, lower = (
        math.sqrt(float(chdtri(freedom, share)) / freedom) for share in (TAIL, 1 - TAIL)
    )
    return upper, lower


def _with_interval(value: float, lower: float, upper: float, reason: str) -> Estimate:
    if reason:
        return Estimate(value, reason=reason)
    return Estimate(value, lower, upper)
