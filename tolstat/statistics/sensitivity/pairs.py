"""Pairs of contributors that only together explain the machines beyond a limit."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.proportions import proportion
from tolstat.statistics.sensitivity.out_of_limit import CLEAR, holm

Array = NDArray[np.float64]
Machines = NDArray[np.bool_]

SUM, DIFFERENCE, BOTH_FAR = "sum", "difference", "both far off"
LEAST_EXPLAINED = 0.4  # share of the machines beyond that a named pair explains
FAR = 0.05  # share of all machines that count as far off, if no more are beyond
RANKED = 100_000  # trials among which a deviation has its place
CHANCE = 4.0  # correlation that is no chance, times the root of the trials
ONE_WAY = 0.9  # of the machines, from which a combination goes one way


class Together(NamedTuple):
    """Two contributors that together explain machines beyond, more than each alone.

    Attributes
    ----------
    members : tuple of str
        Their names.
    how : str
        "difference": one high where the other is low; "sum": both high or both low;
        "both far off": either of them to any side.
    way : int
        1 where the first of them is high, -1 where it is low, 0: either happens.
    level : float
        How often chance alone would let some pair seem to matter so much, corrected for
        the number of pairs after Holm.
    far : Estimate
        Share of the machines beyond that have the combination far off.
    of_all : float
        The same of all machines: 5 %, or as many as are beyond.
    alone : float
        Share of the machines beyond that have the one member far off, or the other:
        the larger one.
    single : float
        The same of whichever contributor it is largest of.
    """

    members: tuple[str, str]
    how: str
    way: int
    level: float
    far: Estimate
    of_all: float
    alone: float
    single: float


def pairs(
    deviations: Mapping[str, Array], beyond: Mapping[str, Machines]
) -> dict[str, list[Together]]:
    """Find the pairs of contributors that together explain the machines beyond limits.

    Parameters
    ----------
    deviations : mapping of str to float64[trial]
        By contributor; of independent trials.
    beyond : mapping of str to bool[trial]
        Which machines are beyond the limit of each response; failed ones among them.

    Returns
    -------
    dict of str to list of Together
        By response; those that are clear, and far off in two of five of these machines
        or more, and in more than either member is; what explains most comes first.
        Contributors that hang together are no pair.

    Notes
    -----
    Deviations are compared as normal scores, and so are their distances from the
    median. If only one of two contributors matters, the other one's scores are normal
    in the machines beyond, whatever those of the first are; so then is the sum of the
    products of both over the root of the sum of squares of the first. That is tried
    with either as the first, and the one that tells less counts: a single contributor
    makes no pair, however much it matters. For each pair the smaller of both levels
    counts, of scores and of distances, doubled.
    """
    told = {n: each for n, each in beyond.items() if 0 < each.sum() < len(each)}
    found: dict[str, list[Together]] = {name: [] for name in beyond}
    if len(deviations) < 2 or not told:
        return found
    apart = ~_related(list(deviations.values()))
    known = [p for p in combinations(range(len(deviations)), 2) if apart[p]]
    distances = {n: np.abs(x - np.median(x)) for n, x in deviations.items()}
    if known:
        for name, machines in told.items():
            found[name] = _pairs(deviations, distances, machines, known)
    return found


def _pairs(
    deviations: Mapping[str, Array],
    distances: Mapping[str, Array],
    beyond: Machines,
    known: list[tuple[int, int]],
) -> list[Together]:
    """Find those of one limit among pairs of contributors, by their places."""
    names = list(deviations)
    z, far = (
        np.array([_scores(x, beyond, n) for n, x in of.items()])
        for of in (deviations, distances)
    )
    first, second = np.array(known).T
    signed, of_far = (_products(each)[first, second] for each in (z, far))
    levels = np.array([2 * ndtr(-np.abs(signed)), ndtr(-of_far)])
    corrected = holm(2 * levels.min(axis=0))
    of_all = min(max(FAR, float(beyond.mean())), 0.5)
    two_ends, one_end = -ndtri(of_all / 2), -ndtri(of_all)
    alone = [_far_off(each, two_ends, one_end)[0] for each in z]
    found = []
    for place in np.flatnonzero(corrected < CLEAR):
        i, j = known[place]
        if levels[1, place] < levels[0, place]:
            how, way = BOTH_FAR, 0
            off = float(np.mean((far[i] + far[j]) / math.sqrt(2) > one_end))
        else:
            how = SUM if signed[place] > 0 else DIFFERENCE
            u = z[i] + z[j] if how == SUM else z[i] - z[j]
            off, way = _far_off(u / math.sqrt(2), two_ends, one_end)
        most = max(alone[i], alone[j])
        if off > most and off >= LEAST_EXPLAINED:
            share = proportion(round(off * z.shape[1]), z.shape[1])
            level, members = float(corrected[place]), (names[i], names[j])
            found.append(
                Together(members, how, way, level, share, of_all, most, max(alone))
            )
    return sorted(found, key=lambda each: (-each.far.value, each.level))


def _far_off(u: Array, two_ends: float, one_end: float) -> tuple[float, int]:
    """Return the share of float64[machine beyond] that is far off, and to which side.

    To one side where as good as all are on it; 0: to either.
    """
    high = float(np.mean(u > 0))
    way = int(high >= ONE_WAY) - int(high <= 1 - ONE_WAY)
    off = way * u > one_end if way else np.abs(u) > two_ends
    return float(off.mean()), way


def _scores(x: Array, beyond: Machines, name: str) -> Array:
    """Return the normal scores that machines beyond have among all, ties by chance.

    The same for ever, but each contributor's own: scores of independent contributors
    whose ties fall alike would go together.
    """
    ordered = np.sort(x[:RANKED])
    n, values = len(ordered), x[beyond]
    low, high = (np.searchsorted(ordered, values, side) for side in ("left", "right"))
    own = np.random.RandomState(zlib.crc32(str(name).encode()))
    chance = own.random_sample(len(values))
    place = np.clip((low + chance * (high - low)) / n, 0.5 / n, 1 - 0.5 / n)
    return np.asarray(ndtri(place), np.float64)


def _products(z: Array) -> Array:
    """Return float64[i, j] normal scores: products of two, over the less telling one.

    Parameters
    ----------
    z : float64[contributor, machine beyond]
        Normal scores.
    """
    products = z @ z.T
    squares = np.diag(products)
    return np.asarray(products / np.sqrt(np.maximum.outer(squares, squares)))


def _related(columns: list[Array]) -> Machines:
    """Tell bool[i, j] which contributors hang together, also by way of others."""
    from scipy.sparse.csgraph import connected_components  # slow to import
    from scipy.stats import rankdata

    n = min(len(columns[0]), RANKED)
    ranks = np.array([rankdata(x[:n]) for x in columns])
    ranks -= ranks.mean(axis=1, keepdims=True)
    ranks /= np.linalg.norm(ranks, axis=1, keepdims=True)
    _, chain = connected_components(np.abs(ranks @ ranks.T) > CHANCE / math.sqrt(n))
    return np.asarray(chain[:, None] == chain)
