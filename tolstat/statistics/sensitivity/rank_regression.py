"""Linear regression of ranks on ranks, also without each part of the trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.intervals.jackknife import PARTS

Array = NDArray[np.float64]


def ascending(x: Array) -> NDArray[np.int64]:
    """Return the order of float64[n]; equal values keep theirs."""
    order = np.argsort(x)
    ordered = x[order]
    # sorting stably takes four times as long, and only ties need it
    if np.any(ordered[1:] == ordered[:-1]):
        order = np.argsort(x, kind="stable")
    return order


def rank_regressions(
    deviations: Sequence[Array],
    orders: Sequence[NDArray[np.int64]],
    responses: Sequence[Array],
) -> list[tuple[Array, Array]]:
    """Regress ranks on ranks: standardised coefficients and the share explained.

    `orders` holds the trials in ascending order of each deviation. Returns for each
    response float64[contributor + 1] of all trials, and float64[part, contributor + 1]
    with one part left out. The rest is ranked again: ranks of the whole would hide
    their own scatter.
    """
    k = len(deviations)
    columns = [_Column(x, order) for x, order in zip(deviations, orders, strict=True)]
    columns += [_Column(y, ascending(y)) for y in responses]
    found = np.empty((PARTS + 1, len(responses), k + 1))
    ranks = np.empty((len(columns), len(orders[0])))
    for left_out in range(PARTS + 1):  # the last time none
        for row, column in zip(ranks, columns, strict=True):
            row[:] = column.centred_ranks(left_out)
        if left_out < PARTS:
            ranks[:, left_out::PARTS] = 0.0
        # of whole numbers: these sums are exact up to 300 000 trials
        products = ranks @ ranks.T
        scale = np.sqrt(np.diag(products))
        scale[scale == 0] = 1.0  # of what is equal in all trials
        correlations = products / np.outer(scale, scale)
        for i in range(len(responses)):
            g = correlations[:k, k + i]
            coefficients, *_ = np.linalg.lstsq(correlations[:k, :k], g, rcond=None)
            found[left_out, i] = np.append(coefficients, coefficients @ g)
    return [(found[-1, i], found[:-1, i]) for i in range(len(responses))]


class _Column:
    """Numbers in known order, to be ranked many times."""

    def __init__(self, x: Array, order: NDArray[np.int64]) -> None:
        ordered = x[order]
        first = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))
        self.bounds = np.append(first, len(x))  # of runs of equal values
        self.run = np.empty(len(x), dtype=np.int64)  # that each trial belongs to
        self.run[order] = np.repeat(np.arange(len(first)), np.diff(self.bounds))
        self.part = (order % PARTS).astype(np.uint8)

    def centred_ranks(self, left_out: int) -> NDArray[np.int32]:
        """Rank the trials without one part (`PARTS`: none): twice the rank, mean 0.

        The part itself is ranked too.
        """
        kept = np.zeros(len(self.part) + 1, dtype=np.int32)
        np.cumsum(self.part != left_out, out=kept[1:])
        below = kept[self.bounds]
        # equal values share their mean rank
        ranks: NDArray[np.int32] = (below[:-1] + below[1:] - kept[-1])[self.run]
        return ranks
