"""Capability of measured parts against a tolerance: Cp, Cpk, Pp, Ppk.

Intervals are those of normal parts: Student's of the mean, chi-square of sigma and Pp,
noncentral t of Ppk. Where lots differ they rest on the number of lots.

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
from tolstat.statistics.estimate import Estimate, Lack, NoInterval
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.lots import TAIL, LotEffect, lot_effect, sigma_within
from tolstat.statistics.summary import NO_SPREAD, ONE_END

FEWEST = 5  # parts with an interval; lots, where there are several
FAR = 100.0  # an index: beyond it the spread of the mean is nothing to that of sigma
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
    # equal parts have none, whatever their mean is rounded to
    spread = float(values.std(ddof=1)) if parts > 1 else math.nan
    sigma = spread if parts < 2 or np.ptp(values) > 0 else 0.0
    effect = lot_effect(values, lots)
    within, degrees = sigma_within(values, lots)
    reason = _reason(parts, len({*lots}) if degrees else 0, normal=normal)
    of_mean = "" if parts >= MANY and reason == ABNORMAL else reason
    freedom: float = parts - 1
    half = float(stdtrit(max(freedom, 1), 1 - TAIL)) * sigma / math.sqrt(parts)
    if effect:
        freedom = effect.freedom
        half = float(stdtrit(effect.lots - 1, 1 - TAIL)) * effect.of_mean

    def indices(sigma: float, freedom: float) -> tuple[Estimate, Estimate]:
        worth: float = parts  # that the mean rests on
        if effect:
            worth = min(worth, (float(stdtrit(freedom, 1 - TAIL)) * sigma / half) ** 2)
        return _indices(mean, sigma, worth, freedom, tolerance, reason)

    pp, ppk = indices(sigma, freedom)
    cp, cpk = indices(within, degrees) if degrees else (NONE, NONE)
    widest, narrowest = _ratios(freedom)
    below = int(np.count_nonzero(values < tolerance.lower))
    above = int(np.count_nonzero(values > tolerance.upper))
    return Capability(
        parts,
        _with_interval(mean, mean - half, mean + half, of_mean),
        _with_interval(sigma, sigma / widest, sigma / narrowest, reason),
        pp, ppk, cp, cpk, below, above,
        _share_outside(values, tolerance, lots, effect) if tolerance.finite else NONE,
    )  # fmt: skip


def _reason(parts: int, lots: int, *, normal: bool) -> str:
    """Return why there is no interval; empty if there is one.

    Few lots that look alike may differ all the same, so they have none either.
    """
    if parts < FEWEST:
        return NoInterval(Lack.FEWEST_PARTS, needed=FEWEST)
    if 1 < lots < FEWEST:
        return NoInterval(Lack.FEWEST_LOTS, needed=FEWEST)
    return "" if normal else ABNORMAL


def _share_outside(
    values: Array, tolerance: Tolerance, lots: Sequence[str], effect: LotEffect | None
) -> Estimate:
    """Return the share outside; parts of one lot tell less than as many of others."""
    outside = (values < tolerance.lower) | (values > tolerance.upper)
    of_share = lot_effect(outside.astype(np.float64), lots)
    repeats = max(x.design_effect if x else 1.0 for x in (effect, of_share))
    return proportion(np.count_nonzero(outside) / repeats, len(values) / repeats)


def _indices(
    mean: float,
    sigma: float,
    parts: float,
    freedom: float,
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
    ppk = min(sides)
    lower, upper = _ends_of_nearer(ppk, parts, freedom)
    nearer = _with_interval(ppk, lower, upper, reason)
    if len(sides) < 2:
        return ONE_END, nearer
    pp = (tolerance.upper - tolerance.lower) / (6 * sigma)
    least, most = sorted(pp * x for x in _ratios(freedom))
    return _with_interval(pp, least, most, reason), nearer


def _ends_of_nearer(ppk: float, parts: float, freedom: float) -> list[float]:
    """Return the ends of the interval of Ppk: by noncentral t, or far from 0 by sigma.

    There SciPy's noncentral t is wrong, or takes for ever.
    """
    if abs(ppk) > FAR:
        return sorted(ppk * x for x in _ratios(freedom))
    root = 3 * math.sqrt(parts)
    return [
        float(nctdtrinc(freedom, share, root * ppk)) / root
        for share in (1 - TAIL, TAIL)
    ]


def _ratios(freedom: float) -> tuple[float, float]:
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
