"""Generalized Pareto distributions fitted by maximum likelihood, with their test."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.anderson_darling import a_squared, level_in, log_of_the_rest

Array = NDArray[np.float64]

LEAST_LEVEL = 0.1  # of the test at which a fit counts as good
LEAST_SHAPE = -0.5

# upper tail of A squared by shape, both parameters fitted: simulated by
# `python -m tests.coverage.pareto_levels`
SHAPES = (-0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
LEVELS = (0.5, 0.25, 0.1, 0.05, 0.025, 0.01)
CRITICAL = (
    (0.438, 0.637, 0.906, 1.108, 1.338, 1.637),
    (0.414, 0.599, 0.842, 1.043, 1.256, 1.518),
    (0.394, 0.565, 0.792, 0.968, 1.153, 1.420),
    (0.372, 0.530, 0.735, 0.901, 1.062, 1.284),
    (0.358, 0.508, 0.697, 0.844, 0.994, 1.204),
    (0.350, 0.492, 0.678, 0.821, 0.956, 1.143),
    (0.342, 0.477, 0.650, 0.780, 0.916, 1.118),
    (0.337, 0.470, 0.630, 0.751, 0.866, 1.049),
)


class Pareto(NamedTuple):
    """Shape (below 0: bounded) and scale."""

    shape: float
    scale: float


def fit_pareto(y: Array) -> Pareto:
    """Fit excesses by maximum likelihood.

    Parameters
    ----------
    y : float64[n]
        Above zero, ascending.

    Returns
    -------
    Pareto
        Shape from -0.5: below, the likelihood has no regular maximum.

    References
    ----------
    S. D. Grimshaw, Technometrics 35 (1993) 185-191: the likelihood depends on shape
    over scale alone.
    """
    mean, largest = float(y.mean()), float(y[-1])

    def shape_at(theta: Array) -> Array:
        return np.array([np.log1p(t * y).mean() for t in theta])

    def likelihood(theta: Array) -> Array:
        shape = shape_at(theta)
        small = np.abs(theta) * mean < 1e-7
        scale = np.where(small, mean, shape / np.where(small, 1.0, theta))
        found = -np.log(scale) - shape - 1
        return np.where(shape < LEAST_SHAPE, -np.inf, found)

    # theta times the largest runs from -1; the grid is refined about its best point
    grid = np.concatenate([np.linspace(-1 + 1e-4, 1, 40), np.geomspace(1.1, 1e7, 60)])
    grid = grid / largest
    for _ in range(5):
        best = int(likelihood(grid).argmax())
        ends = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
        grid = np.linspace(*ends, 13)
    theta = grid[[6]]
    shape = float(shape_at(theta)[0])
    if abs(theta[0]) * mean < 1e-7:
        return Pareto(0.0, mean)
    return Pareto(shape, shape / float(theta[0]))


def anderson_darling(y: Array, fit: Pareto) -> float:
    """Return A squared of ascending excesses against a fit."""
    log_over = (  # logarithm of the share beyond
        -y / fit.scale
        if abs(fit.shape) < 1e-9
        else -np.log1p(fit.shape * y / fit.scale) / fit.shape
    )
    return a_squared(log_of_the_rest(log_over), log_over)


def level_of(statistic: float, shape: float) -> float:
    """Return the level (p-value) of A squared, between 0.01 and 0.5.

    References
    ----------
    V. Choulakian, M. A. Stephens, Technometrics 43 (2001) 478-484: the distribution
    depends on the shape alone.
    """
    critical = [
        np.interp(shape, SHAPES, column) for column in zip(*CRITICAL, strict=True)
    ]
    return level_in(statistic, critical, LEVELS)
