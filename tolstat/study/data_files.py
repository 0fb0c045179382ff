"""Files of data that a study names: measured parts, trials, published points."""

import re
from pathlib import Path

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import DataError
from tolstat.study.files import beside, content
from tolstat.study.study_schema import FileEntry, PartsEntry
from tolstat.tables import qdas
from tolstat.tables.grid import Row
from tolstat.tables.numerals import COMMA
from tolstat.tables.read import MOST_MEGABYTES, Form, read_qdas, read_table
from tolstat.tables.table import MeasuredColumn, Table
from tolstat.units.conversion import to_si

FEW = 5  # rows: fewer tell nothing
_WHOLE = re.compile(r"[+-]?[0-9]+")


def read_data(
    folder: Path | None, entry: FileEntry, wanted: tuple[str, ...] = ()
) -> Table:
    """Return the table of a file beside a study; see `read_table`."""
    path = beside(folder, entry.data)
    return read_table(path, content(path, MOST_MEGABYTES), form_of(entry), wanted)


def read_measured(folder: Path | None, entry: PartsEntry) -> tuple[MeasuredColumn, str]:
    """Return a measured column, and the text of a number that a comma may tear."""
    path, torn = beside(folder, entry.data), ""
    if path.suffix.lower() in qdas.ENDINGS:
        raw = content(path, MOST_MEGABYTES)
        values = values_beside(folder, entry.data)
        file = read_qdas(path, raw, values, form_of(entry))
        return file.measured(entry.column), torn
    table = read_data(folder, entry, (entry.column,))
    column = table.measured(entry.column)
    if table.grid.separator == COMMA:
        torn = torn_by_commas(table.rows, table.columns[column.name])
    return column, torn


def values_beside(folder: Path | None, name: str) -> bytes:
    """Return the values that belong to a DFD file; nothing for a DFQ file."""
    if Path(name).suffix.lower() != ".dfd":
        return b""
    suffix = ".DFX" if Path(name).suffix.isupper() else ".dfx"
    return content(beside(folder, str(Path(name).with_suffix(suffix))), MOST_MEGABYTES)


def form_of(entry: FileEntry) -> Form:
    """Return what a study says of how a file is written."""
    part = entry.part if isinstance(entry, PartsEntry) else None
    return Form(
        entry.decimal or "", entry.delimiter or "", entry.encoding or "",
        sheet=entry.sheet or "", part=part or "",
    )  # fmt: skip


def si_values(table: Table, name: str, unit: str) -> Array:
    """Return the numbers of a column, SI."""
    written = table.units[name]
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
        if not texts or not all(
            len(pair) == 2 and _WHOLE.fullmatch(pair[0]) and pair[1].isdigit()
            for pair in texts
        ):
            continue
        if len(texts) >= FEW and len({len(pair[1]) for pair in texts}) == 1:
            return ",".join(texts[0])
    return ""
