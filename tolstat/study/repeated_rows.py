"""Rows of a file that repeat others: copies are refused, chance is not."""

from collections.abc import Sequence

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import DataError
from tolstat.statistics.repeats import repeats_of
from tolstat.study.study_schema import TableEntry
from tolstat.tables.table import Table

NAMED = 5  # rows in a sentence
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
