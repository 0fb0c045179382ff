"""Deviations as normal scores; what correlated contributors do not share."""

import math
import zlib
from collections.abc import Mapping

import numpy as np
from scipy.special import ndtri, stdtr

from tolstat.arrays import Array, Truths

RANKED = 100_000  # trials among which a deviation is ranked
CHANCE = 4.0  # significant correlation, times the root of the trials
LEAST_OWN = 1e-3  # share of the variance below which two parts are one


def scores(x: Array, out: Truths, name: str) -> Array:
    """Return the normal scores of units out of limit among all, equal values at random.

    Each contributor has separate random numbers, which never change: common ones would
    correlate independent contributors.
    """
    ordered = np.sort(x[:RANKED])
    n, values = len(ordered), x[out]
    low, high = (np.searchsorted(ordered, values, side) for side in ("left", "right"))
    generator = np.random.RandomState(zlib.crc32(str(name).encode()))
    chance = generator.random_sample(len(values))
    position = np.clip((low + chance * (high - low)) / n, 0.5 / n, 1 - 0.5 / n)
    return np.asarray(ndtri(position), np.float64)


def dependent(deviations: Mapping[str, Array]) -> Truths:
    """Return bool[i, j]: contributors correlated directly or through others."""
    from scipy.sparse.csgraph import connected_components  # slow to import
    from scipy.stats import rankdata

    n = min(len(next(iter(deviations.values()))), RANKED)
    ranks = np.array([rankdata(x[:n]) for x in deviations.values()])
    ranks -= ranks.mean(axis=1, keepdims=True)
    ranks /= np.linalg.norm(ranks, axis=1, keepdims=True)
    _, chain = connected_components(np.abs(ranks @ ranks.T) > CHANCE / math.sqrt(n))
    return np.asarray(chain[:, None] == chain)


def own_parts(deviations: Mapping[str, Array], linked: Truths) -> dict[str, Array]:
    """Return of each contributor what the ones correlated with it do not tell.

    The remainder of a linear regression of its normal scores; the deviation itself of
    an independent contributor. Contributors without a remainder are left out.
    """
    names, remainders = list(deviations), dict(deviations)
    all_trials = np.ones(len(next(iter(deviations.values()))), dtype=bool)
    among = [n for n, row in zip(names, linked, strict=True) if row.sum() > 1]
    z = {n: scores(deviations[n], all_trials, n) for n in among}
    for name in among:
        row = linked[names.index(name)]
        others = np.column_stack(
            [z[n] for n, yes in zip(names, row, strict=True) if yes and n != name]
        )
        remainders[name] = (
            z[name] - others @ np.linalg.lstsq(others, z[name], rcond=None)[0]
        )
        if remainders[name].var() < LEAST_OWN:
            del remainders[name]
    return remainders


def larger(first: Array, second: Array) -> float:
    """Return the level of a paired t test: the mean of one is larger."""
    steps = first - second
    error = float(steps.std(ddof=1)) / math.sqrt(len(steps))
    return float(stdtr(len(steps) - 1, -float(steps.mean()) / error)) if error else 1.0
