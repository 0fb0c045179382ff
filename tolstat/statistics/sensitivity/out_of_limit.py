"""How deviations differ between the units out of limit and the others.

They are compared by ranks or as normal scores.
"""

import math
import zlib
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri, stdtr

from tolstat.arrays import Array, Integers, Truths

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
        slopes = np.linalg.lstsq(others, z[name], rcond=None)[0]
        remainders[name] = z[name] - others @ slopes
        if remainders[name].var() < LEAST_OWN:
            del remainders[name]
    return remainders


def larger(first: Array, second: Array) -> float:
    """Return the level of a paired t test: the mean of one is larger."""
    steps = first - second
    error = float(steps.std(ddof=1)) / math.sqrt(len(steps))
    return float(stdtr(len(steps) - 1, -float(steps.mean()) / error)) if error else 1.0


CLEAR = 0.05  # level below which a difference is significant


class Difference(NamedTuple):
    """How one contributor differs among the units out of limit.

    Attributes
    ----------
    shift : float
        Mean in units out of limit less mean in all trials, over sigma in all trials.
    width : float
        Root mean square distance from the mean of all trials, over sigma: 1 as in all
        trials, above 1 if farther from the mean on either side.
    level : float
        p-value.
    """

    shift: float
    width: float
    level: float


def differences(
    deviations: Mapping[Any, Array], out: Mapping[str, Truths]
) -> dict[str, dict[Any, Difference]]:
    """Compare the units out of limit with the others, contributor by contributor.

    Each contributor has two rank sum tests (Wilcoxon). That of the deviations finds a
    shift to one side. That of their distances from the median finds deviations far from
    it or near it. The smaller of the two levels counts, doubled.

    Parameters
    ----------
    out : mapping of str to bool[trial]
        Which trials are out of the limit of each response; failed ones included.

    Returns
    -------
    dict of str to dict of str to Difference
        By response and contributor, the levels not yet corrected for their number; none
        if all or no units are out of limit. With few units out of limit, levels are
        conservative: normal scores have longer tails than sums of few ranks.

    References
    ----------
    F. Wilcoxon, Biometrics Bulletin 1 (1945) 80-83, and of distances after A. R. Ansari
    and R. A. Bradley, Ann. Math. Statist. 31 (1960) 1174-1189.
    """
    tested = {n: units for n, units in out.items() if 0 < units.sum() < len(units)}
    by_response: dict[str, dict[Any, Difference]] = {name: {} for name in out}
    for name, x in deviations.items():
        mean, sigma = float(x.mean()), float(x.std())
        if sigma == 0:
            continue
        ranks, of_far = _ranks(x), _ranks(np.abs(x - np.median(x)))
        for response, units in tested.items():
            level = 2 * min(_level(ranks, units), _level(of_far, units))
            scaled = (x[units] - mean) / sigma
            width = float(np.sqrt(np.mean(scaled**2)))
            by_response[response][name] = Difference(
                float(scaled.mean()), width, min(1.0, level)
            )
    return by_response


def _ranks(x: Array) -> Array:
    """Rank float64[n] from 1, equal values at random.

    With mean ranks, few values that differ from many equal ones seem significant.
    """
    chance = _chance(len(x))
    ranks = np.empty(len(x))
    ranks[chance[np.argsort(x[chance], kind="stable")]] = np.arange(1.0, len(x) + 1)
    return ranks


@lru_cache(1)
def _chance(count: int) -> Integers:
    """Return a permutation that never changes."""
    return np.random.RandomState(count).permutation(count)


def _level(ranks: Array, units: Truths) -> float:
    """Return the two-sided level of a rank sum."""
    n, m = len(ranks), int(np.count_nonzero(units))
    variance = ranks.var() * m * (n - m) / (n - 1)
    if variance == 0:
        return 1.0
    score = abs(float(ranks[units].sum()) - m * (n + 1) / 2) / math.sqrt(variance)
    return float(2 * ndtr(-score))


def holm(levels: Array) -> Array:
    """Correct float64[n] p-values for their number.

    References
    ----------
    S. Holm, Scand. J. Statist. 6 (1979) 65-70.
    """
    order = np.argsort(levels, kind="stable")
    times = np.arange(len(levels), 0, -1)
    corrected = np.empty(len(levels))
    corrected[order] = np.minimum(np.maximum.accumulate(levels[order] * times), 1.0)
    return corrected
