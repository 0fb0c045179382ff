"""Tolerances by linear tolerance analysis: worst case, and root sum square."""

import numpy as np
from scipy.special import log_ndtr

from tolstat.answers.allocate.optimizer import Choice, cheapest
from tolstat.answers.allocate.search import Search
from tolstat.arrays import Array
from tolstat.deviations.dependence import correlations
from tolstat.deviations.distributions import Constant, Distribution
from tolstat.deviations.spread import Spread, spread_of
from tolstat.execution.diagnostics.slopes_and_corners import slopes
from tolstat.execution.workers.crew import Workers
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.sensitivity.linear import Scatter, root_sum_square
from tolstat.study.shift_entry import distributions_of
from tolstat.study.study import Study


class LinearSchemes:
    """The bounds of linear tolerance analysis."""

    def __init__(self, study: Study, workers: Workers) -> None:
        self.priced, self.limits = study.deviating.priced, study.limits
        self._own = study.deviating.distributions
        self._known: dict[Distribution, Spread] = {}
        rows = {each.name: i for i, each in enumerate(study.description.contributors)}
        columns = {each.name: i for i, each in enumerate(study.description.responses)}
        at, usual = np.zeros(len(rows)), np.zeros(len(rows))
        self.names = []
        for name, row in rows.items():
            own = self._own.get(name)
            if isinstance(own, Constant):
                at[row] = own.value
            elif own is not None:
                lower, upper, *_ = self._spread(own)
                usual[row] = (upper - lower) / 6
                self.names.append(name)
        # about the trial with all that is constant, and no other deviation
        table = slopes(study.model, study.settings, usual, workers, at)
        alone = workers.simulate(study.model, at[None, :], study.settings)
        self.nominal = {n: float(alone.responses[0, columns[n]]) for n in self.limits}
        self.slopes = {
            name: {part: float(table[rows[part], columns[name]]) for part in self.names}
            for name in self.limits
        }
        self.correlation = correlations(self.names, study.deviating.dependence)

    def worst_case(self, choice: Choice) -> Array:
        """Return how far the worst corner exceeds each end, in rooms: float64[end]."""
        spreads = self._spreads(choice)
        found = []
        for name, limit in self.limits.items():
            nominal = self.nominal[name]
            rooms = [abs(end - nominal) for end in limit.permitted if np.isfinite(end)]
            for sign, end in ((-1, limit.lower), (1, limit.upper)):
                if not np.isfinite(end):
                    continue
                off = sum(
                    max(sign * slope * x for x in spreads[part][:2])
                    for part, slope in self.slopes[name].items()
                )
                room = sign * (end - nominal)
                found.append((off - room) / (max(rooms) or abs(off) or 1.0))
        return np.array(found)

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
        found = []
        for name, limit in self.limits.items():
            linear = root_sum_square(self.nominal[name], self.slopes[name], scatter)
            found.append(_above(linear.mean, linear.sigma, limit))
        return np.array(found)

    def _spreads(self, choice: Choice) -> dict[str, Spread]:
        new = {**self._own, **distributions_of(self.priced, choice)}
        return {name: self._spread(new[name]) for name in self.names}

    def _spread(self, distribution: Distribution) -> Spread:
        if distribution not in self._known:
            self._known[distribution] = spread_of(distribution)
        return self._known[distribution]


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
    known = [value for of in linear.slopes.values() for value in of.values()]
    if not np.all(np.isfinite([*known, *linear.nominal.values()])):
        return {}, dict.fromkeys(bounds, "the model has a response without a slope")
    search.centre(linear.root_sum_square)
    found, omitted = dict[str, Choice](), dict[str, str]()
    for name, excess in bounds.items():
        if best := cheapest(search.variables, excess, search.tightest):
            found[name] = search.runs.as_written(best.choice)
        else:
            omitted[name] = "no tolerances meet the limits"
    return found, omitted
