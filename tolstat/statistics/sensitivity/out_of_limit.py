"""How deviations differ between the units out of limit and the others.

They are compared by ranks or as normal scores.
"""

import math
import zlib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import islice
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri, stdtr

from tolstat.arrays import Array, Integers, Truths

RANKED = 100_000  # trials among which a deviation is ranked
SIDES: tuple[Literal["left", "right"], ...] = ("left", "right")
KEPT, CONTRIBUTORS = 512, 8192  # random numbers of a contributor, of so many
AT_ONCE = 1 << 20  # numbers in an array of several contributors
CHANCE = 4.0  # significant correlation, times the root of the trials
LEAST_OWN = 1e-3  # share of the variance below which two parts are one


class Ranked:
    """Ranks of deviations, for the normal scores of units out of several limits.

    Equal values are ranked at random. Each contributor has separate random numbers,
    which never change: common ones would correlate independent contributors. Ranks are
    kept of those units only that are out of any limit, bool[trial].
    """

    def __init__(self, columns: Mapping[str, Array], out: Truths) -> None:
        self._names, self._row = [*map(str, columns)], np.cumsum(out) - 1
        self._number = min(len(out), RANKED)
        self._low, self._ties = np.empty((2, len(columns), int(out.sum())), np.int32)
        for low, ties, x in zip(self._low, self._ties, columns.values(), strict=True):
            ordered = np.sort(x[:RANKED])
            low[:], high = (np.searchsorted(ordered, x[out], side) for side in SIDES)
            ties[:] = high - low

    def scores(self, out: Truths) -> Array:
        """Return the normal scores of some units among all: [contributor, unit]."""
        units, n = self._row[out], self._number
        numbers = [_numbers(name, len(units)) for name in self._names]
        positions = np.reshape(numbers, (len(numbers), len(units)))
        positions *= self._ties[:, units]
        positions += self._low[:, units]
        np.clip(positions / n, 0.5 / n, 1 - 0.5 / n, out=positions)
        return np.asarray(ndtri(positions, out=positions), np.float64)


@lru_cache(CONTRIBUTORS)
def _random_numbers(name: str) -> Array:
    """Return the first random numbers of a contributor."""
    generator = np.random.RandomState(zlib.crc32(name.encode()))
    return generator.random_sample(KEPT)


def _numbers(name: str, count: int) -> Array:
    """Return so many random numbers of a contributor."""
    if count <= KEPT:
        return _random_numbers(name)[:count]
    return np.random.RandomState(zlib.crc32(name.encode())).random_sample(count)


def dependent(deviations: Mapping[str, Array]) -> Truths:
    """Return bool[i, j]: contributors correlated directly or through others."""
    from scipy.sparse.csgraph import connected_components  # slow to import

    n = min(len(next(iter(deviations.values()))), RANKED)
    ranks = np.array([_mean_ranks(x[:n]) for x in deviations.values()])
    ranks -= ranks.mean(axis=1, keepdims=True)
    ranks /= np.linalg.norm(ranks, axis=1, keepdims=True)
    _, chain = connected_components(np.abs(ranks @ ranks.T) > CHANCE / math.sqrt(n))
    return np.asarray(chain[:, None] == chain)


def _mean_ranks(x: Array) -> Array:
    """Rank float64[n] from 1; equal values share their mean rank."""
    _, run, counts = np.unique(x, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - (counts - 1) / 2)[run])


def own_parts(deviations: Mapping[str, Array], linked: Truths) -> dict[str, Array]:
    """Return of each contributor what the ones correlated with it do not tell.

    The remainder of a linear regression of its normal scores; the deviation itself of
    an independent contributor. Contributors without a remainder are left out.
    """
    names, remainders = list(deviations), dict(deviations)
    all_trials = np.ones(len(next(iter(deviations.values()))), dtype=bool)
    among = [n for n, row in zip(names, linked, strict=True) if row.sum() > 1]
    ranked = Ranked({name: deviations[name] for name in among}, all_trials)
    z = dict(zip(among, ranked.scores(all_trials), strict=True))
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


def larger(first: Array, second: Array) -> Array:
    """Return the levels of paired t tests, along the last axis: one mean is larger."""
    steps = first - second
    error = steps.std(axis=-1, ddof=1) / math.sqrt(steps.shape[-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        levels = stdtr(steps.shape[-1] - 1, -steps.mean(axis=-1) / error)
    return np.where(error > 0, levels, 1.0)


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
    tested = {
        name: units for name, units in out.items() if 0 < units.sum() < len(units)
    }
    by_response: dict[str, dict[Any, Difference]] = {name: {} for name in out}
    if not tested:
        return by_response
    any_limit = np.logical_or.reduce([out[name] for name in tested])
    row = np.cumsum(any_limit) - 1
    varying = ((name, x) for name, x in deviations.items() if float(x.std()) > 0)
    number = max(1, AT_ONCE // len(any_limit))
    while block := dict(islice(varying, number)):
        compared = _Compared([*block.values()], any_limit)
        for response, units in tested.items():
            numbers = compared.differences(row[units])
            by_response[response] |= dict(zip(block, numbers, strict=True))
    return by_response


class _Compared:
    """Deviations that are compared with those of all trials, several at once.

    Kept are those of units that are out of any limit, bool[trial].
    """

    def __init__(self, columns: Sequence[Array], out: Truths) -> None:
        mean, sigma = (np.array([[x.mean(), x.std()] for x in columns]).T)[:, :, None]
        self._scaled = (np.array([x[out] for x in columns]) - mean) / sigma
        self._trials = len(out)
        self._ranks = [
            np.array([_ranks(x, out) for x in several])
            for several in (columns, [np.abs(x - np.median(x)) for x in columns])
        ]

    def differences(self, units: Integers) -> list[Difference]:
        """Return how each deviates in some of the units that are kept."""
        scaled = self._scaled.take(units, axis=1)
        smaller = np.minimum(
            *(self._levels(r.take(units, axis=1)) for r in self._ranks)
        )
        levels = np.minimum(1.0, 2 * smaller)
        width = np.sqrt(np.mean(scaled**2, axis=1))
        numbers = scaled.mean(axis=1).tolist(), width.tolist(), levels.tolist()
        return list(map(Difference, *numbers))

    def _levels(self, ranks: Array) -> Array:
        """Return the two-sided levels of rank sums, float64[contributor, unit]."""
        n, m = self._trials, ranks.shape[1]
        off = np.abs(ranks.sum(axis=1) - m * (n + 1) / 2)
        return np.asarray(2 * ndtr(-off / math.sqrt((n + 1) * m * (n - m) / 12)))


def _ranks(x: Array, units: Truths) -> Array:
    """Return the ranks of some units among float64[n], from 1.

    Equal values are ranked at random. With mean ranks, few values that differ from many
    equal ones seem significant.
    """
    ordered = np.sort(x)
    if (ordered[1:] > ordered[:-1]).all():  # far faster than to sort indices
        return 1 + np.searchsorted(ordered, x[units]).astype(float)
    chance = _chance(len(x))
    ranks = np.empty(len(x))
    ranks[chance[np.argsort(x[chance], kind="stable")]] = np.arange(1.0, len(x) + 1)
    return ranks[units]


@lru_cache(1)
def _chance(count: int) -> Integers:
    """Return a permutation that never changes."""
    return np.random.RandomState(count).permutation(count)


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
