"""Ratio of the densities of each trial in new and in sampled distributions.

The dependence stays the same: batches and rank correlations act on normal scores, not
on deviations.

The weights of the trials do not show whether the sampled distributions cover the new
ones: the heaviest weights, which dominate, are mostly missing. Both distributions are
known, so new parts are sampled instead.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from tolstat.arrays import Array, Truths
from tolstat.deviations.dependence import (
    Dependence,
    correlations,
    dependent_groups,
    equal_parts,
    joined,
)
from tolstat.deviations.distributions import Distribution
from tolstat.errors import DistributionError

# range of normal scores in which a distribution is tabulated: all but 1 part in 10^10
FARTHEST, STEPS = 6.4, 4097
SCORES = np.linspace(-FARTHEST, FARTHEST, STEPS)


KEPT = 1 << 24  # deviations of a sample whose terms are kept, at most


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
        self._terms: dict[str, tuple[Distribution, Array, Array]] = {}

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
            after, term = self._term(name, new[name])
            outside |= np.isinf(after)
            log_weight += term
            scores[name] = after
        for joint in dependent_groups(names, self.dependence):
            before = np.array([self._sampled_density(name)[1] for name in joint])
            pairs = zip(joint, before, strict=True)
            after = np.array([scores.get(name, score) for name, score in pairs])
            after[np.isinf(after)] = 0.0  # outside: weight 0
            inverse = np.linalg.inv(correlations(joint, self.dependence))
            # sums over pairs, not by BLAS: the same for any number of rows
            log_weight += 0.5 * np.einsum("it,ij,jt->t", before, inverse, before)
            log_weight -= 0.5 * np.einsum("it,ij,jt->t", after, inverse, after)
        weights = np.exp(log_weight)
        weights[outside] = 0.0
        return np.asarray(weights, np.float64)

    def _term(self, name: str, new: Distribution) -> tuple[Array, Array]:
        """Return new scores of a contributor, and what it adds to log weights.

        Those of the latest distribution are kept: groups share their members.
        """
        kept = self._terms.get(name)
        if kept and kept[0] == new:
            return kept[1:]
        sampled, before = self._sampled_density(name)
        density = Density(new, sampled)
        after = density.scores(self.deviations[name])
        term = (
            np.log(sampled.size / density.size)
            + sampled.log_slope(before)
            - density.log_slope(after)
        )
        if len(after) * len(self.deviations) <= KEPT:
            self._terms[name] = new, after, term
        return after, term

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


PARTS = 100_000  # sampled from the new distributions
MOST_UNCOVERED = 1e-4  # share of the new parts outside the sampled distribution
# weights are useless if a share of the parts has much of all squares
HEAVIEST_SHARE, MOST_HEAVIEST = 1e-4, 0.1
LIGHTEST = 1e-300
NONE_MET = math.log(40)  # most expected parts if none is found


class Overlap(NamedTuple):
    """The efficiency of weighted trials."""

    # effective sample size per trial: one over the mean square of the weights
    efficiency: float
    most: float  # cap of the weights
    cut: float  # share of the new units above the cap


def check_overlap(sampled: Distribution, new: Distribution) -> float:
    """Return the effective sample size per trial with a new distribution of one part.

    Raises `DistributionError` if there is no ratio of densities, if new parts lie
    outside the sampled distribution, or if few weights would dominate.
    """
    parts = new.deviations((np.arange(PARTS) + 0.5) / PARTS)
    weights = DensityRatio({"": parts}, {"": sampled}, Dependence()).weights({"": new})
    if _dominated_by_few(weights):
        raise DistributionError(
            "its tails are too heavy for the sampled ones: few parts would dominate"
        )
    uncovered = float(np.mean(_outside(parts, Density(sampled))))
    if uncovered > MOST_UNCOVERED:
        raise DistributionError(
            f"{100 * uncovered:.2g} % of these parts lie outside the sampled range"
        )
    return float(1 / weights.mean())


def overlap_of(
    distributions: Mapping[str, Distribution],
    dependence: Dependence,
    new: Mapping[str, Distribution],
    trials: int,
) -> Overlap:
    """Return the efficiency of weighted trials, all contributors together.

    Raises `DistributionError` if few weights would dominate, such as when only some of
    several correlated parts change.
    """
    joint = dependent_groups(new, dependence)
    names = dict.fromkeys(name for group in joint for name in group)
    batches = {n: batch for n, batch in dependence.batches.items() if n in names}
    pairs = {p: rank for p, rank in dependence.correlations.items() if p[0] in names}
    together = Dependence(batches, pairs)
    rng = np.random.RandomState(PARTS)  # its numbers never change
    factors = sorted({*names, *(batch.name for batch in batches.values())})
    unit = joined({name: rng.uniform(size=PARTS) for name in factors}, together)
    parts = {n: new.get(n, distributions[n]).deviations(unit[n]) for n in names}
    weights = DensityRatio(parts, distributions, together).weights(new)
    if _dominated_by_few(weights):
        others = ", ".join(name for name in names if name not in new)
        also = f": {others} too" if others else ""
        raise DistributionError(
            f"few units would dominate; change all parts that are correlated{also}"
        )
    uncovered = np.zeros(PARTS, np.bool_)
    for name in new:
        uncovered |= _outside(parts[name], Density(distributions[name]))
    heavy = np.sort(np.maximum(weights[~uncovered], LIGHTEST))
    # the cheapest cap: the next unit of that weight, and all above it
    sampled_above = np.cumsum((1 / heavy)[::-1])[::-1] / PARTS
    above = np.arange(PARTS, PARTS - len(heavy), -1) / PARTS - sampled_above * heavy
    best = int(np.argmin(NONE_MET * heavy / trials + above))
    efficiency, cut = 1 / weights.mean(), max(float(above[best]), 0.0)
    return Overlap(float(efficiency), float(heavy[best]), cut)


class Uncovered(NamedTuple):
    """What weighted trials far in the tails cannot show."""

    trials: Truths  # outside the sampled densities: these have no ratio
    units: float  # greatest share of the new units there, or outside the new densities


def uncovered(
    deviations: Mapping[str, Array],
    distributions: Mapping[str, Distribution],
    new: Mapping[str, Distribution],
) -> Uncovered:
    """Return which trials and units lie where densities are not tabulated."""
    trials, units = np.zeros(len(next(iter(deviations.values()))), np.bool_), 0.0
    for name in new:
        sampled = Density(distributions[name])
        trials |= _outside(deviations[name], sampled)
        lower, upper = Density(new[name]).scores(np.array(sampled.ends))
        units += float(ndtr(lower) + ndtr(-upper) + 2 * ndtr(-FARTHEST))
    return Uncovered(trials, units)


def _outside(parts: Array, sampled: Density) -> Truths:
    """Return which of float64[part] parts lie outside a sampled distribution."""
    lower, upper = sampled.ends
    edge = 1e-9 * (upper - lower)  # rounding of equal ends
    return np.asarray((parts < lower - edge) | (parts > upper + edge))


def _dominated_by_few(weights: Array) -> bool:
    """Return whether few of float64[part] parts have much of all squared weights."""
    heaviest = np.sort(weights)[-round(HEAVIEST_SHARE * len(weights)) :]
    return bool(heaviest.sum() > MOST_HEAVIEST * weights.sum())
