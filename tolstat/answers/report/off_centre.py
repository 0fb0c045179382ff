"""How far a response lies off the centre of its limit, and what would centre it.

Tolerances set the spread of a response, nominal values its centre: Pp shows the spread
alone, Ppk both (ISO 22514-2).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import ndtri

from tolstat.answers.cells import ppm
from tolstat.answers.halved_entries import (
    entries_of,
    fixed_points,
    nominal_shift,
)
from tolstat.answers.next_steps import to_shift
from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Array
from tolstat.deviations.distributions import Tolerance
from tolstat.deviations.names import general
from tolstat.document.inline import Name, Number, Parts, Typed, listed, say, text
from tolstat.model.description import Contributor
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.capability import HIGH, LOW, Performance
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import MET, NOT_MET, Yield, yield_of
from tolstat.statistics.summary import Summary
from tolstat.store.stored_run import Run

if TYPE_CHECKING:
    from tolstat.answers.report.report_answer import ResponseSummary, RunSummary

OFF_CENTRE = "off centre"  # why no cause is named
NEVER = "Narrower tolerances cannot meet the limit. "
NOT_HALVED = "Halving all tolerances would not meet the limit. "
ONE_SIDED = "Tolerances not centred on zero move the mean. "
NONLINEAR = "The response is not linear: its spread moves the mean. "
UNSEEN = " Trials do not reach beyond the tolerances: slopes may not hold there."
BENT = 0.25  # of sigma: a mean farther from that by slopes is not linear
ROOM = 0.1  # of the permitted fraction: left out of a limit with one end
MOST, FARTHEST = 3, 100.0  # shifts; the farthest over half its tolerance
WHOLE = 2  # findings on the first page
TOLD, ROUNDING = 0.01, 1e-9  # of half a tolerance: rounding of its shift; of a limit


class Shift(NamedTuple):
    """Nominal values that centre a response, all shifted by as much."""

    members: tuple[str, ...]  # contributors
    shift: float  # SI
    relative: float  # over half the tolerance, the widest of them


class OffCentre(NamedTuple):
    """How far a response lies off the centre of its limit, SI."""

    what: str  # lies outside: "nominal value", "mean" or "median"; empty if none does
    value: float  # of it, or the mean
    outside: float  # distance; 0 inside
    tolerances: str  # what narrower ones cannot do; empty if they may help
    reason: str  # why the mean lies outside and not the nominal value
    performance: Performance  # by percentiles where they have an interval
    shift: float  # to the middle of the limit; with one end to a tenth of the permitted
    shifted: Yield  # of the trials, all shifted by that
    shifts: tuple[Shift, ...]  # each alone; the least over its tolerance first


def off_centre(drawn: Drawn, name: str, found: Summary) -> OffCentre | None:
    """Return how a response lies off the centre of its limit; None if it does not.

    It does if the interval of the median lies outside, or if Pp is significantly good
    or twice Ppk. A limit with one end has no Pp: it does if halved tolerances would not
    meet it. With these half of the mean's shift by slopes stays, and a quarter of the
    rest, of second order.
    """
    limited, median, at = found.limited, found.quantiles[0.5], found.mean.value
    if limited is None or limited.yields.verdict == MET:
        return None
    limit, (lower, upper) = limited.limit, limited.limit.permitted
    by = limited.percentiles if limited.percentiles.ppk.sure else limited.moments
    pp, ppk, what, reason = by.pp.lower, by.ppk.upper, "", ""
    run, slopes = drawn.run, drawn.run.diagnostics.slopes.get(name, {})
    zones, moved = (
        {n: Tolerance(*run.assumed[n].tolerance) for n in slopes},
        _moved(run),
    )
    nominal, linear = run.nominal_values[name], math.nan
    least, most = _narrowest(run, nominal, slopes, moved)
    if slopes:
        linear = nominal + sum(s * run.assumed[n].mean for n, s in slopes.items())
    nominal += sum(s * moved.get(n, 0.0) for n, s in slopes.items())
    # the best of both ways to narrow, about a fixed point and by grades: what is said
    # to be impossible holds for either, ever narrower and half of the way
    middle, rest = lower / 2 + upper / 2, linear / 2 + (at - linear) / 4
    aim = min(max(middle, least), most)
    halved = rest + min(max(middle - rest, least / 2), most / 2)
    room = min(upper - halved, halved - lower)
    reach = _half_reach(limit, drawn.done(name), at, found.sigma.value)
    tolerances = NOT_HALVED if room < reach else ""
    if min(upper - aim, aim - lower) <= ROUNDING * abs(at - nominal):
        tolerances = NEVER
    if median.lower > upper or median.upper < lower:
        what, at = ("median", median.value) if lower <= at <= upper else ("mean", at)
    elif limit.ends == 1:
        bent = not abs(at - linear) <= BENT * found.sigma.value
        if bent or not tolerances or limited.yields.verdict != NOT_MET:
            return None
    elif not (ppk < limit.ppk and (pp >= limit.ppk or pp > 2 * ppk)):
        return None
    shift = _wanted(limit, drawn.done(name), at)
    side, end = (1, upper) if shift < 0 else (-1, lower)
    outside = side * (nominal - end) > rounding(limit, at)
    if what and tolerances == NEVER and outside:
        what, at = (what, at) if moved else ("nominal value", nominal)
    elif what and linear == linear:
        by_slopes = abs(linear - nominal) >= abs(at - nominal) / 2
        reason = ONE_SIDED if by_slopes else NONLINEAR
        tolerances = tolerances if by_slopes else ""
    shifted = drawn.values(name) + shift
    return OffCentre(
        what, at, max(side * (at - end), 0.0), tolerances, reason, by, shift,
        yield_of(shifted, drawn.sample, limit.permitted, limit.demanded),
        () if reason == NONLINEAR else _shifts(run, slopes, zones, shift),
    )  # fmt: skip


def _narrowest(
    run: Run, nominal: float, slopes: Mapping[str, float], moved: Mapping[str, float]
) -> tuple[float, float]:
    """Return the least and the largest response, by slopes, without any spread.

    A zone that is narrowed ever more ends where `tolstat.deviations.spread.fixed_point`
    says, or at its end nearest to the nominal value, as grades do: H7, H6.
    """
    fixed, least, most = fixed_points(run), nominal, nominal
    for name, slope in slopes.items():
        zone = Tolerance(*run.assumed[name].tolerance)
        nearest = min(max(moved.get(name, 0.0), zone.lower), zone.upper)
        effects = slope * nearest, slope * fixed.get(name, zone.middle)
        least, most = least + min(effects), most + max(effects)
    return least, most


def rounding(limit: Limit, size: float) -> float:
    """Return the distance, SI, from an end of a limit that rounding may cause."""
    return ROUNDING * max(0.0, *map(abs, (*limit.asked, size)))  # NaN is none


def _moved(run: Run) -> dict[str, float]:
    """Return the `nominal_shift` of contributors, SI: no nominal trial has it."""
    parts = {each.name: each for each in run.contributors}
    return {
        name: shift
        for _, entry, members in entries_of(run)
        for name in members
        if (shift := nominal_shift(entry, parts[name]))
    }


def _half_reach(limit: Limit, done: Array, at: float, sigma: float) -> float:
    """Return how far from the mean halved tolerances reach, at the demanded yield.

    As a normal response; no farther than the trials do, if they show the one end.
    """
    reach = 1.5 * limit.ppk * sigma
    if limit.ends == 2 or done.size * (1 - limit.demanded) < 1:
        return reach
    sign = 1 if limit.upper < math.inf else -1
    far = float(np.quantile(sign * done, limit.demanded))
    return min(reach, (far - sign * at) / 2)


def _wanted(limit: Limit, done: Array, at: float) -> float:
    """Return the shift of a response that centres it."""
    if limit.ends == 2:
        return (limit.lower + limit.upper) / 2 - at
    sign, end = (1, limit.upper) if limit.upper < math.inf else (-1, limit.lower)
    aim = ROOM * (1 - limit.demanded)
    middle, tail = np.quantile(done, [0.5, HIGH if sign > 0 else LOW])
    deep = sign * (middle + (tail - middle) * -ndtri(aim) / 3)
    return float(end - sign * max(np.quantile(sign * done, 1 - aim), deep))


def _shifts(
    run: Run, slopes: Mapping[str, float], zones: Mapping[str, Tolerance], wanted: float
) -> tuple[Shift, ...]:
    """Return shifts of nominal values, of parts that share a name together."""
    families, found = dict[str, list[Contributor]](), list[Shift]()
    for each in (each for each in run.contributors if each.name in slopes):
        turns = each.unit == "rad" and zones[each.name].half > 3.14  # a phase
        if each.gear is None and not turns:  # neither has a nominal value
            families.setdefault(general(each.name), []).append(each)
    for family in families.values():
        steepest = max(family, key=lambda each: abs(slopes[each.name]))
        slope = sum(slopes[each.name] for each in family)
        if abs(slope) < abs(slopes[steepest.name]):  # they act against each other
            family, slope = [steepest], slopes[steepest.name]
        half = max(zones[each.name].half for each in family)
        factor = run.scales[steepest.name].factor
        place = -math.floor(math.log10(TOLD * half * factor))
        shift = round(wanted / (slope or math.nan) * factor, place) / factor
        # no part is 100 % smaller
        share = steepest.unit == "1" and steepest.shown != "1" and abs(shift) >= 1
        if abs(shift) / half < FARTHEST and not share:
            members = tuple(each.name for each in family)
            found.append(Shift(members, shift, abs(shift) / half))
    return tuple(sorted(found, key=lambda each: each.relative)[:MOST])


def findings(found: RunSummary) -> tuple[Parts, ...]:
    """Say which responses are off centre; of the first ones also what helps."""
    every = ((n, e, e.off_centre) for n in found.limits if (e := found.responses[n]))
    known = [(n, each, off) for n, each, off in every if off]
    known.sort(key=lambda of: not of[2].shifts)
    said = [finding(found.stored_run, n, each) for n, each, _ in known[:WHOLE]]
    rest = [text(Name(n), ": ", _place(each, off)) for n, each, off in known[WHOLE:]]
    return (*said, *([say("Also off centre: {}.", listed(rest))] if rest else []))


def _place(each: ResponseSummary, off: OffCentre) -> Parts:
    """Say where the nominal value or the mean lies, against an end of the limit."""
    if not off.what and (judged := each.limited):
        (lower, upper), mean = judged.limit.permitted, each.mean
        if judged.limit.ends == 2:
            return say(
                "mean lies {} off the middle", Number(abs(off.shift), each.scale)
            )
        if mean.lower <= upper <= mean.upper or mean.lower <= lower <= mean.upper:
            return say("mean lies on the end of the limit")
        if (inside := min(upper - off.value, off.value - lower)) > 0:
            return say("mean lies {} inside the limit", Number(inside, each.scale))
    where = f"{'above' if off.shift < 0 else 'below'} the limit"
    what = off.what or "mean"
    return say(f"{what} lies {{}} {where}", Number(off.outside, each.scale))


def finding(run: Run, name: str, each: ResponseSummary) -> Parts:
    """Say how far a response is off centre, and what helps; empty if it is not."""
    if (off := each.off_centre) is None or each.limited is None:
        return ()
    (pp, ppk), scale, judged = off.performance, each.scale, off.shifted
    at: Estimate | float = off.value if off.what == "nominal value" else each.mean
    at = each.quantiles[0.5] if off.what == "median" else at
    options = []
    for by in off.shifts:
        first, *others = by.members
        of = text("each ", Name(general(first))) if others else Name(first)
        options.append(say("{} by {}", of, Number(by.shift, run.scales[first])))
    commands = (to_shift(run, name, *by[:2], judged.needed) for by in off.shifts)
    return text(
        Name(name), ": the ", _place(each, off), ", at ", Number(at, scale), ". ",
        off.tolerances, off.reason,
        say("Pp {}, ", Number(pp)) if pp.value == pp.value else None,
        "Ppk ", Number(ppk), ": the spread is fine, the centre is not. "
        if pp.value >= each.limited.demanded_ppk else ". ",
        say("Shifted by {}, the trials have {} out of limit. Change the nominal value "
            "of {}.", Number(off.shift, scale), ppm(judged.fraction_out_of_limit),
            listed(options, "or")) if options
        else "No nominal value of a contributor is known to centre it.",
        UNSEEN if off.shifts and off.shifts[0].relative > 1 else None,
        next((say(" A fresh run shows the effect. Write its study: {} Run it: {}",
                  *map(Typed, each))
              for each in commands if each), None),
    )  # fmt: skip
