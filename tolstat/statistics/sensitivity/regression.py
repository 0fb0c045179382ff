"""Linear regression of responses and of ranks, of all trials and without each part."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Integers
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.as_sampled import PARTS, jackknifed, skewness

NEARLY_ALL = 0.99  # explained share of the variance of a linear response
MOST_TAILED = 0.3  # skewness of its squares over the root of the trials
EXACT = 300_000  # trials, up to which sums of products of ranks are exact
MANY = 100  # contributors, from which all responses are solved together


class Regressed:
    """Linear regression of responses, none constant, on independent deviations.

    `explained` is the share of the variance of each response that it explains.
    """

    def __init__(
        self, deviations: Sequence[Array], responses: Mapping[str, Array]
    ) -> None:
        k = len(deviations)
        columns = [
            (x, x.mean(), x.std() or 1.0) for x in (*deviations, *responses.values())
        ]
        parts = np.empty((PARTS, len(columns) + 1, len(columns) + 1))
        for p in range(PARTS):  # one after the other: they may be large
            scored = [(x[p::PARTS] - mean) / sigma for x, mean, sigma in columns]
            table = np.array([*scored, np.ones(len(scored[0]))])
            parts[p] = table @ np.ascontiguousarray(table.T)
        all_parts = parts.sum(axis=0)
        # of all trials, then with one part of them left out
        sums = np.concatenate([all_parts[None], all_parts - parts])
        sizes, means = sums[:, -1, -1, None, None], sums[:, -1, :-1]
        cov = sums[:, :-1, :-1] / sizes - means[:, :, None] * means[:, None] / sizes**2
        by_part = [_shares_of(c[:k, :k], c[:k, k:], np.diag(c)[k:]) for c in cov]
        self._shares = dict(zip(responses, np.stack(by_part, axis=1), strict=True))
        self.explained = {
            name: jackknifed(shares.sum(axis=1, keepdims=True))[0]
            for name, shares in self._shares.items()
        }
        self.tails = {n: skewness((y - y.mean()) ** 2) for n, y in responses.items()}

    def linear(self, response: str) -> bool:
        """Return whether the regression explains nearly all of a response.

        Not if few trials have a large part in its variance: shares are noise then.
        """
        light = self.tails[response] <= MOST_TAILED
        return light and self.explained[response].lower >= NEARLY_ALL

    def shares(self, response: str, sums: Array) -> list[Estimate]:
        """Estimate sums of contributions: float64[sum, contributor], 0 or 1.

        Upper ends include the remainder, which may be any contributor's.
        """
        rest = max(1 - self.explained[response].lower, 0.0)
        return [
            estimate._replace(
                lower=max(estimate.lower, 0.0), upper=min(estimate.upper + rest, 1.0)
            )
            for estimate in jackknifed(self._shares[response] @ sums.T)
        ]

    def unexplained(self, response: str) -> Estimate:
        """Estimate the share of interactions: at most the remainder."""
        remainder = 1 - self._shares[response].sum(axis=1, keepdims=True)
        remainder = np.maximum(remainder.round(12), 0.0)  # without rounding errors
        return jackknifed(remainder)[0]._replace(lower=0.0)


def _shares_of(among: Array, with_y: Array, variances: Array) -> Array:
    """Split explained variances by coefficients and sigmas: [response, contributor].

    Not by covariances: chance correlations of independent deviations would add noise.
    `with_y` is [contributor, response].
    """
    shares = []
    for slopes, with_one, variance in zip(
        _slopes(among, with_y), with_y.T, variances, strict=True
    ):
        alone = slopes**2 * np.diag(among)
        explained = slopes @ with_one / variance
        shares.append(alone * (explained / max(alone.sum(), 1e-300)))
    return np.array(shares)


def _slopes(among: Array, with_y: Array) -> Array:
    """Return the least squares solutions of least norm: [response, contributor].

    Of many contributors all responses are solved together, by an orthogonal
    decomposition: one by one, singular values would take hours. The last digits depend
    on how it is done.
    """
    if len(among) < MANY:
        return np.array([np.linalg.lstsq(among, y, rcond=None)[0] for y in with_y.T])
    from scipy.linalg import lstsq  # slow to import

    cond = len(among) * np.finfo(float).eps
    slopes, *_ = lstsq(among, with_y, cond=cond, lapack_driver="gelsy")
    return np.asarray(slopes.T)


def ascending(x: Array) -> Integers:
    """Return the order of float64[n], int32[n]; equal values keep their order."""
    order = np.argsort(x)
    ordered = x[order]
    # sorting stably takes four times as long, and only ties need it
    if np.any(ordered[1:] == ordered[:-1]):
        order = np.argsort(x, kind="stable")
    return order.astype(np.int32)


def rank_regressions(
    deviations: Sequence[Array], orders: Sequence[Integers], responses: Sequence[Array]
) -> list[Array]:
    """Regress ranks on ranks: standardised coefficients and the share explained.

    `orders` holds the trials in ascending order of each deviation. Returns for each
    response float64[1 + part, contributor + 1]: of all trials, then without each part.
    The other parts are ranked again: ranks of all trials would
    hide their scatter.
    """
    k = len(deviations)
    columns = [_Column(x, order) for x, order in zip(deviations, orders, strict=True)]
    columns += [_Column(y, ascending(y)) for y in responses]
    regressions = np.empty((PARTS + 1, len(responses), k + 1))
    ranks = np.empty((len(columns), len(orders[0])), np.int32)
    for part in range(-1, PARTS):  # the first one leaves out none
        for row, column in zip(ranks, columns, strict=True):
            row[:] = column.centred_ranks(part)
        if part >= 0:
            ranks[:, part::PARTS] = 0
        products = _products(ranks)
        scale = np.sqrt(np.diag(products))
        scale[scale == 0] = 1.0  # of columns that are equal in all trials
        correlations = products / np.outer(scale, scale)
        with_y = correlations[:k, k:]
        for i, coefficients in enumerate(_slopes(correlations[:k, :k], with_y)):
            explained = coefficients @ with_y[:, i]
            regressions[part + 1, i] = np.append(coefficients, explained)
    return list(regressions.swapaxes(0, 1))


def _products(ranks: NDArray[np.int32]) -> Array:
    """Return the sums of products: of whole numbers, exact up to `EXACT` trials."""
    products = np.zeros((len(ranks), len(ranks)))
    for start in range(0, ranks.shape[1], EXACT):
        rows = ranks[:, start : start + EXACT].astype(float)
        products += rows @ rows.T
    return products


class _Column:
    """Numbers in known order, to be ranked many times."""

    def __init__(self, x: Array, order: Integers) -> None:
        ordered = x[order]
        first = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))
        # of runs of equal values, and the run that each trial belongs to
        self.bounds = np.append(first, len(x)).astype(np.int32)
        self.run = np.empty(len(x), np.int32)
        numbers = np.arange(len(first), dtype=np.int32)
        self.run[order] = np.repeat(numbers, np.diff(self.bounds))
        self.part = (order % PARTS).astype(np.uint8)

    def centred_ranks(self, omitted: int) -> NDArray[np.int32]:
        """Rank the trials without one part (`PARTS`: none): twice the rank, mean 0.

        The part itself is ranked too.
        """
        counted = np.zeros(len(self.part) + 1, dtype=np.int32)
        np.cumsum(self.part != omitted, out=counted[1:])
        below = counted[self.bounds]
        # equal values share their mean rank
        ranks: NDArray[np.int32] = (below[:-1] + below[1:] - counted[-1])[self.run]
        return ranks
