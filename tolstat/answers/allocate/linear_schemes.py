"""What linear tolerance analysis would choose: worst case, and root sum square."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from tolstat.answers.allocate.optimizer import Choice
from tolstat.deviations.density_ratio import correlations
from tolstat.deviations.distributions import Distribution
from tolstat.deviations.distributions.constant import Constant
from tolstat.deviations.spread import Spread, spread_of
from tolstat.execution.diagnostics.slopes_and_corners import slopes
from tolstat.execution.workers.crew import Workers
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.sensitivity.linear import Scatter, root_sum_square
from tolstat.study.study import Study

Array = NDArray[np.float64]


class LinearSchemes:
    """The bounds that linear analysis would keep to."""

    def __init__(self, study: Study, workers: Workers) -> None:
        self.priced, self.limits = study.deviating.priced, study.limits
        self._known: dict[Distribution, Spread] = {}
        self._own = study.deviating.distributions
        contributors, responses = study.description
        still = {n: e.value for n, e in self._own.items() if isinstance(e, Constant)}
        varying = set(self._own) - set(still)
        self.names = [each.name for each in contributors if each.name in varying]
        spreads = {name: self._spread(self._own[name]) for name in self.names}
        usual = np.zeros(len(contributors))
        for column, each in enumerate(contributors):
            if each.name in spreads:
                lower, upper, *_ = spreads[each.name]
                usual[column] = (upper - lower) / 6
        # the machine that nothing scatters about: constant parts are as they are
        at = np.array([still.get(each.name, 0.0) for each in contributors])
        table = slopes(study.model, study.settings, usual, workers, at)
        alone = workers.simulate(study.model, at[None, :], study.settings)
        nominal = alone.responses[0]
        columns = {each.name: i for i, each in enumerate(responses)}
        self.nominal = {name: float(nominal[columns[name]]) for name in self.limits}
        self.slopes = {
            name: {
                each.name: float(table[row, columns[name]])
                for row, each in enumerate(contributors)
                if each.name in spreads
            }
            for name in self.limits
        }
        self.correlation = correlations(self.names, study.deviating.dependence)

    @property
    def known(self) -> bool:
        """Whether the machine has a slope everywhere."""
        slope = [value for of in self.slopes.values() for value in of.values()]
        return bool(np.all(np.isfinite([*slope, *self.nominal.values()])))

    def worst_case(self, choice: Choice) -> Array:
        """Return how far the worst machine is beyond each end: float64[end].

        Of what each end leaves to the machine that nothing scatters about.
        """
        spreads = self._spreads(choice)
        found = []
        for name, limit in self.limits.items():
            nominal = self.nominal[name]
            for sign, end in ((-1, limit.lower), (1, limit.upper)):
                if not np.isfinite(end):
                    continue
                off = sum(
                    max(sign * slope * spreads[part].lower,
                        sign * slope * spreads[part].upper)
                    for part, slope in self.slopes[name].items()
                )  # fmt: skip
                room = sign * (end - nominal)
                found.append(off / room - 1 if room > 0 else np.inf)
        return np.array(found)

    def root_sum_square(self, choice: Choice) -> Array:
        """Return logarithms of the shares beyond over those permitted: float64[limit].

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
            found.append(_beyond(linear.mean, linear.sigma, limit))
        return np.array(found)

    def _spreads(self, choice: Choice) -> dict[str, Spread]:
        new = dict(self._own)
        for priced, chosen in zip(self.priced, choice, strict=True):
            new.update(priced.distributions(chosen))
        return {name: self._spread(new[name]) for name in self.names}

    def _spread(self, distribution: Distribution) -> Spread:
        if distribution not in self._known:
            self._known[distribution] = spread_of(distribution)
        return self._known[distribution]


def _beyond(mean: float, sigma: float, limit: Limit) -> float:
    """Return the logarithm of the share beyond over that permitted."""
    sigma = max(sigma, 1e-12 * max(abs(mean), 1e-300))
    ends = ((limit.lower - mean) / sigma, (mean - limit.upper) / sigma)
    low, high = (float(log_ndtr(max(end, -1e6))) for end in ends)
    return float(np.logaddexp(low, high) - np.log(1 - limit.demanded))
