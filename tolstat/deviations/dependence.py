"""Deviations that hang together: parts of one batch, and correlations.

Both act on normal scores, so that every deviation keeps its own distribution (a
Gaussian copula).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from tolstat.errors import DependenceError

Array = NDArray[np.float64]
Pair = tuple[str, str]

# a correlation matrix below this least eigenvalue counts as not positive definite
LEAST_EIGENVALUE = 1e-9


class Batch(NamedTuple):
    """The batch that a part comes from.

    Attributes
    ----------
    name : str
        Of the batch: the contributors' name without their number.
    share : float
        Share of the variance of the normal scores that the batch's shift has; 1 makes
        all its parts alike.
    """

    name: str
    share: float


class Dependence(NamedTuple):
    """Which deviations hang together.

    Attributes
    ----------
    batches : mapping of str to Batch
        By contributor.
    correlations : mapping of pairs of str to float
        Rank correlations (Spearman) of pairs of contributors.
    """

    batches: Mapping[str, Batch] = {}
    correlations: Mapping[Pair, float] = {}


def joined(unit: Mapping[str, Array], dependence: Dependence) -> dict[str, Array]:
    """Make unit samples hang together.

    Parameters
    ----------
    unit : mapping of str to float64[trial]
        Independent unit samples of contributors and batches.
    dependence : Dependence
        What hangs together.

    Returns
    -------
    dict of str to float64[trial]
        Each still uniform; what hangs together with nothing is as it was, bit for bit.
    """
    found = dict(unit)
    for name, (batch, share) in dependence.batches.items():
        if share == 1:
            found[name] = unit[batch]
        else:
            shift, own = ndtri(unit[batch]), ndtri(unit[name])
            found[name] = _unit(np.sqrt(share) * shift + np.sqrt(1 - share) * own)
    for group in groups(dependence.correlations):
        mixing = np.linalg.cholesky(correlation_of_scores(group, dependence))
        scores = [np.asarray(ndtri(unit[name])) for name in group]
        for row, name in enumerate(group[1:], start=1):
            # summed in this order, not by BLAS: bitwise the same for any number of rows
            mixed = mixing[row, 0] * scores[0]
            for column in range(1, row + 1):
                mixed = mixed + mixing[row, column] * scores[column]
            found[name] = _unit(mixed)
    return found


def _unit(scores: Array) -> Array:
    """Turn normal scores into unit samples; beyond 8 sigma rounding would reach 1."""
    return np.clip(np.asarray(ndtr(scores), np.float64), 2.0**-53, 1 - 2.0**-53)


def groups(pairs: Iterable[Pair]) -> list[list[str]]:
    """Sort correlated names into groups that nothing connects, each in order."""
    found: list[list[str]] = []
    for first, second in pairs:
        touched = [group for group in found if first in group or second in group]
        merged = [name for group in touched for name in group]
        merged += [name for name in (first, second) if name not in merged]
        found = [group for group in found if group not in touched] + [merged]
    return [sorted(group) for group in found]


def correlation_of_scores(group: list[str], dependence: Dependence) -> Array:
    """Return the correlation matrix of the normal scores of a group.

    Parameters
    ----------
    group : list of str
        Contributors.
    dependence : Dependence
        With their rank correlations; pairs not given are uncorrelated.

    Returns
    -------
    float64[contributor, contributor]
        2 sin(pi rho / 6) of the rank correlations rho: what makes them so (K. Pearson,
        Drapers' Company Research Memoirs IV, 1907).

    Raises
    ------
    DependenceError
        If no deviations can be correlated like that; the entries to change are named.
    """
    R = np.eye(len(group))
    given = {}
    for pair, rank in dependence.correlations.items():
        if pair[0] in group:
            i, j = (group.index(name) for name in pair)
            R[i, j] = R[j, i] = 2 * np.sin(np.pi * rank / 6)
            given[pair] = rank
    values, vectors = np.linalg.eigh(R)
    if values[0] < LEAST_EIGENVALUE:
        # the deviations that would have a combination of negative variance
        weight = np.abs(vectors[:, 0])
        guilty = {n for n, w in zip(group, weight, strict=True) if w > 0.1}
        named = [
            f"{a} with {b} ({rank:g})"
            for (a, b), rank in given.items()
            if {a, b} <= guilty
        ]
        raise DependenceError(
            "not positive definite: no parts can be correlated like this; bring nearer "
            f"to zero: {', '.join(named)} (pairs not given are uncorrelated)"
        )
    return R
