"""Codes that programs write where there is no value: -999, 9.9e37."""

from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.errors import DataError, UnitError
from tolstat.tables.cell_units import split_cell
from tolstat.tables.grid import Cell, Grid, Row
from tolstat.tables.numerals import COMMA, POINT, Proof, number, proof

LARGEST = 1e19  # SI or not, no response of a machine is larger
SHORTEST = 3  # nines
NAMED = 5  # more rows in a sentence
BEYOND = 0.1  # of the width of the other numbers: a code lies outside of them


def without_codes(grid: Grid, codes: Sequence[str]) -> Grid:
    """Return a grid whose cells with one of some codes are empty.

    A code is a text, or a number however it is written: "-999" is -999,000, too.
    """
    has_code, first = cells_with(codes), grid.head.body - grid.head.position
    rows = [
        Row(row.line, ["" if has_code(cell) else cell for cell in row.cells])
        for row in grid.rows[first:]
    ]
    return grid._replace(rows=[*grid.rows[:first], *rows])


def cells_with(codes: Sequence[str]) -> Callable[[Cell], bool]:
    """Return what tells whether a cell has one of some codes."""
    texts = {code.strip().casefold() for code in codes}
    numbers = numbers_of_codes(codes)

    def has_code(cell: Cell) -> bool:
        if isinstance(cell, str):
            return cell.strip().casefold() in texts or _number(cell) in numbers
        return cell in numbers

    return has_code


def numbers_of_codes(codes: Sequence[str]) -> set[float]:
    """Return the codes that are numbers."""
    return {value for code in codes if (value := _number(code)) is not None}


def refuse_codes(values: Array, addresses: Sequence[str], lines: Sequence[str]) -> None:
    """Refuse numbers that look like a code for no value, by addresses and lines."""
    suspected = suspected_codes(values).tolist()
    if not suspected:
        return
    code = f"{values[suspected[0]]:.10g}"
    also = ", ".join(lines[i] for i in suspected[1 : NAMED + 1])
    others = f" (also in {also}{', ...' * (len(suspected) > NAMED + 1)})"
    raise DataError(
        f'{addresses[suspected[0]]}: {code} may mean "no value"'
        f"{others if also else ''}; give no_value = [{code}] if it does, or "
        "no_value = [] if it is a number"
    )


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
    """Return the number of a cell; a sign that proves nothing is decimal."""
    text = str(split_cell(text.strip())[0])
    proves_point = proof(text) is Proof.POINT
    with suppress(UnitError):
        return number(text, COMMA if COMMA in text and not proves_point else POINT)
    return None
