"""Variance contributions of deviations to a response, from the trials of a run.

They need no additional trials. The rank regression shows monotonic effects, the
first-order Sobol' index any main effect; the remainder is interaction or chance. If a
linear regression explains nearly all, the indices come from it: intervals are narrower.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.jackknife import jackknifed, tails_are_light
from tolstat.statistics.sensitivity.neighbours import Row, first_orders, joint, nearest
from tolstat.statistics.sensitivity.regression import (
    Regressed,
    ascending,
    rank_regressions,
)

LEAST = 200  # trials from which the indices are given
LARGEST_GROUP = 4  # contributors; in larger groups neighbours are too far apart
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
        Share of the variance due to each contributor alone.
    groups : dict of str to Estimate
        The same, summed over the contributors of a group.
    together : dict of str to Estimate
        Share due to all of a group, interactions included. Its interval reaches to 1,
        because neighbours in several dimensions understate it; none for groups of more
        than four.
    unexplained : Estimate
        Remainder: interaction, correlation or chance.
    linear : bool
        Whether the shares come from a linear regression that explains nearly all;
        otherwise from neighbours.
    dominated_by_few : bool
        Whether few trials dominate the variance. Its shares are noise then, except the
        lower end of the share of a group together.
    """

    rank_regression: dict[str, Estimate]
    explained: Estimate
    first_order: dict[str, Estimate]
    groups: dict[str, Estimate]
    together: dict[str, Estimate]
    unexplained: Estimate
    linear: bool = False
    dominated_by_few: bool = False


def contributions(
    deviations: Mapping[str, Array],
    responses: Mapping[str, Array],
    groups: Mapping[str, Sequence[str]] | None = None,
    *,
    independent: bool = True,
) -> dict[str, Contributions]:
    """Estimate the contributions to responses.

    Parameters
    ----------
    deviations : mapping of str to float64[n]
        By contributor that deviates.
    responses : mapping of str to float64[n]
        None NaN.
    groups : mapping of str to names, optional
        Contributors of each group.
    independent : bool
        Whether the deviations are independent of each other: only then the indices of
        a linear response come from its regression.

    Returns
    -------
    dict of str to Contributions
        By response, with intervals from a jackknife that leaves out a twentieth of the
        trials at a time. If few trials dominate the variance, only shares of groups
        together have intervals: these shares are understated in any case.

    References
    ----------
    S. Chatterjee, A new coefficient of correlation, J. Am. Statist. Assoc. 116 (2021);
    F. Gamboa, P. Gremaud, T. Klein, A. Lagnoux, Global sensitivity analysis: a novel
    generation of mighty estimators based on rank statistics, Bernoulli 28 (2022), (7),
    with J. von Neumann's mean square successive difference (Ann. Math. Stat. 12 (1941)
    367-395) instead of a cyclic product;
    B. Broto, F. Bachoc, M. Depecker, Variance reduction for estimation of Shapley
    effects and adaptation to unknown input distribution, SIAM/ASA J. Uncertainty
    Quantification 8 (2020), 5.1: nearest neighbours.
    """
    names, groups = list(deviations), groups or {}
    few = [g for g, members in groups.items() if len(members) <= LARGEST_GROUP]
    spreading = {
        name: y for name, y in responses.items() if len(y) >= LEAST and np.ptp(y) > 0
    }
    if not spreading:
        return {name: _nothing(names, groups, y) for name, y in responses.items()}
    columns = list(deviations.values())
    orders = [ascending(column) for column in columns]
    rows = [Row(order) for order in orders]
    # on two threads: NumPy and the neighbour search release the GIL
    with ThreadPoolExecutor(1) as other:
        near = other.map(
            nearest, [np.column_stack([deviations[n] for n in groups[g]]) for g in few]
        )
        alone = other.map(partial(first_orders, rows), spreading.values())
        ranks = rank_regressions(columns, orders, list(spreading.values()))
    neighbours = list(near)
    computed = dict(zip(spreading, zip(ranks, alone, strict=True), strict=True))
    # contributors of each group: float64[group, contributor]
    sums = np.array([[n in members for n in names] for members in groups.values()])
    sums = sums.reshape(len(groups), len(names)).astype(float)
    straight = Regressed(columns, spreading) if independent else None
    found = {}
    for response, y in responses.items():
        if response not in spreading:
            found[response] = _nothing(names, groups, y)
            continue
        regression, (whole, left_out) = computed[response]
        *coefficients, explained = jackknifed(*regression)
        light = tails_are_light(y)
        shares = partial(jackknifed, trusted=light)
        linear = straight is not None and straight.linear(response)
        if straight and linear:
            every = partial(straight.shares, response, trusted=light)
            first, summed = every(np.eye(len(names))), every(sums)
            together = dict(zip(groups, summed, strict=True))
            rest = straight.unexplained(response, trusted=light)
        else:
            first = shares(whole, left_out)
            summed = shares(sums @ whole, left_out @ sums.T)
            joined = jackknifed(*joint(neighbours, y))
            known = dict(zip(few, joined, strict=True))
            together = {group: _together(known.get(group)) for group in groups}
            (rest,) = shares(
                1 - whole.sum(keepdims=True), 1 - left_out.sum(axis=1, keepdims=True)
            )
        found[response] = Contributions(
            dict(zip(names, coefficients, strict=True)),
            explained,
            dict(zip(names, first, strict=True)),
            dict(zip(groups, summed, strict=True)),
            together,
            rest,
            linear,
            not light,
        )
    return found


def _together(joined: Estimate | None) -> Estimate:
    """Extend the interval of a group's share to 1: the share is understated."""
    if joined is None:
        return Estimate(math.nan, reason=MANY)
    return joined._replace(upper=1.0) if joined.sure else joined


def _nothing(
    names: Sequence[str], groups: Mapping[str, Sequence[str]], y: Array
) -> Contributions:
    """Return contributions without values, with the reason."""
    reason = f"no trustworthy interval at {len(y)} trials"
    if len(y) and np.ptp(y) == 0:
        reason = "the response does not spread"
    none = Estimate(math.nan, reason=reason)
    every, of_groups = dict.fromkeys(names, none), dict.fromkeys(groups, none)
    return Contributions(every, none, every, of_groups, of_groups, none)
