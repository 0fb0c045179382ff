"""Limits that no permitted tolerance meets, and would if the mean were shifted."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from tolstat.answers.allocate.fresh_runs import FreshRuns, Proof
from tolstat.answers.allocate.linear_schemes import LinearSchemes
from tolstat.deviations.names import expand
from tolstat.deviations.spread import Shifted, zone_of
from tolstat.document.inline import Name, Number, Parts, say
from tolstat.model.description import Contributor
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.as_sampled import mean_as_sampled
from tolstat.statistics.limits.limit import within
from tolstat.statistics.limits.yields import MET
from tolstat.study.cost_entry import SHIFT
from tolstat.units.scale import scale_of

HALF = 0.5  # of the fraction permitted: a shift leaves no more out of a limit


def means_off_limit(runs: FreshRuns, tightest: Proof) -> Iterator[tuple[str, Parts]]:
    """Yield limits that are not met because of a mean, and what to permit."""
    study, linear = runs.study, LinearSchemes(runs.study, runs.workers)
    drawn = runs.written(tightest.choice).at_random(tightest.scheme.seed, runs.trials)
    found = runs.workers.simulate(study.model, drawn.deviations(), study.settings)
    contributors, responses = study.description
    known = {each.name: each for each in contributors}
    for column, each in enumerate(responses):
        every = found.responses[:, column]
        values, limit = every[np.isfinite(every)], study.limits.get(each.name)
        if limit is None or tightest.yields[each.name].verdict == MET:
            continue
        (lower, upper), share = limit.permitted, HALF * (1 - limit.demanded)
        near = np.quantile(values, [share, 1 - share]) if len(values) else np.zeros(2)
        room = np.array(limit.permitted) - near
        needed = float(np.mean(room[np.isfinite(room)]))
        out = [np.mean(~within(every + by, limit.permitted)) for by in (0.0, needed)]
        if not out[1] <= 2 * share < out[0]:
            continue  # the spread is too wide, or trials are too few
        shifts = []
        for entry in study.document.deviations:
            parts = expand(entry, [*known])
            own = drawn.deviating.distributions[parts[0]]
            slope = sum(linear.slopes[each.name].get(part, 0.0) for part in parts)
            if (zone := zone_of(own)) and slope and math.isfinite(slope):
                size, by = abs(needed / slope) / zone.half, needed / slope
                by += own.by if isinstance(own, Shifted) else 0.0
                new = SHIFT + entry not in tightest.scheme.tolerances
                shifts.append((new, size, entry, known[parts[0]], by))
        mean = mean_as_sampled(values)
        beyond = np.array([max(lower - x, x - upper) for x in mean[:3]])
        size, *ends = (math.copysign(1.0, beyond[0]) * beyond).tolist()
        off = Estimate(size, min(ends), max(ends), mean.reason)
        scale = scale_of(each.unit, study.shown.get(each.name, each.shown), size)
        yield each.name, say(
            "{}: the mean lies {} {} the limit; no permitted tolerance meets it.{} ",
            Name(each.name), Number(off, scale),
            "outside" if beyond[0] > 0 else "inside, but too near an end of",
            _permit(*min(shifts)[2:], study.shown) if shifts else None,
        )  # fmt: skip


def _permit(
    entry: str, part: Contributor, by: float, shown: Mapping[str, str]
) -> Parts:
    """Return what to type so that a shift is permitted: its size, rounded up."""
    scale = scale_of(part.unit, shown.get(part.name, part.shown), abs(by))
    place = 10.0 ** math.floor(math.log10(size := abs(scale.factor * by)))
    return say(
        ' Permit a shift of {} by about {}: `shift = "+-{} {}"` in its cost.',
        Name(entry), Number(float(f"{by:.2g}"), scale),
        f"{math.ceil(size / place) * place:.6g}", scale.mark,
    )  # fmt: skip
