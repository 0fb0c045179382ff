"""Whose deviations a response's scatter is owed to, from the run at hand.

No further trials: the rank regression sees what is monotonous, the first-order Sobol'
index any main effect; what both leave is interaction, or chance.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import rankdata

from tolstat.statistics.estimate import Estimate

Array = NDArray[np.float64]

LEAST = 200  # trials from which the indices are given
PARTS = 20  # of the trials, for the jackknife


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
        The same, summed over contributors whose names differ in their number alone.
    unexplained : Estimate
        What no contributor explains alone: interaction, correlation or chance.
    """

    rank_regression: dict[str, Estimate]
    explained: Estimate
    first_order: dict[str, Estimate]
    groups: dict[str, Estimate]
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
        trials at a time.

    References
    ----------
    S. Chatterjee, A new coefficient of correlation, J. Am. Statist. Assoc. 116 (2021);
    F. Gamboa, P. Gremaud, T. Klein, A. Lagnoux, Global sensitivity analysis: a novel
    generation of mighty estimators based on rank statistics, Bernoulli 28 (2022), (7).
    """
    names = list(deviations)
    together = {name: list(members) for name, members in (groups or {}).items()}
    X = np.column_stack(list(deviations.values()))
    ranks = rankdata(X, axis=0)
    orders = [np.argsort(column, kind="stable") for column in X.T]
    # which contributors each group sums: groups[group, contributor]
    sums = np.array([[n in members for n in names] for members in together.values()])
    sums = sums.reshape(len(together), len(names)).astype(float)
    z = float(ndtri(0.5 + confidence / 2))
    found = {}
    for response, y in responses.items():
        n = len(y)
        if n < LEAST or np.ptp(y) == 0:
            reason = f"no trustworthy interval at {n} trials"
            if n and np.ptp(y) == 0:
                reason = "the response does not spread"
            none = Estimate(math.nan, reason=reason)
            every, of_groups = dict.fromkeys(names, none), dict.fromkeys(together, none)
            found[response] = Contributions(every, none, every, of_groups, none)
            continue
        regression = _estimates(*_rank_regressions(ranks, rankdata(y)), z)
        whole, left_out = _first_orders(orders, y)
        first = _estimates(whole, left_out, z)
        joined = _estimates(sums @ whole, left_out @ sums.T, z)
        rest = _estimates(
            1 - whole.sum(keepdims=True), 1 - left_out.sum(axis=1, keepdims=True), z
        )
        found[response] = Contributions(
            dict(zip(names, regression[:-1], strict=True)),
            regression[-1],
            dict(zip(names, first, strict=True)),
            dict(zip(together, joined, strict=True)),
            rest[0],
        )
    return found


def _rank_regressions(ranks: Array, of_response: Array) -> tuple[Array, Array]:
    """Regress ranks on ranks: standardised coefficients and the share explained.

    Parameters
    ----------
    ranks : float64[n, contributor]
        Ranks of the deviations.
    of_response : float64[n]
        Ranks of the response.

    Returns
    -------
    tuple of float64[contributor + 1], float64[part, contributor + 1]
        Of all trials, and with one part of them left out.
    """
    R = np.column_stack([ranks, of_response])
    R = R - R.mean(axis=0)
    scale = R.std(axis=0)
    R /= np.where(scale > 0, scale, 1.0)
    parts = [R[p::PARTS].T @ R[p::PARTS] for p in range(PARTS)]
    whole: Array = np.sum(parts, axis=0)

    def solved(G: Array) -> Array:
        coefficients, *_ = np.linalg.lstsq(G[:-1, :-1], G[:-1, -1], rcond=None)
        return np.append(coefficients, coefficients @ G[:-1, -1] / G[-1, -1])

    return solved(whole), np.array([solved(whole - part) for part in parts])


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

    def index(in_order: Array) -> float:
        centred = in_order - in_order.mean()
        return float(np.mean(centred * np.roll(centred, -1)) / np.mean(centred**2))

    whole, left_out = np.empty(len(orders)), np.empty((PARTS, len(orders)))
    for column, order in enumerate(orders):
        in_order, part = y[order], order % PARTS
        whole[column] = index(in_order)
        for p in range(PARTS):
            left_out[p, column] = index(in_order[part != p])
    return whole, left_out


def _estimates(whole: Array, left_out: Array, z: float) -> list[Estimate]:
    """Give each number the interval of the jackknife."""
    scatter = np.mean((left_out - left_out.mean(axis=0)) ** 2, axis=0)
    half = z * np.sqrt((PARTS - 1) * scatter)
    return [
        Estimate(float(v), float(v - h), float(v + h))
        for v, h in zip(whole, half, strict=True)
    ]
