"""Contributors that only together explain the units out of limit."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc, ndtr, ndtri

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.sensitivity.out_of_limit import (
    CLEAR,
    Ranked,
    dependent,
    own_parts,
)

SUM, DIFFERENCE, BOTH_FAR = "sum", "difference", "both outer"
MORE = "several"  # than two
LEAST_EXPLAINED = 0.4  # share of the units out of limit that a pair explains
OUTER_SHARE = 0.05  # outer part of all trials, unless more are out of limit
ONE_WAY = 0.9  # share of the units from which a contributor has one direction
SHIFTED = 3.0  # standard errors of a mean
MOST_NEAR = 0.8  # of the errors: those of pairs with a clear contributor
# The normal product of one more contributor with a combination. It joins at this level,
# corrected for their number, if it is no more than this below the product of the pair.
JOINS, COMPARABLE = 0.005, 3.5
# It may be in the place of a member from here on (1 % of innocent ones), and that near.
RIVAL, NEAR_RIVAL = 2.58, 2.5


class Together(NamedTuple):
    """Contributors that together explain units out of limit better than any alone.

    Attributes
    ----------
    members : tuple of str
        Their names: two, or more.
    how : str
        "difference": one high, the other low; "sum": both high or both low; "both
        outer": each in the outer part, to either side; "several": more than two.
    level : float
        p-value of the clearest two, corrected for the number of pairs.
    far : Estimate
        Share of the units out of limit with the combination in its outer part.
    of_all : float
        Same share of all trials: 5 %, or the share out of limit if larger.
    alone : float
        Share of the units out of limit with one member in its outer part; the largest.
    single : float
        Largest such share of a single contributor.
    """

    members: tuple[str, ...]
    how: str
    level: float
    far: Estimate
    of_all: float
    alone: float
    single: float


def pairs(
    deviations: Mapping[str, Array], out: Mapping[str, Truths]
) -> dict[str, list[Together]]:
    """Return the contributors that only together explain units out of limit.

    Arguments as of `differences`. By response: significant combinations, in the outer
    part in at least 40 % of these units, and as often as any member; the highest share
    first. Correlated contributors are no pair.

    Notes
    -----
    Deviations are compared as normal scores, and so are their distances from the
    median. If a contributor does not matter, its scores stay normal in the units out of
    limit, whatever the others do. Then the sum of its products with those of another,
    over the root of the sum of squares of the other, is normal too. Either takes the
    role of the other, and the weaker result counts: a single contributor makes no pair.
    In a sum to one side, parts are correlated too: its products about the mean have the
    other sign than its products about zero. So the weaker of both counts, and zero if
    their signs differ. Distances count only of contributors without a shift. For each
    pair the smaller level of scores and distances counts, doubled.

    One after the other, those join a pair whose product with the combination of all
    members is significant, and not far below that of the pair. A pair is not named if a
    third contributor that does not join may still be in the place of a member.
    """
    tested = {n: units for n, units in out.items() if 0 < units.sum() < len(units)}
    by_response: dict[str, list[Together]] = {name: [] for name in out}
    if len(deviations) < 2 or not tested:
        return by_response
    linked = dependent(deviations)
    remainders = own_parts(deviations, linked)
    tested_columns = {name: deviations[name] for name in remainders}
    rows = [list(deviations).index(name) for name in remainders]
    free = np.triu(~linked[np.ix_(rows, rows)])
    if not free.any():
        return by_response
    any_limit = np.logical_or.reduce([*tested.values()])
    ranked = _FourRanked(tested_columns, remainders, any_limit)
    for name, units in tested.items():
        by_response[name] = _Scores(ranked, units).pairs(free)
    return by_response


class _FourRanked:
    """Deviations, their distances from the median, and the remainders of both."""

    def __init__(
        self, deviations: Mapping[str, Array], rests: Mapping[str, Array], out: Truths
    ) -> None:
        self.names = list(deviations)
        self._linked = any(rests[n] is not x for n, x in deviations.items())
        self._ranked = [
            Ranked(columns, out)
            for several in ((deviations, rests) if self._linked else (deviations,))
            for columns in (several, _distances(several))
        ]

    def scores(self, out: Truths) -> Sequence[Array]:
        """Return the scores of some units: deviations, distances, and remainders'."""
        scores = [ranked.scores(out) for ranked in self._ranked]
        return scores if self._linked else [*scores, *scores]


def _distances(columns: Mapping[str, Array]) -> dict[str, Array]:
    return {n: np.abs(x - np.median(x)) for n, x in columns.items()}


class _Scores:
    """Scores of the units out of one limit, float64[contributor, unit]."""

    def __init__(self, ranked: _FourRanked, out: Truths) -> None:
        self.names = ranked.names
        self.z, self.far, self.own, self.own_far = ranked.scores(out)
        self.units = self.z.shape[1]
        self.of_all = min(max(OUTER_SHARE, float(out.mean())), 0.5)
        self.two_ends, self.one_end = -ndtri(self.of_all / 2), -ndtri(self.of_all)
        self.alone = self._alone()

    def pairs(self, free: Truths) -> list[Together]:
        """Return the significant combinations; `free` tells which may be a pair.

        bool[i, j], only above the diagonal.
        """
        mean, error = self.z.mean(axis=1), self.z.std(axis=1) / math.sqrt(self.units)
        of_scores = _products(self.own, self.z, self.z - mean[:, None])
        of_distances = _products(self.own_far, self.far)
        still = np.abs(mean) < SHIFTED * error
        clear = chdtrc(self.units, np.sum(self.z**2, axis=1)) < CLEAR / len(free)
        has_clear = clear[:, None] | clear
        count, clear_pairs = int(free.sum()), int((has_clear & free).sum())
        most = MOST_NEAR if clear_pairs else 0.0
        least_weight, more = (1 - most) / count, most / max(clear_pairs, 1)
        # most pairs have no level below this one: the first of their products tells
        least = -0.999 * ndtri(CLEAR / 4 * (least_weight + more))
        may_be = (np.abs(of_scores[0]) > least) | (of_distances[0] > least)
        i, j = np.nonzero(may_be & free)
        weight = least_weight + more * has_clear[i, j]
        signed = _weaker(of_scores, i, j)
        of_far = _weaker(of_distances, i, j) * still[i] * still[j]
        # doubled for both ways, and for the contributors tested alone
        levels = 4 * np.array([2 * ndtr(-np.abs(signed)), ndtr(-of_far)]) / weight
        linked: dict[tuple[int, ...], Together] = {}
        for w, k in np.argwhere(levels < CLEAR).tolist():
            pair = int(i[k]), int(j[k])
            how = BOTH_FAR if w else SUM if signed[k] > 0 else DIFFERENCE
            new = self._together(pair, float(levels[w, k]), how)
            linked[pair] = max(
                linked.get(pair, new), new, key=lambda e: (_explains(e), -e.level)
            )
        named: list[Together] = []
        while linked:
            first = max(linked, key=lambda p: (linked[p].far.value, -linked[p].level))
            best = linked[first]
            members, doubtful = self._all_of(first, best.how)
            for combination in [p for p in linked if {*p} <= {*members}]:
                del linked[combination]
            new = self._together(members, best.level, best.how)
            if not doubtful and _explains(new) and not any(
                len({*new.members} & {*e.members}) > 1 for e in named
            ):  # fmt: skip
                named.append(new)
        return sorted(named, key=lambda e: (-e.far.value, e.level))

    def _all_of(self, pair: tuple[int, ...], how: str) -> tuple[tuple[int, ...], bool]:
        """Return a pair with those that join it, and whether a third may be of it."""
        both = how == BOTH_FAR
        z, remainders = (self.far, self.own_far) if both else (self.z, self.own)
        of_pair = abs(float(_weaker(_products(remainders[[*pair]], z[[*pair]]), 0, 1)))
        members, count = [*pair], len(z)
        while len(members) < count:
            s = self._combined(members, how)
            product = remainders @ s / np.linalg.norm(s)
            product = product if both else np.abs(product)
            product[members] = -math.inf
            most = float(product.max())
            level = (1 if both else 2) * float(ndtr(-most)) * (count - len(members))
            if level >= JOINS or most < of_pair - COMPARABLE:
                doubtful = most > max(RIVAL, of_pair - NEAR_RIVAL)
                return tuple(sorted(members)), doubtful and len(members) == 2
            members.append(int(product.argmax()))
        return tuple(sorted(members)), False

    def _combined(self, members: Sequence[int], how: str) -> Array:
        """Return the combination of members in which these units are farthest off."""
        if how == BOTH_FAR:
            return np.asarray(self.far[members].sum(axis=0) / math.sqrt(len(members)))
        z = self.z[members]
        return np.asarray(np.linalg.eigh(z @ z.T)[1][:, -1] @ z)

    def _together(self, members: tuple[int, ...], level: float, how: str) -> Together:
        """Return a combination with the share of the units that it explains."""
        s = self._combined([*members], how)
        outer = s > self.one_end if how == BOTH_FAR else np.abs(s) > self.two_ends
        return Together(
            tuple(self.names[k] for k in members),
            MORE if len(members) > 2 and how != BOTH_FAR else how, level,
            proportion(int(outer.sum()), self.units), self.of_all,
            max(self.alone[k] for k in members), max(self.alone),
        )  # fmt: skip

    def _alone(self) -> list[float]:
        """Return the share of units in which a contributor is in its outer part."""
        z, high = self.z, np.mean(self.z > 0, axis=1, keepdims=True)
        way = (high >= ONE_WAY).astype(int) - (high <= 1 - ONE_WAY)
        outer = np.where(way, way * z > self.one_end, np.abs(z) > self.two_ends)
        return list(np.mean(outer, axis=1).tolist())


def _explains(combination: Together) -> bool:
    return combination.far.value >= max(combination.alone, LEAST_EXPLAINED)


def _products(tested: Array, *references: Array) -> list[Array]:
    """Return float64[i, j]: normal products of two rows, by reference."""
    units = (z / np.linalg.norm(z, axis=1, keepdims=True) for z in references)
    return [tested @ unit.T for unit in units]


def _weaker(products: Sequence[Array], i: Integers | int, j: Integers | int) -> Array:
    """Return the weakest products of some pairs of rows, either row known.

    Zero if the signs of the products differ.
    """
    both = [product[ends] for product in products for ends in ((i, j), (j, i))]
    least, most = np.min(both, axis=0), np.max(both, axis=0)
    return np.asarray(np.fmax(least, 0.0) + np.fmin(most, 0.0))
