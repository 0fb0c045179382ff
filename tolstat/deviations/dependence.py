"""Dependent deviations: parts of one batch, and correlations.

Both act on normal scores (a Gaussian copula): each deviation keeps its distribution.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from tolstat.arrays import Array
from tolstat.deviations.distributions import Distribution
from tolstat.errors import DependenceError

Pair = tuple[str, str]

# a correlation matrix below this least eigenvalue counts as not positive definite
LEAST_EIGENVALUE = 1e-9
TERMS = 200  # of an expansion in Hermite polynomials
NOTED = 1e-7  # smallest part of a correlation that is noted
FAR, STEP = 8.0, 1e-3  # of the normal scores over which it is integrated
CLOSEST = 1 - 1e-9  # correlation of normal scores


class Batch(NamedTuple):
    """The batch that a part comes from."""

    name: str  # the contributors' name without their number
    # share of the variance of the normal scores due to the batch; with 1 all its parts
    # are equal
    share: float


class Dependence(NamedTuple):
    """Which deviations depend on each other."""

    batches: Mapping[str, Batch] = {}  # by contributor
    # rank correlations (Spearman) of pairs of contributors
    correlations: Mapping[Pair, float] = {}


def joined(unit: Mapping[str, Array], dependence: Dependence) -> dict[str, Array]:
    """Return dependent unit samples from independent ones of contributors and batches.

    Each float64[trial] stays uniform; independent contributors do not change a bit.
    """
    samples = dict(unit)
    for name, (batch, share) in dependence.batches.items():
        if share == 1:
            samples[name] = unit[batch]
        else:
            shift, own_scores = ndtri(unit[batch]), ndtri(unit[name])
            samples[name] = _unit(
                np.sqrt(share) * shift + np.sqrt(1 - share) * own_scores
            )
    for group in groups(dependence.correlations):
        mixing = np.linalg.cholesky(correlation_of_scores(group, dependence))
        scores = [np.asarray(ndtri(unit[name])) for name in group]
        for row, name in enumerate(group[1:], start=1):
            # summed in this order, not by BLAS: bitwise the same for any number of rows
            mixed = mixing[row, 0] * scores[0]
            for column in range(1, row + 1):
                mixed = mixed + mixing[row, column] * scores[column]
            samples[name] = _unit(mixed)
    return samples


def _unit(scores: Array) -> Array:
    """Return unit samples of normal scores; above 8 sigma rounding would reach 1."""
    return np.clip(np.asarray(ndtr(scores), np.float64), 2.0**-53, 1 - 2.0**-53)


def groups(pairs: Iterable[Pair]) -> list[list[str]]:
    """List independent groups of correlated names, each in order."""
    separate: list[list[str]] = []
    for first, second in pairs:
        touched = [group for group in separate if first in group or second in group]
        merged = [name for group in touched for name in group]
        merged += [name for name in (first, second) if name not in merged]
        separate = [group for group in separate if group not in touched] + [merged]
    return [sorted(group) for group in separate]


def correlation_of_scores(group: list[str], dependence: Dependence) -> Array:
    """Return the correlation matrix of the normal scores of a group of contributors.

    2 sin(pi rho / 6) of the rank correlations rho (K. Pearson, Drapers' Company
    Research Memoirs IV, 1907); pairs not given are uncorrelated.

    Raises `DependenceError` if it is not positive definite; the entries to change are
    named.
    """
    R = np.eye(len(group))
    ranks = {}
    for pair, rank in dependence.correlations.items():
        if pair[0] in group:
            i, j = (group.index(name) for name in pair)
            R[i, j] = R[j, i] = scores_of_rank(rank)
            ranks[pair] = rank
    values, vectors = np.linalg.eigh(R)
    if values[0] < LEAST_EIGENVALUE:
        # these deviations would have a combination of negative variance
        weight = np.abs(vectors[:, 0])
        cause = {n for n, w in zip(group, weight, strict=True) if w > 0.1}
        named = [
            f"{a} with {b} ({rank:g})"
            for (a, b), rank in ranks.items()
            if {a, b} <= cause
        ]
        raise DependenceError(
            "not positive definite: no parts can be correlated like this; bring nearer "
            f"to zero: {', '.join(named)} (pairs not given are uncorrelated)"
        )
    return R


def scores_of_rank(rank: float) -> float:
    """Return the correlation of normal scores: Pearson's of normal deviations."""
    return 2 * math.sin(math.pi * rank / 6)


def rank_of_scores(r: float) -> float:
    """Return the rank correlation of normal scores whose correlation is r."""
    return 6 / math.pi * math.asin(r / 2)


def rank_of_pearson(pearson: float, first: Distribution, second: Distribution) -> float:
    """Return the rank correlation of two deviations with a linear correlation.

    The correlation r of their normal scores is solved for: that of the deviations is
    the sum of a_k b_k r^k over those of a_k b_k, with a, b their expansions in Hermite
    polynomials (H. O. Lancaster, Biometrika 44, 1957). Normal ones have a_1, b_1 alone.

    Raises `DependenceError` if no Gaussian copula reaches it.
    """
    from scipy.optimize import brentq  # slow to load, and seldom needed

    linear = _linear(first, second)
    least, most = linear(-CLOSEST), linear(CLOSEST)
    if not least <= pearson <= most:
        raise DependenceError(
            f"Pearson correlation {pearson:g}: these two distributions reach "
            f"{least:.3g} to {most:.3g}"
        )
    r = brentq(lambda r: linear(r) - pearson, -CLOSEST, CLOSEST, xtol=1e-14)
    return rank_of_scores(r)


def pearson_of_rank(rank: float, first: Distribution, second: Distribution) -> float:
    """Return the linear correlation of two deviations with a rank correlation."""
    r = scores_of_rank(rank)
    # a note has four digits: later terms, below r^k, are none of them
    last = math.ceil(math.log(NOTED) / math.log(max(abs(r), NOTED)))
    return _linear(first, second, min(last, TERMS))(r)


def _linear(
    first: Distribution, second: Distribution, terms: int = TERMS
) -> Callable[[float], float]:
    """Return the linear correlation of two deviations, by that of their scores."""
    products = _hermite(first, terms) * _hermite(second, terms)
    powers = np.arange(1, terms + 1)
    return lambda r: float(np.sum(products * r**powers))


def _hermite(distribution: Distribution, terms: int) -> Array:
    """Return the expansion of a deviation in normal scores, float64[term]; its norm 1.

    Polynomials are normalized; the constant term, the mean, is left out.
    """
    z = np.arange(-FAR, FAR + STEP / 2, STEP)
    weight = np.exp(-0.5 * z * z)
    weight /= weight.sum()
    x = distribution.deviations(ndtr(z))
    x = x - weight @ x
    x = x / math.sqrt(weight @ x**2)
    before, polynomial, coefficients = (
        np.zeros_like(z),
        np.ones_like(z),
        np.empty(terms),
    )
    for k in range(terms):
        after = (z * polynomial - math.sqrt(k) * before) / math.sqrt(k + 1)
        before, polynomial = polynomial, after
        coefficients[k] = weight @ (x * polynomial)
    return coefficients
