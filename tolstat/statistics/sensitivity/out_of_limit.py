"""How deviations differ between the machines beyond a limit and the others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Array = NDArray[np.float64]
Machines = NDArray[np.bool_]

CLEAR = 0.05  # level below which a difference is told from chance


class Difference(NamedTuple):
    """How one contributor differs among the machines beyond a limit.

    Attributes
    ----------
    shift : float
        Its mean among them less its mean in all machines, over its sigma in all.
    width : float
        Its root mean square distance from the mean of all machines, over sigma: 1 is
        as in all machines, above 1 the machines beyond have it far off, to either side.
    level : float
        How often chance alone would make some contributor differ so much (p-value,
        corrected for the number of contributors after Holm).
    """

    shift: float
    width: float
    level: float

    @property
    def clear(self) -> bool:
        """Whether it is told from chance."""
        return self.level < CLEAR


def differences(
    deviations: Mapping[str, Array], beyond: Mapping[str, Machines]
) -> dict[str, dict[str, Difference]]:
    """Compare the machines beyond limits with the others, contributor by contributor.

    Two rank sum tests each (Wilcoxon): of the deviations, which sees that they lie to
    one side; and of their distances from the median, which sees that they lie far off
    to both, or near it. The smaller of the two levels counts, doubled.

    Parameters
    ----------
    deviations : mapping of str to float64[trial]
        By contributor; of independent trials.
    beyond : mapping of str to bool[trial]
        Which machines are beyond the limit of each response; failed ones among them.

    Returns
    -------
    dict of str to dict of str to Difference
        By response and contributor; none where all or no machines are beyond. With few
        machines beyond levels are too large, not too small: normal scores have longer
        tails than sums of a few ranks.

    References
    ----------
    F. Wilcoxon, Biometrics Bulletin 1 (1945) 80-83, and of distances after A. R. Ansari
    and R. A. Bradley, Ann. Math. Statist. 31 (1960) 1174-1189; S. Holm, Scand. J.
    Statist. 6 (1979) 65-70.
    """
    told = {n: each for n, each in beyond.items() if 0 < each.sum() < len(each)}
    found: dict[str, dict[str, Difference]] = {name: {} for name in beyond}
    for name, x in deviations.items():
        mean, sigma = float(x.mean()), float(x.std())
        if sigma == 0:
            continue
        ranks, of_far = _ranks(x), _ranks(np.abs(x - np.median(x)))
        for response, machines in told.items():
            level = 2 * min(_level(ranks, machines), _level(of_far, machines))
            off = (x[machines] - mean) / sigma
            width = float(np.sqrt(np.mean(off**2)))
            each = Difference(float(off.mean()), width, min(1.0, level))
            found[response][name] = each
    return {response: _holm(each) for response, each in found.items()}


def least_level(beyond: int, contributors: int) -> float:
    """Return the least level that so few machines beyond can have at all.

    Parameters
    ----------
    beyond : int
        Machines beyond, few of all.
    contributors : int
        That are compared.
    """
    return float(min(1.0, 4 * contributors * ndtr(-math.sqrt(3 * beyond))))


def of_kind(members: Sequence[str], found: Mapping[str, Difference]) -> float:
    """Return the level of a kind of part: of the member that differs most."""
    return min((found[name].level for name in members if name in found), default=1.0)


def _ranks(x: Array) -> Array:
    """Rank float64[n] from 1, what is alike as chance has it.

    At the middle of their ranks a few that differ from many would pass for clear.
    """
    chance = np.random.RandomState(len(x)).permutation(len(x))  # the same for ever
    ranks = np.empty(len(x))
    ranks[np.lexsort((chance, x))] = np.arange(1.0, len(x) + 1)
    return ranks


def _level(ranks: Array, machines: Machines) -> float:
    """Return the two-sided level of a rank sum."""
    n, m = len(ranks), int(np.count_nonzero(machines))
    variance = ranks.var() * m * (n - m) / (n - 1)
    if variance == 0:
        return 1.0
    score = abs(float(ranks[machines].sum()) - m * (n + 1) / 2) / math.sqrt(variance)
    return float(2 * ndtr(-score))


def _holm(found: Mapping[str, Difference]) -> dict[str, Difference]:
    """Correct the levels of contributors for their number."""
    levels = holm(np.array([each.level for each in found.values()]))
    return {
        name: each._replace(level=float(level))
        for (name, each), level in zip(found.items(), levels, strict=True)
    }


def holm(levels: Array) -> Array:
    """Correct float64[n] levels for their number: each at least as large as those less.

    References
    ----------
    S. Holm, Scand. J. Statist. 6 (1979) 65-70.
    """
    order = np.argsort(levels, kind="stable")
    times = np.arange(len(levels), 0, -1)
    corrected = np.empty(len(levels))
    corrected[order] = np.minimum(np.maximum.accumulate(levels[order] * times), 1.0)
    return corrected
