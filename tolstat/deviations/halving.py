"""How much likelier each machine is once some tolerances are halved.

Halved is a tolerance whose ends, and with them every deviation, are half as far from
zero, or from its nearer end where it lies on one side of zero: +-0.2 mm becomes
+-0.1 mm, 0..60 um becomes 0..30 um, +16..+34 um becomes +16..+25 um, as a finer grade
of the same position has it. The shape of the distribution stays, and so does Cp; rank
correlations stay too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tolstat.deviations.dependence import Dependence, correlation_of_scores, groups
from tolstat.deviations.distributions import Distribution
from tolstat.errors import DistributionError

Array = NDArray[np.float64]

# normal scores between which a distribution is tabulated: one part in 10^10 is beyond
FARTHEST, STEPS = 6.4, 4097


class Marginal:
    """Normal scores of one deviation, as it is and as if twice as far out.

    Parameters
    ----------
    distribution : Distribution
        Of the deviation.
    deviations : float64[trial]
        Drawn from it, SI.

    Attributes
    ----------
    scores, doubled : float64[trial]
        Normal scores of the deviations, and of deviations twice as far out: what each
        would be if the halved distribution had made it. Infinite beyond the ends.
    stretch : float64[trial]
        Logarithm of the slope of `doubled` over `scores`.

    Raises
    ------
    DistributionError
        If there is no tolerance, or many parts have as good as one deviation: those
        reworked to an end, or of an arcsine distribution.
    """

    def __init__(self, distribution: Distribution, deviations: Array) -> None:
        zone = getattr(distribution, "tolerance", None)
        if zone is None:
            raise DistributionError("it has no tolerance")
        score = np.linspace(-FARTHEST, FARTHEST, STEPS)
        at = distribution.deviations(np.asarray(ndtr(score), np.float64))
        if not np.all(np.diff(at) > 0):
            raise DistributionError("many parts have as good as one deviation")
        slope = np.gradient(at, score)
        centre = min(max(0.0, zone.lower), zone.upper)
        twice = centre + 2 * (deviations - centre)
        self.scores = np.interp(deviations, at, score)
        self.doubled = np.interp(twice, at, score, -np.inf, np.inf)
        log_slope = np.log(slope)
        before, after = (_tabulated(log_slope, s) for s in (self.scores, self.doubled))
        self.stretch = np.log(2) + before - after


def _tabulated(table: Array, scores: Array) -> Array:
    """Look float64[trial] normal scores up in a table between the farthest ones."""
    # a million scores: no more arrays of them than it takes
    place = np.clip(scores, -FARTHEST, FARTHEST)
    place += FARTHEST
    place *= (STEPS - 1) / (2 * FARTHEST)
    below = np.minimum(place.astype(np.int64), STEPS - 2)
    place -= below
    place *= np.diff(table)[below]
    place += table[below]
    return np.asarray(place, np.float64)


class Halving:
    """Drawn machines, to be weighted as if some tolerances were halved.

    Parameters
    ----------
    deviations : mapping of str to float64[trial]
        By contributor, SI; of every contributor that deviates.
    distributions : mapping of str to Distribution
        That they were drawn from.
    dependence : Dependence
        What hangs together.
    """

    def __init__(
        self,
        deviations: Mapping[str, Array],
        distributions: Mapping[str, Distribution],
        dependence: Dependence,
    ) -> None:
        self.deviations = deviations
        self.distributions = distributions
        self.dependence = dependence
        self._marginals: dict[str, Marginal] = {}

    def weights(self, halved: Sequence[str]) -> Array:
        """Return the density of each machine with halved tolerances over that as drawn.

        Parameters
        ----------
        halved : sequence of str
            The contributors whose tolerances are halved, all at once.

        Returns
        -------
        float64[trial]
            Their mean is 1 but for chance: machines weighted so are those of the
            halved tolerances.

        Raises
        ------
        DistributionError
            If the ratio does not exist: without a tolerance, with many parts alike, or
            where only some of the parts of a batch, all alike, would be halved.
        """
        names = [name for name in halved if not self._as_another(name, halved)]
        log_weight = np.zeros(len(next(iter(self.deviations.values()))))
        outside = np.zeros(len(log_weight), np.bool_)
        for name in names:
            outside |= np.isinf(self._marginal(name).doubled)
            log_weight += self._marginal(name).stretch
        for joint in _hanging_together(names, self.dependence):
            members = [self._marginal(name) for name in joint]
            before = np.array([each.scores for each in members])
            after = np.array(
                [
                    each.doubled if name in names else each.scores
                    for name, each in zip(joint, members, strict=True)
                ]
            )
            after[np.isinf(after)] = 0.0  # outside, of no weight anyway
            inverse = np.linalg.inv(_correlation(joint, self.dependence))
            # sums over pairs, not by BLAS: alike for any number of rows
            log_weight += 0.5 * np.einsum("it,ij,jt->t", before, inverse, before)
            log_weight -= 0.5 * np.einsum("it,ij,jt->t", after, inverse, after)
        weights = np.exp(log_weight)
        weights[outside] = 0.0
        return np.asarray(weights, np.float64)

    def _marginal(self, name: str) -> Marginal:
        if name not in self._marginals:
            made = Marginal(self.distributions[name], self.deviations[name])
            self._marginals[name] = made
        return self._marginals[name]

    def _as_another(self, name: str, halved: Sequence[str]) -> bool:
        """Tell whether a part is as an earlier one of its batch: weighted already."""
        batches = self.dependence.batches
        batch = batches.get(name)
        if batch is None or batch.share < 1:
            return False
        alike = [n for n, other in batches.items() if other.name == batch.name]
        if not set(alike) <= set(halved):
            raise DistributionError("all parts of its batch are alike")
        if any(self.distributions[n] != self.distributions[name] for n in alike):
            raise DistributionError("the parts of its batch have different tolerances")
        return name != alike[0]


def _hanging_together(names: Sequence[str], dependence: Dependence) -> list[list[str]]:
    """List each name with whatever it hangs together with."""
    batches: dict[str, list[str]] = {}
    for name, batch in dependence.batches.items():
        if batch.share < 1:
            batches.setdefault(batch.name, []).append(name)
    several = [*groups(dependence.correlations), *batches.values()]
    found = [group for group in several if set(group) & set(names)]
    joined = {name for group in found for name in group}
    return found + [[name] for name in names if name not in joined]


def _correlation(joint: list[str], dependence: Dependence) -> Array:
    """Return the correlation of the normal scores of what hangs together."""
    batch = dependence.batches.get(joint[0])
    if batch is None or batch.share == 1:
        return correlation_of_scores(joint, dependence)
    return np.eye(len(joint)) * (1 - batch.share) + batch.share
