"""Numbers of a table that no drive has together with the others.

Each number is left out in its turn, and a drive fitted to the rest. A number is wrong
where without it the rest agree, and without no other number they do as well.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.errors import ModelError
from tolstat.machines.rolling_block.fitting import ROUNDING, Fit, fitted
from tolstat.machines.rolling_block.linear import linear
from tolstat.machines.rolling_block.table import Array, Flags, Table
from tolstat.machines.rolling_block.undetermined import OPEN, open_unknowns

# A number contradicts the others where it is farther from them than so many halves of
# its last digit: rounding alone makes one, "0.001" for nothing makes two.
CONTRADICTS = 3.0
AS_WELL = 9.0 * ROUNDING  # squares of halves: so much is three standard deviations
MOST_CONTRADICTING = 0.05  # of all numbers; where more do, the drive is another one
# the right number is far ahead of the others after few steps
FIRST_STEPS = 3
PROMISING = 8
BEHIND = 1000.0  # times the best one's cost: not promising

Cell = tuple[int, int]  # row of the table (0: frequency, else mass) and mode, from 0


class Without(NamedTuple):
    """Drives fitted without one more number each, the best of all."""

    counts: Flags  # [1, 1 + mass, mode], what counts for all of them, but for ...
    cells: list[Cell]  # ... this number
    fit: Fit


class Contradiction(NamedTuple):
    """A number of the table that the others contradict.

    Attributes
    ----------
    mode : int
        From 1.
    mass : int
        From 1; 0 is the frequency of the mode.
    given, expected : float
        What stands in the table, and what the others ask for.
    certain : bool
        False where the table agrees as well without another number, named too: one of
        them is wrong, and it does not tell which.
    """

    mode: int
    mass: int
    given: float
    expected: float
    certain: bool = True

    @property
    def place(self) -> str:
        """Where it stands."""
        what = f"mass {self.mass}" if self.mass else "frequency"
        return f"mode {self.mode}, {what}"

    def __str__(self) -> str:
        """Say it in words."""
        words = (
            f"{self.place}: {self.given:g} is given, "
            f"the rest of the table asks for {self.expected:.4g}"
        )
        return words if self.certain else f"{words}, unless another one named is wrong"


def agreeing(table: Table) -> tuple[Fit, tuple[Contradiction, ...]]:
    """Find the drive of a table, and the numbers to leave out.

    Parameters
    ----------
    table : Table
        What is given.

    Returns
    -------
    fit : Fit
        One drive, which counts all numbers that are not named.
    contradictions : tuple of Contradiction
        By mode and mass.

    Raises
    ------
    ModelError
        If the table does not determine the drive, or no drive has it.
    """
    known = table.known[None]
    most = int(MOST_CONTRADICTING * known.sum())
    fit = fitted(table, known, linear(table, known))
    left: list[Cell] = []
    while not _agrees(fit)[0]:
        if len(left) == most:
            raise ModelError(
                f"no drive of this structure has this table: more than {most} of its "
                f"{known.sum()} numbers contradict the others; if they are measured, "
                "give frequency_resolution and shape_resolution that say how well"
            )
        last = _without_each(table, fit.counts)
        best = int(np.lexsort((last.fit.cost, ~_agrees(last.fit)))[0])
        left.append(last.cells[best])
        fit = last.fit.of([best])
    fit = _back(table, fit, left)
    if still_open := open_unknowns(fit, known):
        raise ModelError(
            f"the table does not determine {still_open}: give more modes, more of "
            "their shapes, or more digits"
        )
    named: dict[Cell, Contradiction] = {}
    for cell in left:
        if not fit.counts[0][cell]:
            counts = fit.counts.copy()
            counts[0][cell] = True
            if (counts != last.counts).any():
                last = _without_each(table, counts)
            named.update(_instead(table, fit, cell, last))
    contradictions = tuple(sorted(named.values()))
    counts = known.copy()
    for cell in named:
        counts[0][cell] = False
    if len(named) > (known & ~fit.counts).sum():
        fit = fitted(table, counts, fit.logs)
    if still_open := open_unknowns(fit, counts):
        places = " or ".join(each.place for each in contradictions)
        raise ModelError(
            f"{places}: given is what contradicts the rest of the table, which alone "
            f"does not determine {still_open}; correct the number"
        )
    return fit, contradictions


def noticed(table: Table, fit: Fit) -> Array:
    """Return the least error of each number that contradicts the others.

    Parameters
    ----------
    table, fit : Table, Fit
        What is given, and one drive that agrees with it.

    Returns
    -------
    float64[1 + mass, mode]
        Hz and parts of a shape. Infinite where without this number the drive is not
        determined, NaN where it does not count.
    """
    cells, fewer = _each_left_out(fit.counts)
    same = np.repeat(fit.logs, len(cells), axis=0)
    spread = fitted(table, fewer, same, steps=0).spread(fewer)
    least = np.where(fit.counts[0], CONTRADICTS * table.half / fit.seen()[0], np.nan)
    for cell, alone in zip(cells, np.max(spread, axis=1) > OPEN, strict=True):
        if alone:
            least[cell] = np.inf
    return least


def _agrees(fit: Fit) -> Flags:
    off = np.where(fit.counts, np.abs(fit.strain()), 0.0)
    agrees: Flags = np.max(off, axis=(1, 2)) <= CONTRADICTS
    return agrees


def _each_left_out(counts: Flags) -> tuple[list[Cell], Flags]:
    cells = np.argwhere(counts[0])
    fewer = np.repeat(counts, len(cells), axis=0)
    fewer[np.arange(len(cells)), cells[:, 0], cells[:, 1]] = False
    return [(int(row), int(mode)) for row, mode in cells], fewer


def _without_each(table: Table, counts: Flags) -> Without:
    """Fit without each number in its turn."""
    cells, fewer = _each_left_out(counts)
    first = fitted(table, fewer, linear(table, fewer), steps=FIRST_STEPS)
    best = np.argsort(first.cost, kind="stable")[:PROMISING]
    best = best[first.cost[best] <= BEHIND * (first.cost[best[0]] + AS_WELL)]
    fit = fitted(table, first.counts[best], first.logs[best])
    return Without(counts, [cells[k] for k in best], fit)


def _back(table: Table, fit: Fit, left: list[Cell]) -> Fit:
    """Count again what was left out and fits all the same."""
    if not left:
        return fit
    strain = fit.strain()[0]
    counts = fit.counts.copy()
    for cell in left:
        counts[0][cell] = abs(strain[cell]) <= CONTRADICTS
    again = fitted(table, counts, fit.logs)
    return again if _agrees(again)[0] else fit


def _instead(
    table: Table, fit: Fit, cell: Cell, without: Without
) -> dict[Cell, Contradiction]:
    """Name what may be wrong where a number was left out: that one, and others."""
    as_well = _agrees(without.fit) & (without.fit.cost <= fit.cost + AS_WELL)
    may = {each: without.fit.numbers[k][each]
           for k, each in enumerate(without.cells) if as_well[k]}  # fmt: skip
    may[cell] = fit.numbers[0][cell]
    return {
        (row, mode): Contradiction(
            mode + 1,
            row,
            float(table.numbers[row, mode]),
            float(expected),
            certain=len(may) == 1,
        )
        for (row, mode), expected in may.items()
    }
