"""Quantiles of A squared for fitted generalized Pareto distributions.

    python -m tests.coverage.pareto_levels    # two minutes; prints the table

The table of `tolstat.statistics.tail_fit`, by simulation: 20 000 samples of 200
excesses for each shape, each with its own fit.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor

import numpy as np

from tolstat.statistics.tail_fit import LEVELS, SHAPES, anderson_darling, fit_pareto


def quantiles(shape, samples=20_000, n=200):
    """Return the quantiles of A squared at the levels of the table."""
    rng = np.random.default_rng([75, round(1000 * (shape + 1))])
    found = np.empty(samples)
    for i in range(samples):
        e = rng.exponential(size=n)
        y = np.sort(e if shape == 0 else np.expm1(shape * e) / shape)
        found[i] = anderson_darling(y, fit_pareto(y))
    return np.quantile(found, 1 - np.array(LEVELS))


def main():
    """Print the table."""
    with ProcessPoolExecutor(2) as workers:
        for shape, row in zip(SHAPES, workers.map(quantiles, SHAPES), strict=True):
            print(shape, np.round(row, 3).tolist(), flush=True)


if __name__ == "__main__":
    main()
