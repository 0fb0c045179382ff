"""Variance contributions to a linear response, by regression."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.jackknife import PARTS, jackknifed

Array = NDArray[np.float64]

NEARLY_ALL = 0.99  # explained share of the variance of a linear response


class Regressed:
    """Linear regression of responses, none constant, on independent deviations.

    `explained` is the share of the variance of each response that it explains.
    """

    def __init__(
        self,
        deviations: Sequence[Array],
        responses: Mapping[str, Array],
        confidence: float,
    ) -> None:
        self.confidence = confidence
        k, n = len(deviations), len(deviations[0])
        columns = [*deviations, *responses.values()]
        scored = [(x - x.mean()) / (x.std() or 1.0) for x in columns]
        table = np.array([*scored, np.ones(n)])
        parts = np.array(
            [table[:, p::PARTS] @ table[:, p::PARTS].T for p in range(PARTS)]
        )
        whole = parts.sum(axis=0)
        # of all trials, then with one part of them left out
        sums = np.concatenate([whole[None], whole - parts])
        sizes, means = sums[:, -1, -1, None, None], sums[:, -1, :-1]
        cov = sums[:, :-1, :-1] / sizes - means[:, :, None] * means[:, None] / sizes**2
        self._shares: dict[str, Array] = {}
        self.explained: dict[str, Estimate] = {}
        for row, name in enumerate(responses, start=k):
            shares = np.array([_shares_of(each[:k, :k], each[:k, row], each[row, row])
                               for each in cov])  # fmt: skip
            self._shares[name] = shares
            r = shares.sum(axis=1, keepdims=True)
            self.explained[name] = jackknifed(r[0], r[1:], confidence)[0]

    def linear(self, response: str) -> bool:
        """Tell whether the regression explains nearly all of a response."""
        return self.explained[response].lower >= NEARLY_ALL

    def shares(self, response: str, sums: Array, *, trusted: bool) -> list[Estimate]:
        """Estimate sums of contributions: float64[sum, contributor], 0 or 1.

        Any contributor may have the remainder: upper ends are higher by it.
        """
        every = self._shares[response] @ sums.T
        rest = max(1 - self.explained[response].lower, 0.0)
        return [
            each._replace(lower=max(each.lower, 0.0), upper=min(each.upper + rest, 1.0))
            if each.sure
            else each
            for each in jackknifed(
                every[0], every[1:], self.confidence, trusted=trusted
            )
        ]

    def unexplained(self, response: str, *, trusted: bool) -> Estimate:
        """Estimate the share of interactions: at most the remainder."""
        left = 1 - self._shares[response].sum(axis=1, keepdims=True)
        left = np.maximum(left.round(12), 0.0)  # without rounding errors
        found = jackknifed(left[0], left[1:], self.confidence, trusted=trusted)[0]
        return found._replace(lower=0.0) if found.sure else found


def _shares_of(among: Array, with_y: Array, variance: float) -> Array:
    """Split the explained variance by coefficients and sigmas.

    Not by covariances: chance correlations of independent deviations would add noise.
    """
    slopes, *_ = np.linalg.lstsq(among, with_y, rcond=None)
    alone = slopes**2 * np.diag(among)
    explained = slopes @ with_y / variance
    return np.asarray(alone * (explained / max(alone.sum(), 1e-300)))
