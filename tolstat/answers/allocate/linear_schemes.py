"""Linear tolerance analysis: worst case, root sum square, and means off a limit."""

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.special import log_ndtr

from tolstat.answers.allocate.allocation import OffLimit, Omission, PermittedShift, Role
from tolstat.answers.allocate.fresh_runs import FreshRuns, Proof
from tolstat.answers.allocate.optimizer import Choice, cheapest
from tolstat.answers.allocate.search import Search
from tolstat.arrays import Array
from tolstat.deviations.dependence import correlations
from tolstat.deviations.names import expand
from tolstat.deviations.spread import Shifted, Spread, spread_of, zone_of
from tolstat.execution.diagnostics.influence import (
    slopes,
    slopes_by_name,
    tolerance_ends,
)
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.as_sampled import mean_as_sampled
from tolstat.statistics.limits.limit import Limit, within
from tolstat.statistics.limits.yields import MET
from tolstat.statistics.sensitivity.linear import Scatter, root_sum_square
from tolstat.study.cost_entry import SHIFT, distributions_of
from tolstat.study.study import Study
from tolstat.units.scale import scale_of


class LinearSchemes:
    """The bounds of linear tolerance analysis.

    Slopes are about the trial with all that is constant, and no other deviation.
    """

    def __init__(self, study: Study, workers: Workers) -> None:
        self.priced, self.limits = study.deviating.priced, study.limits
        self._specified = study.deviating.distributions
        self._spread: Callable[[Any], Spread] = lru_cache(maxsize=None)(spread_of)
        lower, upper = tolerance_ends(study)
        middle, usual = np.where(lower == upper, lower, 0.0), (upper - lower) / 6
        contributors, responses = study.description
        deviating = zip(contributors, usual, strict=True)
        self.names = [part.name for part, size in deviating if size]
        table = slopes(study.model, study.settings, usual, workers, middle)
        alone = workers.simulate(study.model, middle[None, :], study.settings)
        values = zip(responses, alone.responses[0].tolist(), strict=True)
        nominal = {response.name: value for response, value in values}
        by_name = slopes_by_name(study, table, usual > 0)
        self.nominal = {name: nominal[name] for name in self.limits}
        self.slopes = {name: by_name.get(name, {}) for name in self.limits}
        self.correlation = correlations(self.names, study.deviating.dependence)

    def worst_case(self, choice: Choice) -> Array:
        """Return how far the worst corner exceeds each end, in rooms: float64[end]."""
        spreads, excess = self._spreads(choice), []
        for name, limit in self.limits.items():
            nominal = self.nominal[name]
            rooms = nominal - limit.lower, limit.upper - nominal
            widest = max(abs(room) for room in rooms if math.isfinite(room))
            for sign, room in zip((-1, 1), rooms, strict=True):
                reach = sum(
                    max(sign * slope * x for x in spreads[part][:2])
                    for part, slope in self.slopes[name].items()
                )
                if math.isfinite(room):
                    excess.append((reach - room) / (widest or abs(reach) or 1.0))
        return np.array(excess)

    def root_sum_square(self, choice: Choice) -> Array:
        """Return logarithms of fractions out of limit over permitted: float64[limit].

        Of normal responses; deviations are correlated as their normal scores are.
        """
        spreads = self._spreads(choice)
        sigma = np.array([spreads[name].sigma for name in self.names])
        scatter = Scatter(
            tuple(self.names),
            np.array([spreads[name].mean for name in self.names]),
            sigma[:, None] * self.correlation * sigma,
        )
        excess = []
        for name, limit in self.limits.items():
            linear = root_sum_square(self.nominal[name], self.slopes[name], scatter)
            excess.append(_above(linear.mean, linear.sigma, limit))
        return np.array(excess)

    def _spreads(self, choice: Choice) -> dict[str, Spread]:
        new = {**self._specified, **distributions_of(self.priced, choice)}
        return {name: self._spread(new[name]) for name in self.names}


def _above(mean: float, sigma: float, limit: Limit) -> float:
    """Return the logarithm of the fraction out of limit over the permitted."""
    sigma = max(sigma, 1e-12 * max(abs(mean), 1e-300))
    ends = ((limit.lower - mean) / sigma, (mean - limit.upper) / sigma)
    low, high = (float(log_ndtr(max(end, -1e6))) for end in ends)
    return float(np.logaddexp(low, high) - np.log(1 - limit.demanded))


def linear_choices(search: Search) -> tuple[dict[Role, Choice], dict[Role, Omission]]:
    """Return choices by linear analysis, and why others are not possible.

    The search begins at the shifts of this analysis.
    """
    linear = LinearSchemes(search.runs.study, search.runs.workers)
    bounds = {
        Role.ROOT_SUM_SQUARE: linear.root_sum_square,
        Role.WORST_CASE: linear.worst_case,
    }
    numbers = [*linear.nominal.values()]
    numbers += [slope for row in linear.slopes.values() for slope in row.values()]
    if not np.all(np.isfinite(numbers)):
        return {}, dict.fromkeys(bounds, Omission.NO_SLOPE)
    search.centre(linear.root_sum_square)
    choices, omitted = dict[Role, Choice](), dict[Role, Omission]()
    for name, excess in bounds.items():
        if best := cheapest(search.variables, excess, search.tightest):
            choices[name] = search.runs.as_written(best.choice)
        else:
            omitted[name] = Omission.LIMITS_MISSED
    return choices, omitted


HALF = 0.5  # of the fraction permitted: a shift leaves no more out of a limit


def means_off_limit(runs: FreshRuns, tightest: Proof) -> Iterator[tuple[str, OffLimit]]:
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
                unit = study.shown.get(members[0], parts[members[0]].shown)
                scale = scale_of(parts[members[0]].unit, unit, abs(by))
                shifts.append((new, size, PermittedShift(entry, by, scale)))
        mean = mean_as_sampled(values)
        beyond = np.array([max(lower - x, x - upper) for x in mean[:3]])
        size, *ends = (math.copysign(1.0, beyond[0]) * beyond).tolist()
        unit = study.shown.get(response.name, response.shown)
        yield (
            response.name,
            OffLimit(
                bool(beyond[0] > 0),
                Estimate(size, min(ends), max(ends), mean.reason),
                scale_of(response.unit, unit, size),
                min(shifts)[2] if shifts else None,
            ),
        )
