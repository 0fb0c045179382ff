"""Whether drawn machines cover those of other distributions.

The weights that trials show do not tell: the heaviest, which decide, are mostly
missing. But both distributions are known, and parts of the new ones cost nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.density_ratio import Density, Weighting, hanging_together
from tolstat.deviations.dependence import Dependence, joined
from tolstat.deviations.distributions import Distribution
from tolstat.errors import DistributionError

Array = NDArray[np.float64]

PARTS = 100_000  # drawn of the new distributions
MOST_UNCOVERED = 1e-4  # share of the new parts that may lie where none was drawn
# weights are of no use where one part in so many has such a share of all squares
RARE, HEAVY = 1e-4, 0.1
LIGHTEST = 1e-300
NONE_MET = math.log(40)  # parts that are to be expected where none is met, at most


class Cover(NamedTuple):
    """What weighted trials will be worth.

    Attributes
    ----------
    worth : float
        Effective trials for each: one over the mean square of the weights.
    most : float
        Weight to cap at.
    cut : float
        Share of the new machines that lies above the cap.
    """

    worth: float
    most: float
    cut: float


def check_covered(drawn: Distribution, new: Distribution) -> float:
    """Refuse a distribution that the one drawn does not cover, each by itself.

    Parameters
    ----------
    drawn, new : Distribution
        Of one contributor.

    Returns
    -------
    float
        Effective trials for each.

    Raises
    ------
    DistributionError
        If there is no ratio of densities, if new parts lie where none was drawn, or if
        the weights of few of them would decide.
    """
    parts = new.deviations((np.arange(PARTS) + 0.5) / PARTS)
    weights = Weighting({"": parts}, {"": drawn}, Dependence()).weights({"": new})
    if _few_decide(weights):
        raise DistributionError(
            "its tails are too heavy beside those drawn: a few parts would decide"
        )
    uncovered = float(np.mean(_outside(parts, Density(drawn))))
    if uncovered > MOST_UNCOVERED:
        raise DistributionError(
            f"{100 * uncovered:.2g} % of these parts lie where none was drawn"
        )
    return float(1 / weights.mean())


def cover_of(
    distributions: Mapping[str, Distribution],
    dependence: Dependence,
    new: Mapping[str, Distribution],
    trials: int,
) -> Cover:
    """Say what weighted trials will be worth, all contributors together.

    Parameters
    ----------
    distributions : mapping of str to Distribution
        That trials were drawn from.
    dependence : Dependence
        What hangs together.
    new : mapping of str to Distribution
        By contributor; each is covered.
    trials : int
        That are to be weighted.

    Raises
    ------
    DistributionError
        If the weights of few machines would decide: correlated parts of which only some
        change may do that.
    """
    names = {name for group in hanging_together(new, dependence) for name in group}
    batches = {n: each for n, each in dependence.batches.items() if n in names}
    pairs = {p: rank for p, rank in dependence.correlations.items() if p[0] in names}
    together = Dependence(batches, pairs)
    rng = np.random.RandomState(PARTS)  # an old generator, which is the same for ever
    factors = sorted(names | {batch.name for batch in batches.values()})
    unit = joined({name: rng.uniform(size=PARTS) for name in factors}, together)
    parts = {n: new.get(n, distributions[n]).deviations(unit[n]) for n in names}
    weights = Weighting(parts, distributions, together).weights(new)
    if _few_decide(weights):
        raise DistributionError(
            "a few machines would decide; of parts that hang together, change all"
        )
    uncovered = np.zeros(PARTS, np.bool_)
    for name in new:
        uncovered |= _outside(parts[name], Density(distributions[name]))
    heavy = np.sort(np.maximum(weights[~uncovered], LIGHTEST))
    # the cap that costs least: the next machine of that weight, and all above it
    drawn_above = np.cumsum((1 / heavy)[::-1])[::-1] / PARTS
    above = np.arange(PARTS, PARTS - len(heavy), -1) / PARTS - drawn_above * heavy
    best = int(np.argmin(NONE_MET * heavy / trials + above))
    worth, cut = 1 / weights.mean(), max(float(above[best]), 0.0)
    return Cover(float(worth), float(heavy[best]), cut)


def _outside(parts: Array, drawn: Density) -> NDArray[np.bool_]:
    """Tell which of float64[part] parts lie where none was drawn."""
    lower, upper = drawn.ends
    edge = 1e-9 * (upper - lower)  # ends that are the same but for rounding
    return np.asarray((parts < lower - edge) | (parts > upper + edge))


def _few_decide(weights: Array) -> bool:
    """Tell whether few of float64[part] new parts have much of all squared weights."""
    heaviest = np.sort(weights)[-round(RARE * len(weights)) :]
    return bool(heaviest.sum() > HEAVY * weights.sum())
