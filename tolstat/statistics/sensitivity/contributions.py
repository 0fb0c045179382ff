"""Variance contributions of deviations to a response, from the trials of a run.

They need no additional trials. The rank regression shows monotonic effects, the
first-order Sobol' index any main effect; the remainder is interaction or chance. If a
linear regression explains nearly all, the indices come from it: intervals are narrower.
If few trials may dominate the variance, it is that of the response clipped to the
central 99 % of its trials.
"""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.estimate import Estimate, Lack, NoInterval
from tolstat.statistics.intervals.as_sampled import jackknifed
from tolstat.statistics.point_mass import Clipped, clipped, few_leave_a_point_mass
from tolstat.statistics.sensitivity.regression import (
    Regressed,
    ascending,
    rank_regressions,
)
from tolstat.statistics.sensitivity.sobol_indices import (
    Row,
    first_orders,
    first_orders_left_out,
    joint,
    nearest,
)

LEAST_TRIALS = 200  # trials from which the indices are given
TRIALS_OF_EACH = 2  # contributor, at least: with fewer a regression explains anything
MOST_TRIALS = 1 << 20  # more tell the shares hardly better, and take minutes
LARGEST_GROUP = 4  # contributors; in larger groups neighbours are too far apart


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
    clipped : bool
        Whether all these shares are of the variance of the response clipped to the
        central 99 % of its trials: few trials may dominate the whole variance.
    linear : bool
        Whether the shares come from a linear regression that explains nearly all;
        otherwise from neighbours.
    dominated_by_few : bool
        Whether too few trials leave a value that most share. Shares are noise then,
        except the lower end of the share of a group together.
    trials : int
        So many, the first ones, tell the shares.
    """

    rank_regression: dict[str, Estimate]
    explained: Estimate
    first_order: dict[str, Estimate]
    groups: dict[str, Estimate]
    together: dict[str, Estimate]
    unexplained: Estimate
    clipped: bool = False
    linear: bool = False
    dominated_by_few: bool = False
    trials: int = 0


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
        trials at a time. Upper ends of first orders are higher by what neighbours
        miss: see `first_orders`. If few trials leave a value that most share, only
        shares of groups together have intervals: these are understated in any case.

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
    deviations = {name: x[:MOST_TRIALS] for name, x in deviations.items()}
    responses = {name: y[:MOST_TRIALS] for name, y in responses.items()}
    names, groups = list(deviations), groups or {}
    small = [g for g, members in groups.items() if len(members) <= LARGEST_GROUP]
    large = {name: y for name, y in responses.items() if len(y) >= LEAST_TRIALS}
    spreading = {name: y for name, y in large.items() if np.ptp(y) > 0}
    if not spreading:
        return {name: _nothing(names, groups, y) for name, y in responses.items()}
    columns = list(deviations.values())
    orders = [ascending(column) for column in columns]
    rows = [Row(order) for order in orders]
    # on two threads: NumPy and the neighbour search release the GIL
    central = {name: clipped(y, y) for name, y in spreading.items()}
    with ThreadPoolExecutor(1) as other:
        members = ([deviations[n] for n in groups[g]] for g in small)
        found_near = other.map(nearest, map(np.column_stack, members))
        alone = other.map(partial(_from_neighbours, rows), central.values())
        ranks = dict[str, Array]()
        if enough := len(columns[0]) >= TRIALS_OF_EACH * len(columns):
            regressions = rank_regressions(columns, orders, list(spreading.values()))
            ranks = dict(zip(spreading, regressions, strict=True))
    neighbours = list(found_near)
    from_neighbours = dict(zip(spreading, alone, strict=True))
    reason = NoInterval(Lack.TRIALS, needed=TRIALS_OF_EACH * len(columns))
    unknown = [Estimate(math.nan, reason=reason)] * (len(columns) + 1)
    # contributors of each group: float64[group, contributor]
    sums = np.array([[n in members for n in names] for members in groups.values()])
    sums = sums.reshape(len(groups), len(names)).astype(float)
    single, total = np.eye(len(names)), np.ones((1, len(names)))
    straight = Regressed(columns, spreading) if independent and enough else None
    answers = {}
    for response, y in responses.items():
        if response not in spreading:
            answers[response] = _nothing(names, groups, y)
            continue
        shares = from_neighbours[response]
        *coefficients, explained = (
            jackknifed(ranks[response]) if response in ranks else unknown
        )
        core, is_sparse = central[response], few_leave_a_point_mass(y)
        linear = straight is not None and not is_sparse and straight.linear(response)
        if straight and linear:
            first, summed = (straight.shares(response, x) for x in (single, sums))
            together = dict(zip(groups, summed, strict=True))
            rest = straight.unexplained(response)
        else:
            tables = single, sums, total
            first, summed, (rest,) = (shares.sums(x, is_sparse) for x in tables)
            rest = rest.complement
            joined = joint(neighbours, core.values)
            joined = core.followed(joined, lambda v: joint(neighbours, v)[0])
            joined_shares = dict(zip(small, jackknifed(joined), strict=True))
            together = {group: _together(joined_shares.get(group)) for group in groups}
        answers[response] = Contributions(
            dict(zip(names, coefficients, strict=True)),
            explained,
            dict(zip(names, first, strict=True)),
            dict(zip(groups, summed, strict=True)),
            together,
            rest,
            not (linear or core.light),
            linear,
            is_sparse,
            len(y),
        )
    return answers


class _Near(NamedTuple):
    """First orders from neighbours: see `jackknifed`.

    `missed` is how much smaller they are from trials two places apart.
    """

    table: Array
    missed: Array

    def sums(self, members: Array, is_sparse: bool) -> list[Estimate]:
        """Estimate sums of indices: float64[sum, contributor], 0 or 1."""
        first = self.table[0].copy()  # contiguous: sums do not depend on its strides
        sums = [(members @ first)[None], self.table[1:] @ members.T]
        estimates = jackknifed(np.concatenate(sums), trusted=not is_sparse)
        missed = (members @ self.missed).tolist()
        return [
            estimate._replace(upper=estimate.upper + more)
            for estimate, more in zip(estimates, missed, strict=True)
        ]


def _from_neighbours(rows: Sequence[Row], core: Clipped) -> _Near:
    """Return first orders of a clipped response, from neighbours."""
    estimate, y = partial(first_orders, rows), core.values
    table = core.followed(first_orders_left_out(rows, y), estimate)
    return _Near(table, np.maximum(table[0] - estimate(y, 2), 0.0))


def _together(joined: Estimate | None) -> Estimate:
    """Extend the interval of a group's share to 1: the share is understated."""
    if joined is None:
        return Estimate(math.nan, reason=NoInterval(Lack.SALTELLI))
    return joined._replace(upper=1.0) if joined.sure else joined


def _nothing(
    names: Sequence[str], groups: Mapping[str, Sequence[str]], y: Array
) -> Contributions:
    """Return contributions without values, with the reason."""
    reason = NoInterval(Lack.TRIALS_FOR_SHARES, trials=len(y))
    if len(y) and np.ptp(y) == 0:
        reason = NoInterval(Lack.SPREAD)
    none = Estimate(math.nan, reason=reason)
    alone, of_groups = dict.fromkeys(names, none), dict.fromkeys(groups, none)
    return Contributions(alone, none, alone, of_groups, of_groups, none)
