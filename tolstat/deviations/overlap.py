"""Whether the sampled distributions cover new ones.

The weights of the trials do not show it: the heaviest weights, which dominate, are
mostly missing. Both distributions are known, so new parts are sampled instead.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from tolstat.arrays import Array, Truths
from tolstat.deviations.density_ratio import FARTHEST, Density, DensityRatio
from tolstat.deviations.dependence import Dependence, dependent_groups, joined
from tolstat.deviations.distributions import Distribution
from tolstat.errors import DistributionError

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
