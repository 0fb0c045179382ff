"""How much likelier each drawn machine is once its parts come from other distributions.

The ratio of two densities, with what hangs together as before: batches and rank
correlations act on normal scores, and the new deviations have the same ones.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tolstat.deviations.dependence import Dependence, correlation_of_scores, groups
from tolstat.deviations.distributions import Distribution
from tolstat.errors import DistributionError

Array = NDArray[np.float64]

# normal scores between which a distribution is tabulated: one part in 10^10 is beyond
FARTHEST, STEPS = 6.4, 4097
SCORES = np.linspace(-FARTHEST, FARTHEST, STEPS)


class Density:
    """Density of a distribution, as its deviations and their slope over normal scores.

    Parameters
    ----------
    distribution : Distribution
        Of a deviation.
    beside : Density, optional
        That it is compared with: where one is the other but for a power of two, their
        ratio is exact.

    Attributes
    ----------
    ends : tuple of float
        Between which all but one part in 10^10 lie, SI.
    width : float
        Largest slope, SI.
    size : float
        That slopes are over: a power of two.

    Raises
    ------
    DistributionError
        If many parts have as good as one deviation: those measured, reworked to an
        end, or of an arcsine distribution.
    """

    def __init__(
        self, distribution: Distribution, beside: Density | None = None
    ) -> None:
        at = distribution.deviations(np.asarray(ndtr(SCORES), np.float64))
        if not np.all(np.diff(at) > 0):
            raise DistributionError("many parts have as good as one deviation")
        slope = np.gradient(at, SCORES)
        self.ends = float(at[0]), float(at[-1])
        self.width = float(slope.max())
        ratio = self.width / beside.width if beside else 1.0
        self.size = 2.0 ** round(math.log2(ratio))
        self._at, self._log_slope = at, np.log(slope / self.size)

    def scores(self, deviations: Array) -> Array:
        """Return normal scores of float64[trial] deviations; infinite beyond the ends.

        Scores of an end itself are finite.
        """
        return np.interp(deviations, self._at, SCORES, -np.inf, np.inf)

    def log_slope(self, scores: Array) -> Array:
        """Return the logarithm of slope over size at float64[trial] normal scores."""
        # a million scores: no more arrays of them than it takes
        place = np.clip(scores, -FARTHEST, FARTHEST)
        place += FARTHEST
        place *= (STEPS - 1) / (2 * FARTHEST)
        below = np.minimum(place.astype(np.int64), STEPS - 2)
        place -= below
        place *= np.diff(self._log_slope)[below]
        place += self._log_slope[below]
        return np.asarray(place, np.float64)


class Weighting:
    """Drawn machines, to be weighted as if their parts came from other distributions.

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
        self._drawn: dict[str, tuple[Density, Array]] = {}

    def weights(self, new: Mapping[str, Distribution]) -> Array:
        """Return the density of each machine with new distributions over that as drawn.

        Parameters
        ----------
        new : mapping of str to Distribution
            By contributor; those that are not named stay as drawn.

        Returns
        -------
        float64[trial]
            Their mean is 1 but for chance, where the new distributions lie within those
            drawn: machines weighted so are those of the new distributions.

        Raises
        ------
        DistributionError
            If the ratio does not exist: with many parts alike, of a contributor that
            did not deviate, or where the parts of a batch, all alike, would no longer
            be so.
        """
        names = [name for name in new if not self._as_another(name, new)]
        trials = len(next(iter(self.deviations.values())))
        log_weight, outside = np.zeros(trials), np.zeros(trials, np.bool_)
        scores = {}
        for name in names:
            drawn, before = self._as_drawn(name)
            density = Density(new[name], drawn)
            after = density.scores(self.deviations[name])
            outside |= np.isinf(after)
            log_weight += (
                np.log(drawn.size / density.size)
                + drawn.log_slope(before)
                - density.log_slope(after)
            )
            scores[name] = after
        for joint in hanging_together(names, self.dependence):
            before = np.array([self._as_drawn(name)[1] for name in joint])
            after = np.array(
                [
                    scores[name] if name in names else as_it_is
                    for name, as_it_is in zip(joint, before, strict=True)
                ]
            )
            after[np.isinf(after)] = 0.0  # outside, of no weight anyway
            inverse = np.linalg.inv(correlation_of(joint, self.dependence))
            # sums over pairs, not by BLAS: alike for any number of rows
            log_weight += 0.5 * np.einsum("it,ij,jt->t", before, inverse, before)
            log_weight -= 0.5 * np.einsum("it,ij,jt->t", after, inverse, after)
        weights = np.exp(log_weight)
        weights[outside] = 0.0
        return np.asarray(weights, np.float64)

    def _as_drawn(self, name: str) -> tuple[Density, Array]:
        """Return the density of a contributor as drawn, and its normal scores."""
        if name not in self.distributions:
            raise DistributionError("it did not deviate")
        if name not in self._drawn:
            density = Density(self.distributions[name])
            scores = np.clip(density.scores(self.deviations[name]), -FARTHEST, FARTHEST)
            self._drawn[name] = density, scores
        return self._drawn[name]

    def _as_another(self, name: str, new: Mapping[str, Distribution]) -> bool:
        """Tell whether a part is as an earlier one of its batch: weighted already."""
        alike = all_alike(name, self.dependence)
        if len(alike) < 2:
            return False
        if not set(alike) <= set(new):
            raise DistributionError("all parts of its batch are alike")
        for of in (self.distributions, new):
            if any(of[other] != of[name] for other in alike):
                raise DistributionError(
                    "the parts of its batch have different tolerances"
                )
        return name != alike[0]


def all_alike(name: str, dependence: Dependence) -> list[str]:
    """List the parts that are as one part is, itself among them, in order."""
    batches = dependence.batches
    batch = batches.get(name)
    if batch is None or batch.share < 1:
        return [name]
    return [each for each, other in batches.items() if other.name == batch.name]


def hanging_together(names: Iterable[str], dependence: Dependence) -> list[list[str]]:
    """List each name with whatever it hangs together with."""
    batches: dict[str, list[str]] = {}
    for name, batch in dependence.batches.items():
        if batch.share < 1:
            batches.setdefault(batch.name, []).append(name)
    several = [*groups(dependence.correlations), *batches.values()]
    found = [group for group in several if set(group) & set(names)]
    joined = {name for group in found for name in group}
    return found + [[name] for name in names if name not in joined]


def correlations(names: list[str], dependence: Dependence) -> Array:
    """Return the correlation of the normal scores of any contributors.

    Parameters
    ----------
    names : list of str
        Contributors.
    dependence : Dependence
        What of them hangs together.

    Returns
    -------
    float64[contributor, contributor]
        Of normal deviations it is that of the deviations themselves.
    """
    R = np.eye(len(names))
    place = {name: i for i, name in enumerate(names)}
    for joint in hanging_together(names, dependence):
        own = correlation_of(joint, dependence)
        for (i, one), (j, other) in product(enumerate(joint), repeat=2):
            if one in place and other in place:
                R[place[one], place[other]] = own[i, j]
    for one, other in product(names, repeat=2):
        if other in all_alike(one, dependence):
            R[place[one], place[other]] = 1.0
    return R


def correlation_of(joint: list[str], dependence: Dependence) -> Array:
    """Return the correlation of the normal scores of what hangs together."""
    batch = dependence.batches.get(joint[0])
    if batch is None or batch.share == 1:
        return correlation_of_scores(joint, dependence)
    return np.eye(len(joint)) * (1 - batch.share) + batch.share
