"""Rows of a file that repeat others: copies are refused, chance is not."""

import math
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import DataError
from tolstat.statistics.repeats import LEVEL, repeats_of
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


def copied_parts(
    table: Table | QdasFile, name: str, *, refuse_pasted: bool = False
) -> list[tuple[str, str]]:
    """Return rows of parts that are copies: the place of each, and of the earlier row.

    All their cells are equal, but for numbers that count the rows. A column that names
    the parts, or numbers that agree more often than by rounding, tell copies from equal
    parts.

    Raises
    ------
    DataError
        If rows that were pasted again are to be refused: see `_check_stretches`.
    """
    if isinstance(table, QdasFile):
        return []
    numbers, counting = _numbers(table)
    index = table.columns[name]
    left_out = {table.columns[head] for head in counting} - {index}
    rows = [i for i, row in enumerate(table.rows) if not is_empty(row.cells[index])]
    cells = [
        tuple(str(x) for j, x in enumerate(table.rows[i].cells) if j not in left_out)
        for i in rows
    ]
    heads = [head for head, j in table.columns.items() if j in left_out]
    apart = f" (but for {', '.join(heads)})" if heads else ""
    if refuse_pasted:
        _check_stretches([table.places[i] for i in rows], cells, apart)
    seen = dict[tuple[str, ...], int]()
    earlier = [seen.setdefault(words, i) for i, words in zip(rows, cells, strict=True)]
    pairs = [(i, first) for i, first in zip(rows, earlier, strict=True) if i != first]
    if not pairs:
        return []
    names = [head for head in table.columns if head not in counting]
    if not (_named_parts(table, names, [*seen.values()]) or _by_numbers(numbers)):
        return []
    return [(table.places[i], table.places[first] + apart) for i, first in pairs]


def _check_stretches(
    places: Sequence[str], cells: Sequence[tuple[str, ...]], apart: str
) -> None:
    """Refuse parts of which a stretch repeats an earlier one: rows pasted again.

    Raises
    ------
    DataError
        If it is longer than by chance: so many equal rows one after the other, and so
        many different ones among half of them, have a probability of 1e-3 at most.
    """
    counts = np.array([*Counter(cells).values()])
    if len(counts) < 2:
        return
    agreement = float(np.sum((counts / len(cells)) ** 2))
    least = math.ceil(math.log(LEVEL / len(cells) ** 2) / math.log(agreement))
    seen = dict[tuple[tuple[str, ...], ...], int]()
    for i in range(len(cells) - 2 * least + 1):
        stretch = (*cells[i : i + 2 * least],)
        first = seen.setdefault(stretch, i)
        if first != i and len({*stretch}) >= least:
            raise DataError(
                f"{places[i]} and the {2 * least - 1} after it have the same cells as "
                f"{places[first]} and those after it{apart}: a copy is no part; "
                "remove the copies, or give repeats = true if each row is a part"
            )


def _numbers(table: Table) -> tuple[Array, set[str]]:
    """Return the columns of numbers, float64[row, column], and those that count rows.

    The latter are not among the former.
    """
    columns, counting = [np.empty((len(table.rows), 0))], set[str]()
    for name in table.numeric:
        with suppress(DataError):  # another column, which cannot be read
            if table.counts_rows(name):
                counting.add(name)
            else:
                columns.append(table.numbers(name)[:, None])
    return np.hstack(columns), counting


def _named_parts(table: Table, heads: Sequence[str], rows: Sequence[int]) -> bool:
    """Return whether a column names or counts the parts: no two rows have the same."""
    numeric = table.numeric
    for name in heads:
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


def _by_numbers(numbers: Array) -> bool:
    """Return whether rounding does not explain that rows of numbers repeat."""
    repeats = repeats_of(np.empty((len(numbers), 0)), numbers)
    return repeats is not None and not repeats.by_chance
