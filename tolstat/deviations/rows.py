"""Rows of a file as trials: how another program sampled them, and whether that shows.

What a study says of them is compared with them: distributions and independence.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from tolstat.arrays import Array, Integers, Truths
from tolstat.deviations.density_ratio import Density
from tolstat.deviations.dependence import (
    CLOSEST,
    Dependence,
    correlations,
    rank_of_scores,
)
from tolstat.deviations.distributions import Constant, Distribution, Tolerance
from tolstat.deviations.samplers import Sampler
from tolstat.deviations.spread import zone_of
from tolstat.errors import DistributionError

DOUBTFUL = 1e-4  # probability of what is seen: a smaller one is no chance
FARTHEST = 5.0  # times its sigma that a correlation of rows lies from the stated one
LEAST = 0.005  # by which a correlation differs: rounding changes it by less
ROUNDING = 1e-9  # of a tolerance
FEWEST = 20  # rows that are compared with a distribution


class Rows(Sampler):
    """Rows of a file, sampled by another program."""

    def __init__(self, promise: str) -> None:
        self.promise = promise  # type: ignore[misc]


# by the word in a study; None: no sample of production, so no statistics
ROWS: Mapping[str, Rows | None] = {
    "random": Rows(
        "rows of a file, said to be random: then order-statistic intervals of "
        "quantiles are exact, and those of fractions out of limit are anytime-valid"
    ),
    "latin": Rows(
        "rows of a file, said to be one Latin hypercube: intervals are those of as "
        "many random trials, whose averages scatter more"
    ),
    "grid": None,
    "unknown": None,
}


class Outside(NamedTuple):
    """Rows outside the tolerance of an input."""

    name: str
    rows: Integers


class Misfit(NamedTuple):
    """An input whose rows its distribution does not give."""

    name: str
    p_value: float  # Kolmogorov-Smirnov


class Correlated(NamedTuple):
    """Inputs with another rank correlation than the study states."""

    names: tuple[str, str]
    correlation: float
    stated: float  # 0 for independent ones


Contradiction = Outside | Misfit | Correlated


def contradictions(
    deviations: Mapping[str, Array],
    distributions: Mapping[str, Distribution],
    dependence: Dependence,
    *,
    sample: bool,
) -> Iterator[Contradiction]:
    """Yield what contradicts the distributions that a study states.

    Parameters
    ----------
    deviations : mapping of str to float64[row]
        Of the rows, SI, by input.
    sample : bool
        Whether the rows are said to be sampled from the distributions.
    """
    stated = {n: d for n, d in distributions.items() if not isinstance(d, Constant)}
    for name, distribution in stated.items():
        values, zone = deviations[name], zone_of(distribution)
        p_value = _p_value(values, distribution) if sample else 1.0
        if zone is not None:
            rows = np.flatnonzero(_outside(values, zone))
            if len(rows) and not (
                sample and _expected(len(rows), len(values), distribution)
            ):
                yield Outside(name, rows)
        if p_value < DOUBTFUL:
            yield Misfit(name, p_value)
    if sample:
        varying = {n: x for n, x in deviations.items() if n in stated and np.ptp(x) > 0}
        yield from _correlated(varying, dependence)


def _outside(values: Array, zone: Tolerance) -> Truths:
    slack = ROUNDING * zone.half
    return np.asarray((values < zone.lower - slack) | (values > zone.upper + slack))


def _expected(outside: int, rows: int, distribution: Distribution) -> bool:
    """Return whether so many rows outside a tolerance are chance."""
    from scipy.stats import binom  # slow to import

    zone = zone_of(distribution)
    assert zone
    unit = (np.arange(10_000) + 0.5) / 10_000
    share = np.mean(_outside(distribution.deviations(unit), zone))
    return bool(binom.sf(outside - 1, rows, share) >= DOUBTFUL)


def _p_value(values: Array, distribution: Distribution) -> float:
    """Return the probability of rows as far from a distribution; 1 where not tested."""
    from scipy.stats import kstest  # slow to import

    if len(values) < FEWEST:
        return 1.0
    try:
        scores = Density(distribution).scores(values)
    except DistributionError:  # many parts have one value
        return 1.0
    return float(kstest(ndtr(scores), "uniform").pvalue)


def _correlated(
    deviations: Mapping[str, Array], dependence: Dependence
) -> Iterator[Correlated]:
    """Yield pairs whose ranks are correlated by more, or less, than chance.

    Fisher's transformation of both correlations compares them.
    """
    ranks = {n: np.argsort(np.argsort(x)) for n, x in deviations.items()}
    rows = len(next(iter(ranks.values()), ()))
    if rows < FEWEST or len(ranks) < 2:
        return
    table = np.corrcoef(np.array([*ranks.values()]))
    scores = correlations([*ranks], dependence)
    for (i, first), (j, second) in combinations(enumerate(ranks), 2):
        correlation, stated = float(table[i, j]), rank_of_scores(scores[i, j])
        ends = np.clip([correlation, stated], -CLOSEST, CLOSEST)
        distance = abs(float(np.diff(np.arctanh(ends))[0])) * math.sqrt(rows - 1)
        if distance > FARTHEST and abs(correlation - stated) > LEAST:
            yield Correlated((first, second), correlation, stated)
