"""Ratio of the densities of each trial in new and in sampled distributions.

The dependence stays the same: batches and rank correlations act on normal scores, not
on deviations.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from itertools import product

import numpy as np
from scipy.special import ndtr

from tolstat.arrays import Array
from tolstat.deviations.dependence import Dependence, correlation_of_scores, groups
from tolstat.deviations.distributions import Distribution
from tolstat.errors import DistributionError

# range of normal scores in which a distribution is tabulated: all but 1 part in 10^10
FARTHEST, STEPS = 6.4, 4097
SCORES = np.linspace(-FARTHEST, FARTHEST, STEPS)


class Density:
    """Density of a distribution, as its deviations and their slope over normal scores.

    `ends` hold all but one part in 10^10. `width` is the largest slope. Slopes are
    divided by `size`, a power of two. All are SI. If one density is the other scaled
    by a power of two, their ratio is exact.

    Raises `DistributionError` if many parts have nearly the same deviation: measured
    parts, parts reworked to an end, or an arcsine distribution.
    """

    def __init__(
        self, distribution: Distribution, reference: Density | None = None
    ) -> None:
        deviations = distribution.deviations(np.asarray(ndtr(SCORES), np.float64))
        if not np.all(np.diff(deviations) > 0):
            raise DistributionError("many parts have nearly the same deviation")
        slope = np.gradient(deviations, SCORES)
        self.ends = float(deviations[0]), float(deviations[-1])
        self.width = float(slope.max())
        ratio = self.width / reference.width if reference else 1.0
        self.size = 2.0 ** round(math.log2(ratio))
        self._at, self._log_slope = deviations, np.log(slope / self.size)

    def scores(self, deviations: Array) -> Array:
        """Return normal scores of float64[trial]; infinite outside the ends."""
        return np.interp(deviations, self._at, SCORES, -np.inf, np.inf)

    def log_slope(self, scores: Array) -> Array:
        """Return the logarithm of slope over size at float64[trial] normal scores."""
        # in place: there may be a million scores
        position = np.clip(scores, -FARTHEST, FARTHEST)
        position += FARTHEST
        position *= (STEPS - 1) / (2 * FARTHEST)
        below = np.minimum(position.astype(np.int64), STEPS - 2)
        position -= below
        position *= np.diff(self._log_slope)[below]
        position += self._log_slope[below]
        return np.asarray(position, np.float64)


class DensityRatio:
    """Weights of trials as if their parts came from other distributions.

    Parameters
    ----------
    deviations : mapping of str to float64[trial]
        Deviations of every contributor that deviates, SI.
    distributions, dependence
        What these were sampled with.
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
        self._known: dict[str, tuple[Density, Array]] = {}

    def weights(self, new: Mapping[str, Distribution]) -> Array:
        """Return the density of each trial with new distributions over that as sampled.

        The expectation of float64[trial] is 1 if the sampled distributions cover the
        new ones. Contributors that are not given stay as sampled.

        Raises `DistributionError` if the ratio does not exist: with many equal parts,
        of a contributor that did not deviate, or where the equal parts of a batch would
        differ.
        """
        names = [name for name in new if not self._repeats(name, new)]
        trials = len(next(iter(self.deviations.values())))
        log_weight, outside = np.zeros(trials), np.zeros(trials, np.bool_)
        scores = {}
        for name in names:
            sampled, before = self._sampled_density(name)
            density = Density(new[name], sampled)
            after = density.scores(self.deviations[name])
            outside |= np.isinf(after)
            log_weight += (
                np.log(sampled.size / density.size)
                + sampled.log_slope(before)
                - density.log_slope(after)
            )
            scores[name] = after
        for joint in dependent_groups(names, self.dependence):
            before = np.array([self._sampled_density(name)[1] for name in joint])
            after = np.array(
                [
                    scores[name] if name in names else as_it_is
                    for name, as_it_is in zip(joint, before, strict=True)
                ]
            )
            after[np.isinf(after)] = 0.0  # outside: weight 0
            inverse = np.linalg.inv(correlation_of(joint, self.dependence))
            # sums over pairs, not by BLAS: the same for any number of rows
            log_weight += 0.5 * np.einsum("it,ij,jt->t", before, inverse, before)
            log_weight -= 0.5 * np.einsum("it,ij,jt->t", after, inverse, after)
        weights = np.exp(log_weight)
        weights[outside] = 0.0
        return np.asarray(weights, np.float64)

    def _sampled_density(self, name: str) -> tuple[Density, Array]:
        """Return the sampled density of a contributor, and its normal scores."""
        if name not in self.distributions:
            raise DistributionError("it did not deviate")
        if name not in self._known:
            density = Density(self.distributions[name])
            scores = np.clip(density.scores(self.deviations[name]), -FARTHEST, FARTHEST)
            self._known[name] = density, scores
        return self._known[name]

    def _repeats(self, name: str, new: Mapping[str, Distribution]) -> bool:
        """Return whether a part equals a part of its batch that is weighted already."""
        equal = equal_parts(name, self.dependence)
        if len(equal) < 2:
            return False
        if not set(equal) <= set(new):
            raise DistributionError("all parts of its batch are equal")
        for distributions in (self.distributions, new):
            if any(distributions[other] != distributions[name] for other in equal):
                raise DistributionError(
                    "the parts of its batch have different tolerances"
                )
        return name != equal[0]


def equal_parts(name: str, dependence: Dependence) -> list[str]:
    """List the parts that always equal a part, itself included, in order."""
    batches = dependence.batches
    batch = batches.get(name)
    if batch is None or batch.share < 1:
        return [name]
    return [part for part, other in batches.items() if other.name == batch.name]


def dependent_groups(names: Iterable[str], dependence: Dependence) -> list[list[str]]:
    """List the dependent groups of names; an independent name is alone."""
    batches: dict[str, list[str]] = {}
    for name, batch in dependence.batches.items():
        if batch.share < 1:
            batches.setdefault(batch.name, []).append(name)
    several = [*groups(dependence.correlations), *batches.values()]
    touched = [group for group in several if set(group) & set(names)]
    joined = {name for group in touched for name in group}
    return touched + [[name] for name in names if name not in joined]


def correlations(names: list[str], dependence: Dependence) -> Array:
    """Return float64[contributor, contributor] correlations of normal scores.

    Of normal deviations these are the correlations of the deviations themselves.
    """
    R = np.eye(len(names))
    row = {name: i for i, name in enumerate(names)}
    for joint in dependent_groups(names, dependence):
        of_group = correlation_of(joint, dependence)
        for (i, first), (j, second) in product(enumerate(joint), repeat=2):
            if first in row and second in row:
                R[row[first], row[second]] = of_group[i, j]
    for first, second in product(names, repeat=2):
        if second in equal_parts(first, dependence):
            R[row[first], row[second]] = 1.0
    return R


def correlation_of(joint: list[str], dependence: Dependence) -> Array:
    """Return the correlation of the normal scores of a dependent group."""
    batch = dependence.batches.get(joint[0])
    if batch is None or batch.share == 1:
        return correlation_of_scores(joint, dependence)
    return np.eye(len(joint)) * (1 - batch.share) + batch.share
