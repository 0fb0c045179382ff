"""Rows that repeat others: units with equal numbers by chance, or copies."""

import math
from typing import NamedTuple

import numpy as np
from scipy.special import pdtrc

from tolstat.arrays import Array, Integers
from tolstat.statistics.sample_checks import outliers, step_of

LEVEL = 1e-3  # probability of as many repeats by chance: a smaller one shows copies
NEAR_PAIRS = 50  # of rows that differ little: fewer do not tell a density
SLACK = 1.25  # of the expected repeats, which are known as well as this


class Repeats(NamedTuple):
    """Rows that repeat an earlier one."""

    rows: Integers
    first: Integers  # the earlier row of each
    by_chance: bool  # whether rounding explains them


def repeats_of(inputs: Array, responses: Array) -> Repeats | None:
    """Return the rows with the same numbers as an earlier one; None without any.

    Independent inputs agree by chance with the product of their probabilities, and no
    row more often than its least likely response: that bounds how many pairs agree.

    Parameters
    ----------
    inputs, responses : float64[row, column]
        As written: their steps are those of rounding. NaN in failed rows.
    """
    rows = np.hstack([inputs, responses])
    filled = np.isfinite(rows).any(axis=1)  # failed rows without inputs tell nothing
    seen = dict[bytes, int]()
    earlier = np.array(
        [seen.setdefault(row.tobytes(), i) for i, row in enumerate(rows + 0.0)]
    )
    repeated = np.flatnonzero(filled & (earlier != np.arange(len(rows))))
    if not len(repeated):
        return None
    unique = [*seen.values()]
    chance = math.prod(_agreement(x, x[unique]) for x in inputs.T)
    for column in responses.T:
        chance = min(chance, _agreement(column, column[unique]))
    copies = np.bincount(earlier)
    pairs = (copies * (copies - 1) // 2).sum()
    expected = SLACK * chance * math.comb(len(rows), 2)
    by_chance = bool(pdtrc(pairs - 1, expected) >= LEVEL)
    return Repeats(repeated, earlier[repeated], by_chance)


def _agreement(values: Array, others: Array) -> float:
    """Return how likely two units agree in a column: by its step, or by its ties.

    A normal density with steps of h agrees with h/(2 sqrt(pi) sigma), without outliers.
    """
    filled = np.sort(values[np.isfinite(values)])
    if len(filled) < 2 or not np.ptp(filled) > 0:
        return 1.0
    step = step_of(filled.tolist())
    core = np.delete(filled, outliers(filled))
    spread = float(core.std())
    by_step = step / (2 * math.sqrt(math.pi) * spread) if spread else 1.0
    counts = np.unique(others[np.isfinite(others)], return_counts=True)[1]
    ties = (counts * (counts - 1.0)).sum()
    number = int(counts.sum())
    by_ties = float(ties) / max(1, number * (number - 1))
    return min(1.0, max(by_step, _near_pairs(filled, step, spread), by_ties))


def _near_pairs(ascending: Array, step: float, spread: float) -> float:
    """Return how likely two units agree, by those that differ by a few steps.

    For any distribution, such as of two cavities; copies do not add to it.
    """
    steps, pairs = 1, 0.0
    equal = np.searchsorted(ascending, ascending + 0.5 * step)
    while step:
        near = np.searchsorted(ascending, ascending + (steps + 0.5) * step)
        pairs = float((near - equal).sum())
        if pairs >= NEAR_PAIRS or steps * step > spread:
            break
        steps *= 2
    return pairs / (2 * steps * math.comb(len(ascending), 2))
