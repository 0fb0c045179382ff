"""Responses with known answers, as hard as they come."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.optimize import brentq


class Problem(NamedTuple):
    """A response: how to draw it (generator, n), distribution function, moments."""

    draw: object
    inverse: object
    cdf: object
    mean: float
    sigma: float

    def quantile(self, share):
        """Least value that a share of the machines stays at or below."""
        high = 1.0
        while self.cdf(high) < share:
            high *= 2
        low = -high
        if self.cdf(0.0) >= share and self.cdf(-1e-12) < share:
            return 0.0
        return brentq(lambda x: self.cdf(x) - share, low, high, xtol=1e-13)


ATOM = 0.7  # share of machines that never jam


def _mixture(rng, n):
    return np.where(rng.random(n) < ATOM, 0.0, rng.exponential(1.0, n))


def _mixture_cdf(x):
    return np.where(x < 0, 0.0, ATOM + (1 - ATOM) * stats.expon.cdf(x))


def _mixture_inverse(u):
    rest = np.maximum((u - ATOM) / (1 - ATOM), 0.0)
    return np.where(u < ATOM, 0.0, stats.expon.ppf(rest))


normal = stats.norm(10.0, 2.0)
lognormal = stats.lognorm(1.0)
skewed = stats.weibull_min(0.5)
PROBLEMS = {
    "normal": Problem(
        lambda rng, n: rng.normal(10.0, 2.0, n), normal.ppf, normal.cdf, 10.0, 2.0
    ),
    "lognormal": Problem(
        lambda rng, n: rng.lognormal(0.0, 1.0, n), lognormal.ppf, lognormal.cdf,
        lognormal.mean(), lognormal.std(),
    ),
    "mixture with an atom": Problem(
        _mixture, _mixture_inverse, _mixture_cdf, 0.3, np.sqrt(0.3 * 2 - 0.09),
    ),
    "strongly skewed": Problem(
        lambda rng, n: rng.weibull(0.5, n), skewed.ppf, skewed.cdf, skewed.mean(),
        skewed.std(),
    ),
}  # fmt: skip
SIZES = (200, 1000, 10_000)
