"""Rows that repeat others: units with equal numbers by chance, or copies."""

import math
from typing import NamedTuple

import numpy as np
from scipy.special import pdtrc

from tolstat.arrays import Array, Integers
from tolstat.statistics.sample_checks import step_of

LEVEL = 1e-3  # probability of as many repeats by chance: a smaller one shows copies


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
    expected = chance * math.comb(len(rows), 2)
    by_chance = bool(pdtrc(pairs - 1, expected) >= LEVEL)
    return Repeats(repeated, earlier[repeated], by_chance)


def _agreement(values: Array, others: Array) -> float:
    """Return how likely two units agree in a column: by its step, or by its ties.

    A normal density with steps of h agrees with h/(2 sqrt(pi) sigma).
    """
    filled = values[np.isfinite(values)]
    if len(filled) < 2 or not np.ptp(filled) > 0:
        return 1.0
    by_step = step_of(filled.tolist()) / (2 * math.sqrt(math.pi) * float(filled.std()))
    counts = np.unique(others[np.isfinite(others)], return_counts=True)[1]
    ties = (counts * (counts - 1.0)).sum()
    number = int(counts.sum())
    return min(1.0, max(by_step, float(ties) / max(1, number * (number - 1))))
