"""Files of data that a study names: measured parts, trials, published points."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from tolstat.errors import DataError, DistributionError, UnitError, allowed_names
from tolstat.study.files import beside, content
from tolstat.study.study_schema import FileEntry, PartsEntry
from tolstat.tables import qdas
from tolstat.tables.cell_units import PLAIN, is_unit
from tolstat.tables.heads import split_head
from tolstat.tables.numerals import COMMA, is_torn
from tolstat.tables.raw_file import Form, RawFile
from tolstat.tables.read import MOST_MEGABYTES, read_table
from tolstat.tables.table import MeasuredColumn, Table
from tolstat.units.conversion import same_unit, to_si

FEW = 5  # rows: fewer tell nothing


def read_data(
    folder: Path | None, entry: FileEntry, requested: Sequence[str] = ()
) -> Table:
    """Return the table of a file beside a study; see `read_table`."""
    path = beside(folder, entry.data)
    return read_table(path, content(path, MOST_MEGABYTES), form_of(entry), requested)


def measured_file(
    path: Path, entry: PartsEntry, requested: Sequence[str] = ()
) -> Table | qdas.QdasFile:
    """Return a file of measured parts: a table, or characteristics of Q-DAS.

    Parameters
    ----------
    path : Path
        The file.
    entry : PartsEntry
        How it is written.
    requested : sequence of str
        Columns that will be read.
    """
    raw, form = content(path, MOST_MEGABYTES), form_of(entry)
    if path.suffix.lower() not in qdas.ENDINGS:
        return read_table(path, raw, form, requested)
    if entry.rows:
        raise DataError(f"{path}: a Q-DAS file has no columns; leave rows out")
    return qdas.QdasFile(RawFile(path, raw, form), _values_beside(path))


def _values_beside(path: Path) -> tuple[Path, bytes] | None:
    """Return the file of values that belongs to a DFD file; None for a DFQ file."""
    if path.suffix.lower() != ".dfd":
        return None
    values = path.with_suffix(".DFX" if path.suffix.isupper() else ".dfx")
    return values, content(values, MOST_MEGABYTES)


def form_of(entry: FileEntry) -> Form:
    """Return what a study says of how a file is written."""
    typed = entry.model_dump(include={*Form._fields}, exclude_none=True)
    if "no_value" in typed:
        typed["no_value"] = tuple(map(str, typed["no_value"]))
    return Form(**typed, only=tuple(entry.rows.items()))


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


def si_factor(table: Table, name: str, written: str, unit: str) -> float:
    """Return what makes numbers of a column, in the written unit, SI."""
    with naming_column(table, name):
        return to_si(1.0, "" if written == "1" else written, unit)


@contextmanager
def naming_column(table: Table, name: str) -> Iterator[None]:
    """Name the column in what is wrong with it."""
    try:
        yield
    except (UnitError, DistributionError) as error:
        raise DataError(f"{table.path}, column {name}: {error}") from None


def source_words(file: Table | MeasuredColumn) -> str:
    """Return what identifies the content of a file, and how it was read."""
    digest = f"SHA-256 {file.digest[:12]}"
    return digest if file.plain else f"{digest}; {file.words}"


def torn_by_commas(file: Table | qdas.QdasFile, name: str) -> str:
    """Return the text of a number that a decimal comma may tear in two columns.

    Whole numbers beside digits, as many in each row: 6,8 may be 6.8. Empty where a cell
    shows that it is a number of its own.
    """
    if isinstance(file, qdas.QdasFile) or file.grid.separator != COMMA:
        return ""
    index = file.columns[name]
    for first in range(max(index - 1, 0), index + 1):
        pairs = [row.cells[first : first + 2] for row in file.rows]
        texts = [[str(cell) for cell in pair] for pair in pairs]
        if len(texts) < FEW or not all(len(p) == 2 and is_torn(*p) for p in texts):
            continue
        if len({len(decimals) for _, decimals in texts}) == 1:
            return ",".join(texts[0])
    return ""
