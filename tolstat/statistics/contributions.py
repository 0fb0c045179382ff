"""Whose deviations a response's scatter is owed to, from the run at hand.

No further trials: the rank regression sees what is monotonous, the first-order Sobol'
index any main effect; what both leave is interaction, or chance.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.jackknife import PARTS, jackknifed
from tolstat.statistics.moments import moments, tails_are_light

Array = NDArray[np.float64]

LEAST = 200  # trials from which the indices are given
MOST_TOGETHER = 4  # contributors of a group whose neighbours still say something
MANY = 'needs a run with sampling = "saltelli": too many for neighbours'


class Contributions(NamedTuple):
    """Contributions of one response.

    Attributes
    ----------
    rank_regression : dict of str to Estimate
        Standardised coefficients of a linear regression of ranks: sign and strength.
    explained : Estimate
        Share of the variance of the ranks that this regression explains.
    first_order : dict of str to Estimate
        Share of the variance owed to each contributor alone.
    groups : dict of str to Estimate
        The same, summed over the contributors of a group.
    together : dict of str to Estimate
        Share owed to all of a group together, with what they do to each other; its
        interval reaches to 1, because neighbours in several dimensions understate it;
        none for groups of more than four.
    unexplained : Estimate
        What no contributor explains alone: interaction, correlation or chance.
    """

    rank_regression: dict[str, Estimate]
    explained: Estimate
    first_order: dict[str, Estimate]
    groups: dict[str, Estimate]
    together: dict[str, Estimate]
    unexplained: Estimate


def contributions(
    deviations: Mapping[str, Array],
    responses: Mapping[str, Array],
    groups: Mapping[str, Sequence[str]] | None = None,
    confidence: float = 0.95,
) -> dict[str, Contributions]:
    """Estimate the contributions to responses.

    Parameters
    ----------
    deviations : mapping of str to float64[n]
        By contributor; those that deviate.
    responses : mapping of str to float64[n]
        None NaN.
    groups : mapping of str to names, optional
        Contributors to be taken together.
    confidence : float
        Of the intervals.

    Returns
    -------
    dict of str to Contributions
        By response, with intervals from a jackknife that leaves out a twentieth of the
        trials at a time; shares of a variance that a few trials decide have none.

    References
    ----------
    S. Chatterjee, A new coefficient of correlation, J. Am. Statist. Assoc. 116 (2021);
    F. Gamboa, P. Gremaud, T. Klein, A. Lagnoux, Global sensitivity analysis: a novel
    generation of mighty estimators based on rank statistics, Bernoulli 28 (2022), (7);
    B. Broto, F. Bachoc, M. Depecker, Variance reduction for estimation of Shapley
    effects and adaptation to unknown input distribution, SIAM/ASA J. Uncertainty
    Quantification 8 (2020), 5.1: nearest neighbours.
    """
    names = list(deviations)
    together = {name: list(members) for name, members in (groups or {}).items()}
    X = np.column_stack(list(deviations.values()))
    orders = [np.argsort(column, kind="stable") for column in X.T]
    # which contributors each group sums: groups[group, contributor]
    sums = np.array([[n in members for n in names] for members in together.values()])
    sums = sums.reshape(len(together), len(names)).astype(float)
    few = {
        g: members for g, members in together.items() if len(members) <= MOST_TOGETHER
    }
    neighbours = [
        _neighbours(X[:, [names.index(name) for name in members]])
        for members in few.values()
    ]
    spreading = {
        name: y for name, y in responses.items() if len(y) >= LEAST and np.ptp(y) > 0
    }
    regressions = dict(
        zip(
            spreading,
            _rank_regressions(X, orders, list(spreading.values())) if spreading else (),
            strict=True,
        )
    )
    found = {}
    for response, y in responses.items():
        n = len(y)
        if response not in spreading:
            reason = f"no trustworthy interval at {n} trials"
            if n and np.ptp(y) == 0:
                reason = "the response does not spread"
            none = Estimate(math.nan, reason=reason)
            every, of_groups = dict.fromkeys(names, none), dict.fromkeys(together, none)
            found[response] = Contributions(
                every, none, every, of_groups, of_groups, none
            )
            continue
        regression = jackknifed(*regressions[response], confidence)
        whole, left_out = _first_orders(orders, y)
        light = tails_are_light(moments(y))
        shares = partial(jackknifed, confidence=confidence, trusted=light)
        first = shares(whole, left_out)
        summed = shares(sums @ whole, left_out @ sums.T)
        joined = shares(*_joint(neighbours, y))
        rest = shares(
            1 - whole.sum(keepdims=True), 1 - left_out.sum(axis=1, keepdims=True)
        )
        found[response] = Contributions(
            dict(zip(names, regression[:-1], strict=True)),
            regression[-1],
            dict(zip(names, first, strict=True)),
            dict(zip(together, summed, strict=True)),
            {
                **dict.fromkeys(together, Estimate(math.nan, reason=MANY)),
                **{
                    group: each._replace(upper=1.0) if each.sure else each
                    for group, each in zip(few, joined, strict=True)
                },
            },
            rest[0],
        )
    return found


def _rank_regressions(
    X: Array, orders: Sequence[NDArray[np.int64]], responses: Sequence[Array]
) -> list[tuple[Array, Array]]:
    """Regress ranks on ranks: standardised coefficients and the share explained.

    Parameters
    ----------
    X : float64[n, contributor]
        Deviations.
    orders : sequence of int64[n]
        The trials in ascending order of each of them.
    responses : sequence of float64[n]
        Each regressed by itself.

    Returns
    -------
    list of (float64[contributor + 1], float64[part, contributor + 1])
        For each response: of all trials, and with one part of them left out. What is
        left is ranked anew: ranks of the whole would hide their own scatter.
    """
    n = len(X)
    part = np.arange(n) % PARTS
    columns = [_Column(x, order) for x, order in zip(X.T, orders, strict=True)]
    sought = [_Column(y, np.argsort(y, kind="stable")) for y in responses]
    found = np.empty((PARTS + 1, len(responses), X.shape[1] + 1))
    for left_out in range(PARTS + 1):
        kept = part != left_out  # the last time round all of them
        R = _standardised(np.column_stack([column.ranks(kept) for column in columns]))
        G = R.T @ R
        for i, column in enumerate(sought):
            g = R.T @ _standardised(column.ranks(kept))
            coefficients, *_ = np.linalg.lstsq(G, g, rcond=None)
            found[left_out, i] = np.append(coefficients, coefficients @ g / len(R))
    return [(found[-1, i], found[:-1, i]) for i in range(len(responses))]


class _Column:
    """Numbers in known order, to be ranked again and again."""

    def __init__(self, x: Array, order: NDArray[np.int64]) -> None:
        self.x, self.order = x, order
        ascending = x[order]
        self.tied = bool(np.any(ascending[1:] == ascending[:-1]))

    def ranks(self, kept: NDArray[np.bool_]) -> Array:
        """Rank those that are kept; what is alike ranks alike."""
        chosen = self.order[kept[self.order]]
        ranks = np.empty(len(self.x))
        if not self.tied:
            ranks[chosen] = np.arange(len(chosen))
            return ranks[kept]
        ascending = self.x[chosen]
        first = np.flatnonzero(np.append(True, ascending[1:] != ascending[:-1]))
        alike = np.diff(np.append(first, len(chosen)))
        ranks[chosen] = np.repeat(first + (alike - 1) / 2, alike)
        return ranks[kept]


def _standardised(ranks: Array) -> Array:
    """Return ranks with mean 0 and sigma 1; of 0 where all are alike."""
    ranks = ranks - ranks.mean(axis=0)
    scale = ranks.std(axis=0)
    return np.asarray(ranks / np.where(scale > 0, scale, 1.0))


def _first_orders(orders: Sequence[NDArray[np.int64]], y: Array) -> tuple[Array, Array]:
    """Estimate first-order Sobol' indices from neighbours in rank.

    The covariance of y with y at the next larger deviation, over the variance.

    Parameters
    ----------
    orders : sequence of int64[n]
        The trials in ascending order of each deviation.
    y : float64[n]
        Response.

    Returns
    -------
    tuple of float64[contributor], float64[part, contributor]
        Of all trials, and with one part of them left out.
    """
    n = len(y)
    centred = y - y.mean()
    part = np.arange(n) % PARTS
    sizes = n - np.bincount(part, minlength=PARTS)
    sums = centred.sum() - np.bincount(part, centred, PARTS)
    squares = np.sum(centred**2) - np.bincount(part, centred**2, PARTS)
    means = sums / sizes
    variances = squares / sizes - means**2
    whole, left_out = np.empty(len(orders)), np.empty((PARTS, len(orders)))
    for column, order in enumerate(orders):
        products, without = _neighbours_in_order(centred[order], part[order])
        whole[column] = products / np.sum(centred**2)
        left_out[:, column] = (without / sizes - means**2) / variances
    return whole, left_out


def _neighbours_in_order(y: Array, part: NDArray[np.int64]) -> tuple[float, Array]:
    """Sum the products of neighbours in a ring, and again without each part.

    Parameters
    ----------
    y : float64[n]
        In order; the last one's neighbour is the first.
    part : int64[n]
        Which part each belongs to.

    Returns
    -------
    tuple of float, float64[part]
        Of all, and where one part is left out and what stood beside it closes up.
    """
    # begin where a run of one part begins, so that no run goes round the end
    turn = int(np.argmax(part != part[-1]))
    y, part = np.roll(y, -turn), np.roll(part, -turn)
    n = len(y)
    products = y * np.roll(y, -1)
    before = np.concatenate([[0.0], np.cumsum(products)])
    first = np.flatnonzero(np.concatenate([[True], part[1:] != part[:-1]]))
    last = np.concatenate([first[1:], [n]]) - 1
    # a run that goes takes its products with it, and its neighbours meet
    gone = before[last + 1] - before[first] + products[first - 1]
    met = y[first - 1] * y[(last + 1) % n]
    changes = np.bincount(part[first], met - gone, PARTS)
    return float(before[-1]), before[-1] + changes


def _neighbours(X: Array) -> NDArray[np.int64]:
    """Return the trial nearest to each, by the ranks of deviations[n, contributor]."""
    tree = cKDTree(np.argsort(np.argsort(X, axis=0), axis=0))
    _, nearest = tree.query(tree.data, k=2)
    own = nearest[:, 0] == np.arange(len(X))
    found: NDArray[np.int64] = np.where(own, nearest[:, 1], nearest[:, 0])
    return found


def _joint(neighbours: Sequence[NDArray[np.int64]], y: Array) -> tuple[Array, Array]:
    """Estimate the share owed to groups: covariance of neighbours over the variance.

    Parameters
    ----------
    neighbours : sequence of int64[n]
        For each group the trial nearest to each trial.
    y : float64[n]
        Response.

    Returns
    -------
    tuple of float64[group], float64[part, group]
        Of all trials, and with one part of them left out.
    """
    centred = y - y.mean()
    products = np.array([centred * centred[near] for near in neighbours])
    products = products.reshape(len(neighbours), len(y))
    squares = centred**2
    parts = np.array([products[:, p::PARTS].sum(axis=1) for p in range(PARTS)])
    of_squares = np.array([squares[p::PARTS].sum() for p in range(PARTS)])
    whole, all_squares = parts.sum(axis=0), of_squares.sum()
    left_out = (whole - parts) / (all_squares - of_squares)[:, None]
    return whole / all_squares, left_out
