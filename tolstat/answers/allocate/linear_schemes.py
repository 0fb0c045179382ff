"""Tolerances by linear tolerance analysis: worst case, and root sum square."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.special import log_ndtr

from tolstat.answers.allocate.optimizer import Choice, cheapest
from tolstat.answers.allocate.search import Search
from tolstat.arrays import Array
from tolstat.deviations.dependence import correlations
from tolstat.deviations.spread import Spread, spread_of
from tolstat.execution.diagnostics.influence import (
    slopes,
    slopes_by_name,
    tolerance_ends,
)
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.sensitivity.linear import Scatter, root_sum_square
from tolstat.study.cost_entry import distributions_of
from tolstat.study.study import Study


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
        self.names = [
            c.name for c, size in zip(contributors, usual, strict=True) if size
        ]
        table = slopes(study.model, study.settings, usual, workers, middle)
        alone = workers.simulate(study.model, middle[None, :], study.settings)
        nominal = dict(
            zip([r.name for r in responses], alone.responses[0].tolist(), strict=True)
        )
        by_name = slopes_by_name(study, table, usual > 0)
        self.nominal = {name: nominal[name] for name in self.limits}
        self.slopes = {name: by_name.get(name, {}) for name in self.limits}
        self.correlation = correlations(self.names, study.deviating.dependence)

    def worst_case(self, choice: Choice) -> Array:
        """Return how far the worst corner exceeds each end, in rooms: float64[end]."""
        spreads, excess = self._spreads(choice), []
        for name, limit in self.limits.items():
            rooms = np.array(
                [self.nominal[name] - limit.lower, limit.upper - self.nominal[name]]
            )
            widest = max(abs(room) for room in rooms if np.isfinite(room))
            for sign, room in zip((-1, 1), rooms.tolist(), strict=True):
                reach = sum(
                    max(sign * slope * x for x in spreads[part][:2])
                    for part, slope in self.slopes[name].items()
                )
                if np.isfinite(room):
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
        linear = (
            root_sum_square(self.nominal[name], self.slopes[name], scatter)
            for name in self.limits
        )
        return np.array(
            [
                _above(response.mean, response.sigma, limit)
                for response, limit in zip(linear, self.limits.values(), strict=True)
            ]
        )

    def _spreads(self, choice: Choice) -> dict[str, Spread]:
        new = {**self._specified, **distributions_of(self.priced, choice)}
        return {name: self._spread(new[name]) for name in self.names}


def _above(mean: float, sigma: float, limit: Limit) -> float:
    """Return the logarithm of the fraction out of limit over the permitted."""
    sigma = max(sigma, 1e-12 * max(abs(mean), 1e-300))
    ends = ((limit.lower - mean) / sigma, (mean - limit.upper) / sigma)
    low, high = (float(log_ndtr(max(end, -1e6))) for end in ends)
    return float(np.logaddexp(low, high) - np.log(1 - limit.demanded))


def linear_choices(search: Search) -> tuple[dict[str, Choice], dict[str, str]]:
    """Return choices by linear analysis, and why others are not possible.

    The search begins at the shifts of this analysis.
    """
    linear = LinearSchemes(search.runs.study, search.runs.workers)
    bounds = {
        "root_sum_square": linear.root_sum_square,
        "worst_case": linear.worst_case,
    }
    numbers = [*linear.nominal.values()]
    numbers += [slope for row in linear.slopes.values() for slope in row.values()]
    if not np.all(np.isfinite(numbers)):
        return {}, dict.fromkeys(bounds, "the model has a response without a slope")
    search.centre(linear.root_sum_square)
    choices, omitted = dict[str, Choice](), dict[str, str]()
    for name, excess in bounds.items():
        if best := cheapest(search.variables, excess, search.tightest):
            choices[name] = search.runs.as_written(best.choice)
        else:
            omitted[name] = "no tolerances meet the limits"
    return choices, omitted
