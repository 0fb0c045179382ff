"""Pairs of contributors that only together explain the units out of limit."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from tolstat.arrays import Array, Truths
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.sensitivity.out_of_limit import CLEAR, holm

SUM, DIFFERENCE, BOTH_FAR = "sum", "difference", "both outer"
LEAST_EXPLAINED = 0.4  # share of the units out of limit that a pair explains
FAR = 0.05  # outer part of all trials, unless more are out of limit
RANKED = 100_000  # trials among which a deviation is ranked
CHANCE = 4.0  # significant correlation, times the root of the trials
ONE_WAY = 0.9  # share of the units from which a combination has one direction


class Together(NamedTuple):
    """Two contributors that together explain units out of limit better than either.

    Attributes
    ----------
    members : tuple of str
        Their names.
    how : str
        "difference": one high, the other low; "sum": both high or both low;
        "both outer": both in the outer part, to either side.
    way : int
        1 if the first is high, -1 if it is low, 0 if either happens.
    level : float
        p-value, corrected for the number of pairs after Holm.
    far : Estimate
        Share of the units out of limit with the combination in its outer part.
    of_all : float
        Same share of all trials: 5 %, or the share out of limit if larger.
    alone : float
        Share of the units out of limit with one member in its outer part; the larger.
    single : float
        Largest such share of a single contributor.
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
    deviations: Mapping[str, Array], out: Mapping[str, Truths]
) -> dict[str, list[Together]]:
    """Return the pairs of contributors that together explain units out of limit.

    Arguments as of `differences`. By response: significant pairs, in the outer part in
    at least 40 % of these units, and more often than either member; the highest share
    first. Correlated contributors are no pair.

    Notes
    -----
    Deviations are compared as normal scores, and so are their distances from the
    median. If only one of two contributors matters, the scores of the other stay normal
    in the units out of limit. Then the sum of the products of both, over the root of
    the sum of squares of the first, is normal too. Either takes the role of the first,
    and the weaker result counts: a single contributor makes no pair. For
    each pair the smaller level of scores and distances counts, doubled.
    """
    tested = {n: each for n, each in out.items() if 0 < each.sum() < len(each)}
    found: dict[str, list[Together]] = {name: [] for name in out}
    if len(deviations) < 2 or not tested:
        return found
    dependent = _dependent(list(deviations.values()))
    choices = [p for p in combinations(range(len(deviations)), 2) if not dependent[p]]
    distances = {n: np.abs(x - np.median(x)) for n, x in deviations.items()}
    if choices:
        for name, units in tested.items():
            found[name] = _pairs(deviations, distances, units, choices)
    return found


def _pairs(
    deviations: Mapping[str, Array],
    distances: Mapping[str, Array],
    out: Truths,
    choices: list[tuple[int, int]],
) -> list[Together]:
    """Return the pairs of one limit, among choices by index of contributor."""
    names = list(deviations)
    z, far = (
        np.array([_scores(x, out, n) for n, x in of.items()])
        for of in (deviations, distances)
    )
    first, second = np.array(choices).T
    signed, of_far = (_products(each)[first, second] for each in (z, far))
    levels = np.array([2 * ndtr(-np.abs(signed)), ndtr(-of_far)])
    corrected = holm(2 * levels.min(axis=0))
    of_all = min(max(FAR, float(out.mean())), 0.5)
    two_ends, one_end = -ndtri(of_all / 2), -ndtri(of_all)
    alone = [_outer_share(each, two_ends, one_end)[0] for each in z]
    found = []
    for place in np.flatnonzero(corrected < CLEAR):
        i, j = choices[place]
        if levels[1, place] < levels[0, place]:
            how, way = BOTH_FAR, 0
            off = float(np.mean((far[i] + far[j]) / math.sqrt(2) > one_end))
        else:
            how = SUM if signed[place] > 0 else DIFFERENCE
            u = z[i] + z[j] if how == SUM else z[i] - z[j]
            off, way = _outer_share(u / math.sqrt(2), two_ends, one_end)
        most = max(alone[i], alone[j])
        if off > most and off >= LEAST_EXPLAINED:
            share = proportion(round(off * z.shape[1]), z.shape[1])
            level, members = float(corrected[place]), (names[i], names[j])
            found.append(
                Together(members, how, way, level, share, of_all, most, max(alone))
            )
    return sorted(found, key=lambda each: (-each.far.value, each.level))


def _outer_share(u: Array, two_ends: float, one_end: float) -> tuple[float, int]:
    """Return the share of float64[unit out of limit] in the outer part, and its side.

    The side is 0 unless nearly all are on one.
    """
    high = float(np.mean(u > 0))
    way = int(high >= ONE_WAY) - int(high <= 1 - ONE_WAY)
    off = way * u > one_end if way else np.abs(u) > two_ends
    return float(off.mean()), way


def _scores(x: Array, out: Truths, name: str) -> Array:
    """Return the normal scores of units out of limit among all, equal values at random.

    Each contributor has separate random numbers, which never change: common ones would
    correlate independent contributors.
    """
    ordered = np.sort(x[:RANKED])
    n, values = len(ordered), x[out]
    low, high = (np.searchsorted(ordered, values, side) for side in ("left", "right"))
    generator = np.random.RandomState(zlib.crc32(str(name).encode()))
    chance = generator.random_sample(len(values))
    place = np.clip((low + chance * (high - low)) / n, 0.5 / n, 1 - 0.5 / n)
    return np.asarray(ndtri(place), np.float64)


def _products(z: Array) -> Array:
    """Return float64[i, j]: products of two rows of scores over the weaker one."""
    products = z @ z.T
    squares = np.diag(products)
    return np.asarray(products / np.sqrt(np.maximum.outer(squares, squares)))


def _dependent(columns: list[Array]) -> Truths:
    """Return bool[i, j]: contributors correlated directly or through others."""
    from scipy.sparse.csgraph import connected_components  # slow to import
    from scipy.stats import rankdata

    n = min(len(columns[0]), RANKED)
    ranks = np.array([rankdata(x[:n]) for x in columns])
    ranks -= ranks.mean(axis=1, keepdims=True)
    ranks /= np.linalg.norm(ranks, axis=1, keepdims=True)
    _, chain = connected_components(np.abs(ranks @ ranks.T) > CHANCE / math.sqrt(n))
    return np.asarray(chain[:, None] == chain)
