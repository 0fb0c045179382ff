"""How far a response lies off the centre of its limit, and what would centre it.

Tolerances set the spread of a response, nominal values its centre: Pp shows the spread
alone, Ppk both (ISO 22514-2).
"""

import math
from collections.abc import Mapping
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Array
from tolstat.deviations.names import general
from tolstat.model.description import Contributor
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import MET, NOT_MET, Yield, yield_of
from tolstat.statistics.summary import HIGH, LOW, Performance, Summary
from tolstat.store.assumed import is_turn
from tolstat.store.stored_run import Run

BENT = 0.25  # of sigma: a mean farther from that by slopes is not linear
OUT_OF_ONE_END = 0.1  # of the permitted fraction: left out of a limit with one end
MOST_SHIFTS, FARTHEST = 3, 100.0  # the farthest shift over half its tolerance
SHIFT_STEP = 0.01  # of half a tolerance: rounding of its shift
LIMIT_ROUNDING = 1e-9  # of a limit


class Outside(StrEnum):
    """What lies outside the limit."""

    NOTHING = ""
    NOMINAL = "nominal value"
    MEAN = "mean"
    MEDIAN = "median"


class Narrowing(StrEnum):
    """What narrower tolerances cannot do."""

    MAY_HELP = ""
    NEVER = "Narrower tolerances cannot meet the limit. "
    NOT_BY_HALF = "Halving all tolerances would not meet the limit. "


class MeanShift(StrEnum):
    """Why the mean lies outside the limit and not the nominal value."""

    NONE = ""
    ONE_SIDED = "Tolerances not centred on zero move the mean. "
    NONLINEAR = "The response is not linear: its spread moves the mean. "


class Shift(NamedTuple):
    """Nominal values that centre a response, all shifted by as much."""

    members: tuple[str, ...]  # contributors
    shift: float  # SI
    relative: float  # over half the tolerance, the widest of them


class OffCentre(NamedTuple):
    """How far a response lies off the centre of its limit, SI."""

    what: Outside
    value: float  # of it, or the mean
    outside: float  # distance; 0 inside
    tolerances: Narrowing
    reason: MeanShift
    performance: Performance  # by percentiles where they have an interval
    shift: float  # to the middle of the limit; with one end to a tenth of the permitted
    shifted: Yield  # of the trials, all shifted by that
    shifts: tuple[Shift, ...]  # each alone; the least over its tolerance first


def off_centre(drawn: Drawn, name: str, summary: Summary) -> OffCentre | None:
    """Return how a response lies off the centre of its limit; None if it does not.

    It does if the interval of the median lies outside, or if Pp is significantly good
    or twice Ppk. A limit with one end has no Pp: it does if halved tolerances would not
    meet it. With these half of the mean's shift by slopes stays, and a quarter of the
    rest, of second order.
    """
    limited, median, value = summary.limited, summary.quantiles[0.5], summary.mean.value
    if limited is None or limited.yields.verdict == MET:
        return None
    limit, (lower, upper) = limited.limit, limited.limit.permitted
    by = limited.percentiles if limited.percentiles.ppk.sure else limited.moments
    run, slopes = drawn.run, drawn.run.diagnostics.slopes.get(name, {})
    shifts = {n: part.nominal_shift for n, part in run.assumed.items()}
    sigma = summary.sigma.value
    nominal, linear = run.nominal_values[name], math.nan
    least, most = _narrowest(run, nominal, slopes)
    if slopes:
        linear = nominal + sum(s * run.assumed[n].mean for n, s in slopes.items())
    nominal += sum(s * shifts[n] for n, s in slopes.items())
    # the best of both ways to narrow, about a fixed point and by grades: what is said
    # to be impossible holds for either, ever narrower and half of the way
    middle, rest = lower / 2 + upper / 2, linear / 2 + (value - linear) / 4
    aim = min(max(middle, least), most)
    halved = rest + min(max(middle - rest, least / 2), most / 2)
    room = min(upper - halved, halved - lower)
    reach = _half_reach(limit, drawn.done(name), value, sigma)
    tolerances = Narrowing.NOT_BY_HALF if room < reach else Narrowing.MAY_HELP
    if min(upper - aim, aim - lower) <= LIMIT_ROUNDING * abs(value - nominal):
        tolerances = Narrowing.NEVER
    what, pp, ppk = Outside.NOTHING, by.pp.lower, by.ppk.upper
    if median.lower > upper or median.upper < lower:
        what = Outside.MEAN
        if lower <= value <= upper:
            what, value = Outside.MEDIAN, median.value
    elif limit.ends == 1:
        bent = not abs(value - linear) <= BENT * sigma
        if bent or not tolerances or limited.yields.verdict != NOT_MET:
            return None
    elif not (ppk < limit.ppk and (pp >= limit.ppk or pp > 2 * ppk)):
        return None
    shift = _centring_shift(limit, drawn.done(name), value)
    side, end = (1, upper) if shift < 0 else (-1, lower)
    outside = side * (nominal - end) > limit_rounding(limit, value)
    reason = MeanShift.NONE
    if what and tolerances is Narrowing.NEVER and outside:
        if not any(shifts.values()):  # no nominal trial has them
            what, value = Outside.NOMINAL, nominal
    elif what and linear == linear:
        by_slopes = abs(linear - nominal) >= abs(value - nominal) / 2
        reason = MeanShift.ONE_SIDED if by_slopes else MeanShift.NONLINEAR
        tolerances = tolerances if by_slopes else Narrowing.MAY_HELP
    shifted = drawn.values(name) + shift
    return OffCentre(
        what,
        value,
        outside=max(side * (value - end), 0.0),
        tolerances=tolerances,
        reason=reason,
        performance=by,
        shift=shift,
        shifted=yield_of(shifted, drawn.sample, limit.permitted, limit.demanded),
        shifts=() if reason is MeanShift.NONLINEAR else _shifts(run, slopes, shift),
    )


def _narrowest(
    run: Run, nominal: float, slopes: Mapping[str, float]
) -> tuple[float, float]:
    """Return the least and the largest response, by slopes, without any spread.

    A zone that is narrowed ever more ends where `tolstat.deviations.spread.fixed_point`
    says, or at its end nearest to the nominal value, as grades do: H7, H6.
    """
    least = most = nominal
    for name, slope in slopes.items():
        part = run.assumed[name]
        nearest = min(
            max(part.nominal_shift, part.tolerance.lower), part.tolerance.upper
        )
        effects = slope * nearest, slope * part.centre
        least, most = least + min(effects), most + max(effects)
    return least, most


def limit_rounding(limit: Limit, size: float) -> float:
    """Return the distance, SI, from an end of a limit that rounding may cause."""
    return LIMIT_ROUNDING * max(0.0, *map(abs, (*limit.asked, size)))  # NaN is none


def _half_reach(limit: Limit, done: Array, mean: float, sigma: float) -> float:
    """Return how far from the mean halved tolerances reach, at the demanded yield.

    As a normal response; no farther than the trials do, if they show the one end.
    """
    reach = 1.5 * limit.ppk * sigma
    if limit.ends == 2 or done.size * (1 - limit.demanded) < 1:
        return reach
    sign = 1 if limit.upper < math.inf else -1
    far = float(np.quantile(sign * done, limit.demanded))
    return min(reach, (far - sign * mean) / 2)


def _centring_shift(limit: Limit, done: Array, value: float) -> float:
    """Return the shift of a response that centres it."""
    if limit.ends == 2:
        return (limit.lower + limit.upper) / 2 - value
    sign, end = (1, limit.upper) if limit.upper < math.inf else (-1, limit.lower)
    aim = OUT_OF_ONE_END * (1 - limit.demanded)
    middle, tail = np.quantile(done, [0.5, HIGH if sign > 0 else LOW])
    deep = sign * (middle + (tail - middle) * -ndtri(aim) / 3)
    return float(end - sign * max(np.quantile(sign * done, 1 - aim), deep))


def _shifts(run: Run, slopes: Mapping[str, float], shift: float) -> tuple[Shift, ...]:
    """Return shifts of nominal values, of parts that share a name together.

    `shift`: of the response.
    """
    families, options = dict[str, list[Contributor]](), list[Shift]()
    zones = {name: run.assumed[name].tolerance for name in slopes}
    for part in run.contributors:
        if part.name not in zones or part.gear is not None:
            continue
        if not is_turn(part.unit, zones[part.name]):  # a phase
            families.setdefault(general(part.name), []).append(part)
    for family in families.values():
        steepest = max(family, key=lambda part: abs(slopes[part.name]))
        slope = sum(slopes[part.name] for part in family)
        if abs(slope) < abs(slopes[steepest.name]):  # they act against each other
            family, slope = [steepest], slopes[steepest.name]
        half = max(zones[part.name].half for part in family)
        factor = run.scales[steepest.name].factor
        digits = -math.floor(math.log10(SHIFT_STEP * half * factor))
        size = round(shift / (slope or math.nan) * factor, digits) / factor
        # no part is 100 % smaller
        share = steepest.unit == "1" and steepest.shown != "1" and abs(size) >= 1
        if abs(size) / half < FARTHEST and not share:
            members = tuple(part.name for part in family)
            options.append(Shift(members, size, abs(size) / half))
    return tuple(sorted(options, key=lambda option: option.relative)[:MOST_SHIFTS])
