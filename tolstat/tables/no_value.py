"""Codes that programs write where there is no value: -999, 9.9e37."""

from collections.abc import Sequence

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.tables.grid import Cell, Grid, Row

LARGEST = 1e19  # SI or not, no response of a machine is larger
SHORTEST = 3  # nines
BEYOND = 0.1  # of the width of the other numbers: a code lies outside of them


def without_codes(grid: Grid, codes: Sequence[str]) -> Grid:
    """Return a grid whose cells with one of some codes are empty.

    A code is a text, or a number however it is written: "-999" is -999,000, too.
    """
    texts = {code.strip().casefold() for code in codes}
    numbers = {number for code in codes if (number := _number(code)) is not None}

    def cleared(cell: Cell) -> Cell:
        if isinstance(cell, str):
            coded = cell.strip().casefold() in texts or _number(cell) in numbers
        else:
            coded = cell in numbers
        return "" if coded else cell

    first = grid.head.body - grid.head.position
    rows = [Row(row.line, [*map(cleared, row.cells)]) for row in grid.rows[first:]]
    return grid._replace(rows=[*grid.rows[:first], *rows])


def suspected_codes(values: Array) -> Integers:
    """Return the indices of numbers that look like a code for no value.

    Nines alone, such as -999 or 99999, that lie outside of the other numbers; and what
    is larger than any measurement.

    Examples
    --------
    >>> suspected_codes(np.array([20.01, -999.0, 20.02, 9.9e37])).tolist()
    [1, 3]
    """
    coded = np.abs(values) > LARGEST
    coded |= np.array([_has_only_nines(x) for x in values.tolist()], dtype=bool)
    others = values[~coded]
    if not len(others):
        return np.empty(0, np.int64)
    margin = BEYOND * np.ptp(others)
    coded &= (values < others.min() - margin) | (values > others.max() + margin)
    return np.flatnonzero(coded)


def _has_only_nines(value: float) -> bool:
    digits = f"{abs(value):.10g}".replace(".", "")
    return len(digits) >= SHORTEST and {*digits} == {"9"} and abs(value) > 1


def _number(text: str) -> float | None:
    try:
        return float(text.strip().replace(",", "."))
    except ValueError:
        return None
