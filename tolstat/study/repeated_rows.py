"""Rows of a file that repeat others: copies are refused, chance is not."""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import DataError
from tolstat.statistics.repeats import repeats_of
from tolstat.study.study_schema import TableEntry
from tolstat.tables.heads import is_empty
from tolstat.tables.qdas import QdasFile
from tolstat.tables.table import Table

NAMED = 5  # rows in a sentence
LEAST = 5  # rows: in fewer, a column with different cells need not name the parts
SAMPLES = ("random", "latin")  # rows with statistics


def repeated_rows(
    table: Table, entry: TableEntry, inputs: Sequence[Array], responses: Sequence[Array]
) -> str:
    """Return a warning about rows with the same numbers; empty without any.

    `inputs` and `responses` are columns as written.

    Raises
    ------
    DataError
        If they are copies and the rows a sample: no interval holds then. The key
        `repeats` says that each is a unit.
    """
    if entry.repeats:
        return ""
    empty = np.empty((len(table.rows), 0))
    repeats = repeats_of(
        np.column_stack([empty, *inputs]), np.column_stack([empty, *responses])
    )
    if repeats is None or repeats.by_chance:
        return ""
    lines = [table.rows[row].line for row in repeats.rows.tolist()]
    first = table.rows[int(repeats.first[0])].line
    more = ", ".join(map(str, lines[1 : NAMED + 1]))
    others = f", and {more} repeat others" if more else ""
    if len(lines) > NAMED + 1:
        others = f", and {len(lines) - 1} more repeat others: {more}, ..."
    place = table.grid.row_place(lines[0])
    sentence = f"{place} has the same numbers as {table.grid.counted} {first}{others}"
    if entry.sampled in SAMPLES:
        raise DataError(
            f"{sentence}; a copy is no unit of its own: remove it, or give "
            "repeats = true if each row is a unit"
        )
    return f"{sentence}: a row that stands twice counts twice"


def copied_parts(table: Table | QdasFile, name: str) -> list[tuple[str, str]]:
    """Return rows of parts that are copies: the place of each, and of the earlier row.

    All their cells are equal. A column that names or counts the parts, or numbers that
    agree more often than by rounding, tell copies from equal parts.
    """
    if isinstance(table, QdasFile):
        return []
    index, seen = table.columns[name], dict[tuple[str, ...], int]()
    rows = [i for i, row in enumerate(table.rows) if not is_empty(row.cells[index])]
    earlier = [seen.setdefault((*map(str, table.rows[i].cells),), i) for i in rows]
    pairs = [(i, first) for i, first in zip(rows, earlier, strict=True) if i != first]
    if not pairs or not (_named_parts(table, [*seen.values()]) or _by_numbers(table)):
        return []
    return [(table.places[i], table.places[first]) for i, first in pairs]


def _named_parts(table: Table, rows: Sequence[int]) -> bool:
    """Return whether a column names or counts the parts: no two rows have the same."""
    numeric = table.numeric
    for name in table.columns:
        words = table.texts(name)
        cells = {words[i] for i in rows}
        if len(cells) < len(rows) or len(rows) < LEAST:
            continue
        if name not in numeric:
            return True
        if all(cell.isdigit() for cell in cells):
            numbers = [*map(int, cells)]
            return max(numbers) - min(numbers) == len(rows) - 1
    return False


def _by_numbers(table: Table) -> bool:
    """Return whether rounding does not explain that numbers repeat."""
    columns = list[Array]()
    for name in table.numeric:
        with suppress(DataError):  # another column, which cannot be read
            columns.append(table.numbers(name))
    rows = len(table.rows)
    repeats = repeats_of(
        np.empty((rows, 0)), np.column_stack([np.empty((rows, 0)), *columns])
    )
    return repeats is not None and not repeats.by_chance
