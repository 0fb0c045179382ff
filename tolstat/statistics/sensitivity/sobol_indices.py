"""Sobol' indices: from the trials nearest to each other, or sampled for them."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.statistics.estimate import Estimate, Lack, NoInterval
from tolstat.statistics.intervals.as_sampled import PARTS, jackknifed
from tolstat.statistics.point_mass import clipped, few_leave_a_point_mass
from tolstat.statistics.sensitivity.group_surface import DIGITS, GroupSurface


class Row:
    """Trials in ascending order of one deviation: int32[n]."""

    def __init__(self, order: Integers) -> None:
        part = (order % PARTS).astype(np.uint8)
        self.order = order
        # runs of one part are left out together
        first = np.flatnonzero(np.append(True, part[1:] != part[:-1]))
        self.first, self.part = first.astype(np.int32), part[first]

    def summed(self, y: Array, distance: int = 1) -> float:
        """Return summed squared differences of trials so many places apart."""
        y = y[self.order]
        steps = y[distance:] - y[:-distance]
        return float(steps @ steps)

    def differences_left_out(self, y: Array) -> Array:
        """Return summed squared differences of neighbours without each part."""
        y = y[self.order]
        # cumulative sum up to each trial
        upto = np.append(0.0, np.cumsum(np.diff(y) ** 2))
        before, after = self.first - 1, np.append(self.first[1:], len(y))
        gone = upto[np.minimum(after, len(y) - 1)] - upto[np.maximum(before, 0)]
        met = np.zeros(len(before))
        met[1:-1] = (y[after[1:-1]] - y[before[1:-1]]) ** 2
        return np.asarray(upto[-1] + np.bincount(self.part, met - gone, PARTS))


def first_orders(rows: Sequence[Row], y: Array, distance: int = 1) -> Array:
    """Estimate first-order Sobol' indices from neighbours in rank: by contributor.

    The variance of y among trials of equal deviation is half the mean square of its
    differences to the next larger one. Where the response changes much from one to the
    next, the indices are too small, and those from trials two places apart smaller.
    """
    square = 2 * np.sum((y - y.mean()) ** 2)
    return np.array([1 - row.summed(y, distance) / square for row in rows])


def first_orders_left_out(rows: Sequence[Row], y: Array) -> Array:
    """Return the same of all trials, then without each part: see `jackknifed`."""
    n = len(y)
    centred = y - y.mean()
    part = np.arange(n) % PARTS
    sizes = n - np.bincount(part, minlength=PARTS)
    sums = centred.sum() - np.bincount(part, centred, PARTS)
    squares = np.sum(centred**2) - np.bincount(part, centred**2, PARTS)
    squares = squares - sums**2 / sizes
    sums = np.array([row.differences_left_out(centred) for row in rows])
    without = 1 - sums.T / (2 * squares)[:, None]
    return np.concatenate([first_orders(rows, y)[None], without])


def nearest(X: Array) -> Integers:
    """Return the trial nearest to each, by the ranks of deviations[n, contributor]."""
    from scipy.spatial import cKDTree  # slow to import

    order = np.argsort(X, axis=0)
    ranks = np.empty_like(order)
    np.put_along_axis(ranks, order, np.arange(len(X))[:, None], axis=0)
    tree = cKDTree(ranks)
    # in the order of the tree, so that its leaves are in the cache: 3 times faster
    places = tree.indices
    _, neighbours = tree.query(tree.data[places], k=2)
    nearest_trial = np.empty(len(X), dtype=np.int64)
    first, second = neighbours.T
    nearest_trial[places] = np.where(first == places, second, first)
    return nearest_trial


def joint(neighbours: Sequence[Integers], y: Array) -> Array:
    """Estimate the share due to groups: covariance of neighbours over the variance.

    `neighbours` holds for each group the trial nearest to each trial. Returns
    float64[1 + part, group]: of all trials, then without each part.
    """
    centred = y - y.mean()
    products = np.array([centred * centred[neighbour] for neighbour in neighbours])
    products = products.reshape(len(neighbours), len(y))
    squares = centred**2
    parts = np.array([products[:, p::PARTS].sum(axis=1) for p in range(PARTS)])
    of_squares = np.array([squares[p::PARTS].sum() for p in range(PARTS)])
    sums, all_squares = parts.sum(axis=0), of_squares.sum()
    without = (sums - parts) / (all_squares - of_squares)[:, None]
    return np.concatenate([[sums / all_squares], without])


LEAST_GROUPS = 500  # groups from which indices are given


class Indices(NamedTuple):
    """Shares of the variance due to a factor: alone, and with all interactions."""

    first: Estimate
    total: Estimate


def sobol_indices(groups: Array, surface: GroupSurface) -> list[Indices]:
    """Estimate the Sobol' indices of a response, with a jackknife over groups.

    By factor. If few trials may dominate the variance, the response is clipped: see
    `clipped`.

    Parameters
    ----------
    groups : float64[group, 2 + factor]
        The response of trials A and B, and of A with one factor from B; none NaN.
    surface : GroupSurface
        Of the unit samples of these groups.
    """
    n, group = groups.shape
    spreads = n > 0 and np.ptp(groups[:, :2]) > 0
    if n < LEAST_GROUPS or not spreads:
        reason = NoInterval(
            Lack.GROUPS, needed=LEAST_GROUPS, size=group, trials=LEAST_GROUPS * group
        )
        if n and not spreads:
            reason = NoInterval(Lack.SPREAD)
        none = Estimate(math.nan, reason=reason)
        return [Indices(none, none)] * (group - 2)
    random = groups[:, :2]
    core, is_sparse = clipped(groups, random), few_leave_a_point_mass(random.ravel())
    table = core.followed(surface.indices(core.values), lambda y: surface.indices(y)[0])
    first, total = np.split(table, 2, axis=1)
    estimates = (
        [_widened(x) for x in jackknifed(part, trusted=not is_sparse)]
        for part in (first, total)
    )
    return list(map(Indices, *estimates))


def _widened(estimate: Estimate) -> Estimate:
    """Return an index whose interval holds its rounding: nothing else may scatter."""
    last = 10.0**-DIGITS
    return estimate._replace(lower=estimate.lower - last, upper=estimate.upper + last)
