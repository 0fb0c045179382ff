"""Files of data that a study names: measured parts, trials, published points."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import DataError, allowed_names
from tolstat.study.files import beside, content
from tolstat.study.repeated_rows import copied_parts
from tolstat.study.study_schema import FileEntry, PartsEntry
from tolstat.tables import qdas
from tolstat.tables.cell_units import PLAIN, is_unit
from tolstat.tables.grid import Row
from tolstat.tables.heads import split_head
from tolstat.tables.numerals import COMMA, is_torn
from tolstat.tables.read import MOST_MEGABYTES, Form, read_qdas, read_table
from tolstat.tables.table import MeasuredColumn, Table
from tolstat.units.conversion import same_unit, to_si

FEW = 5  # rows: fewer tell nothing


def read_data(
    folder: Path | None, entry: FileEntry, requested: Sequence[str] = ()
) -> Table:
    """Return the table of a file beside a study; see `read_table`."""
    path = beside(folder, entry.data)
    return read_table(path, content(path, MOST_MEGABYTES), form_of(entry), requested)


class MeasuredFile:
    """A file of measured parts: a table, or characteristics of Q-DAS.

    Parameters
    ----------
    path : Path
        The file.
    entry : PartsEntry
        How it is written.
    requested : sequence of str
        Columns that will be read.
    """

    def __init__(
        self, path: Path, entry: PartsEntry, requested: Sequence[str] = ()
    ) -> None:
        raw, form = content(path, MOST_MEGABYTES), form_of(entry)
        self._file: Table | qdas.QdasFile
        if path.suffix.lower() in qdas.ENDINGS:
            if entry.rows:
                raise DataError(f"{path}: a Q-DAS file has no columns; leave rows out")
            self._file = read_qdas(path, raw, _values_beside(path), form)
        else:
            self._file = read_table(path, raw, form, requested)

    def names(self, lots: str = "") -> list[str]:
        """Return characteristics, or columns of numbers.

        Neither those that count 1, 2, 3 nor that of the lots. One with a word or
        another unit in it is among them: reading it names that cell.
        """
        if isinstance(self._file, qdas.QdasFile):
            return self._file.names
        names = [name for name in self._file.mainly_numeric if name != lots]
        return [name for name in names if not self._file.counts_rows(name)]

    def measured(self, name: str, lots: str = "") -> MeasuredColumn:
        """Return a column; `lots` names that of the lots, which Q-DAS tells itself."""
        if isinstance(self._file, qdas.QdasFile):
            if lots:
                raise DataError(
                    f"{self._file.path}: a Q-DAS file has the batch of each value "
                    f"(K0006), and no columns; leave lots = '{lots}' out"
                )
            return self._file.measured(name)
        return self._file.measured(name, lots)

    def copies(self, name: str) -> list[tuple[str, str]]:
        """Return rows that are copies: the place of each, and of the earlier row."""
        if isinstance(self._file, qdas.QdasFile):
            return []
        return copied_parts(self._file, name)

    def torn(self, name: str) -> str:
        """Return the text of a number that a decimal comma may tear in two columns."""
        if isinstance(self._file, qdas.QdasFile) or self._file.grid.separator != COMMA:
            return ""
        return torn_by_commas(self._file.rows, self._file.columns[name])


def _values_beside(path: Path) -> tuple[Path, bytes] | None:
    """Return the file of values that belongs to a DFD file; None for a DFQ file."""
    if path.suffix.lower() != ".dfd":
        return None
    values = path.with_suffix(".DFX" if path.suffix.isupper() else ".dfx")
    return values, content(values, MOST_MEGABYTES)


def form_of(entry: FileEntry) -> Form:
    """Return what a study says of how a file is written."""
    part = entry.part if isinstance(entry, PartsEntry) else None
    return Form(
        entry.decimal or "", entry.delimiter or "", entry.encoding or "",
        sheet=entry.sheet or "", part=part or "",
        no_value=None
        if entry.no_value is None else tuple(map(str, entry.no_value)),
        only=tuple(entry.rows.items()),
    )  # fmt: skip


def unit_of_column(column: MeasuredColumn, typed: str | None, source: str) -> str:
    """Return the unit of a column, typed or of its file; refuse two that differ.

    `source` says where it was typed. What is typed replaces a unit that is unknown.
    """
    unit = column.unit if typed is None else typed
    if column.unit and not is_unit(column.unit):
        if typed is None and column.unit not in PLAIN:
            raise DataError(
                f"{column.path}, column {column.name}: its unit '{unit}' is unknown; "
                'give its unit, such as unit = "mm"'
            )
    elif column.unit and not same_unit(column.unit, unit):
        raise DataError(
            f"{column.path} gives column {column.name} in {column.unit}, {source} in "
            f"{unit}"
        )
    return unit


def named_column(table: Table, name: str, typed: str) -> tuple[str, str]:
    """Return the head that a study names for an entry, and its unit.

    `typed` may have the unit that the file does not give, "F peak [kN]".
    """
    head, unit = (typed, "") if typed in table.columns else split_head(typed)
    if head not in table.columns:
        raise DataError(
            f"{table.path} has no column '{head}'; "
            f"{allowed_names(head, table.columns)}; name another one by "
            f"columns = {{ {name} = ... }}"
        )
    written = table.units[head]
    if unit and written and unit != written:
        raise DataError(
            f"{table.path} gives column {head} in {written}, the key columns in {unit}"
        )
    return head, written or unit


def si_values(table: Table, name: str, unit: str, written: str = "") -> Array:
    """Return the numbers of a column, SI; `written`: its unit if the file has none."""
    written = table.units[name] or written
    try:
        factor = to_si(1.0, "" if written == "1" else written, unit)
    except ValueError as error:
        raise DataError(f"{table.path}, column {name}: {error}") from None
    return np.array(table.column(name)) * factor


def source_words(file: Table | MeasuredColumn) -> str:
    """Return what identifies the content of a file, and how it was read."""
    words = file.words() if isinstance(file, Table) else file.words
    digest = f"SHA-256 {file.digest[:12]}"
    return digest if file.plain else f"{digest}; {words}"


def torn_by_commas(rows: list[Row], index: int) -> str:
    """Return the text of a number that a decimal comma may tear in two columns.

    Whole numbers beside digits, as many in each row: 6,8 may be 6.8. Empty where a cell
    shows that it is a number of its own.
    """
    for first in (index - 1, index):
        pairs = [row.cells[first : first + 2] for row in rows] if first >= 0 else []
        texts = [[str(cell) for cell in pair] for pair in pairs]
        if len(texts) < FEW or not all(len(p) == 2 and is_torn(*p) for p in texts):
            continue
        if len({len(decimals) for _, decimals in texts}) == 1:
            return ",".join(texts[0])
    return ""
