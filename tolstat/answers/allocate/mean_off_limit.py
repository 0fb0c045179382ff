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
    tight = runs.written(tightest.choice).at_random(tightest.scheme.seed, runs.trials)
    answers = runs.workers.simulate(study.model, tight.deviations(), study.settings)
    contributors, responses = study.description
    parts = {contributor.name: contributor for contributor in contributors}
    for response, column in zip(responses, answers.responses.T, strict=True):
        values, limit = column[np.isfinite(column)], study.limits.get(response.name)
        if limit is None or tightest.yields[response.name].verdict == MET:
            continue
        (lower, upper), share = limit.permitted, HALF * (1 - limit.demanded)
        tails = np.quantile(values, [share, 1 - share]) if len(values) else np.zeros(2)
        room = np.array(limit.permitted) - tails
        needed = float(np.mean(room[np.isfinite(room)]))
        out = [np.mean(~within(column + by, limit.permitted)) for by in (0.0, needed)]
        if not out[1] <= 2 * share < out[0]:
            continue  # the spread is too wide, or trials are too few
        shifts = []
        for entry in study.document.deviations:
            members = expand(entry, [*parts])
            specified = tight.deviating.distributions[members[0]]
            slope = sum(linear.slopes[response.name].get(part, 0.0) for part in members)
            if (zone := zone_of(specified)) and slope and math.isfinite(slope):
                size, by = abs(needed / slope) / zone.half, needed / slope
                by += specified.by if isinstance(specified, Shifted) else 0.0
                new = SHIFT + entry not in tightest.scheme.tolerances
                shifts.append((new, size, entry, parts[members[0]], by))
        mean = mean_as_sampled(values)
        beyond = np.array([max(lower - x, x - upper) for x in mean[:3]])
        size, *ends = (math.copysign(1.0, beyond[0]) * beyond).tolist()
        distance = Estimate(size, min(ends), max(ends), mean.reason)
        unit = study.shown.get(response.name, response.shown)
        yield response.name, say(
            "{}: the mean lies {} {} the limit; no permitted tolerance meets it.{} ",
            Name(response.name), Number(distance, scale_of(response.unit, unit, size)),
            "outside" if beyond[0] > 0 else "inside, but too near an end of",
            _permit(*min(shifts)[2:], study.shown) if shifts else None,
        )  # fmt: skip


def _permit(
    entry: str, part: Contributor, by: float, units: Mapping[str, str]
) -> Parts:
    """Return what to type so that a shift is permitted: its size, rounded up."""
    scale = scale_of(part.unit, units.get(part.name, part.shown), abs(by))
    digit = 10.0 ** math.floor(math.log10(size := abs(scale.factor * by)))
    return say(
        ' Permit a shift of {} by about {}: `shift = "+-{} {}"` in its cost.',
        Name(entry), Number(float(f"{by:.2g}"), scale),
        f"{math.ceil(size / digit) * digit:.6g}", scale.mark,
    )  # fmt: skip
