"""Tables as a workbook (XLSX), by XlsxWriter: texts stay texts, numbers are numbers."""

import datetime
import io
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, islice
from typing import Any, NamedTuple

from tolstat.document.blocks import Cell, Document, Section, Table
from tolstat.document.inline import Number, Row
from tolstat.errors import RunFileError
from tolstat.literal import visible
from tolstat.render.screen import as_text
from tolstat.render.serialize import table_of_rows
from tolstat.statistics.estimate import Estimate

MOST_ROWS = 1_048_575  # below a head
LONGEST_NAME = 31  # characters of a sheet
LONGEST_TEXT = 32_767  # of a cell
WIDTHS = 8, 60  # of a column, in characters
LOOKED_AT = 200  # rows that say how wide a column is
_FORBIDDEN = re.compile(r"[\[\]:*?/\\]")
MISSING = (
    "workbooks need XlsxWriter, pip install 'tolstat[excel]'; or name a file that ends "
    "in .csv"
)


class Sheet(NamedTuple):
    """A sheet: a head above rows of numbers and texts."""

    name: str
    heads: Sequence[str]
    rows: Iterable[Sequence[Any]]


def workbook_of(sheets: Iterable[Sheet], created: str = "") -> bytes:
    """Return a workbook; the same sheets give the same bytes.

    Parameters
    ----------
    sheets : iterable of Sheet
        Infinite numbers are texts, NaN is an empty cell.
    created : str
        Time in ISO 8601 that it bears; empty for the beginning of 2000.

    Raises
    ------
    RunFileError
        If XlsxWriter is not installed.
    """
    try:
        import xlsxwriter
    except ImportError as error:
        raise RunFileError(MISSING) from error
    file, used = io.BytesIO(), set[str]()
    options = {"constant_memory": True, "strings_to_formulas": False, "in_memory": True}
    with xlsxwriter.Workbook(file, options) as book:
        time = datetime.datetime.fromisoformat(created or "2000-01-01")
        book.set_properties({"created": time.replace(tzinfo=None)})
        bold = book.add_format({"bold": True, "text_wrap": True, "valign": "top"})
        for sheet in sheets:
            page = book.add_worksheet(_name(sheet.name, used))
            _fill(page, sheet, bold)
    return file.getvalue()


def sheets_of_document(part: Document | Section, title: str = "") -> Iterator[Sheet]:
    """Yield the tables of a document, each as a sheet under its title or section."""
    title = part.title or title
    for block in part.blocks:
        if isinstance(block, Table):
            yield _sheet(block, block.title or title)
        elif isinstance(block, Section):
            yield from sheets_of_document(block, title)


def sheet_of_rows(name: str, rows: Sequence[Row]) -> Sheet:
    """Return the wide table of an answer as a sheet, in the units shown."""
    heads, cells = table_of_rows(rows) if rows else ([], [])
    return Sheet(name, heads, cells)


def _sheet(table: Table, name: str) -> Sheet:
    """Return a table as a sheet; the ends of intervals have columns of their own."""
    columns = [*zip(*table.rows, strict=True)]
    heads, filled = list[str](), list[list[Any]]()
    for column, cells in zip(table.columns, columns, strict=True):
        head = column.head.replace("\n", ", ")
        estimates = [_estimate(cell) for cell in cells]
        heads.append(head)
        filled.append([_plain(cell) for cell in cells])
        if any(estimate is not None and estimate.sure for estimate in estimates):
            for i, end in enumerate(("lower", "upper"), start=1):
                heads.append(f"{head} {end}")
                filled.append([
                    math.nan if estimate is None else estimate[i]
                    for estimate in estimates
                ])  # fmt: skip
    return Sheet(name, heads, [*zip(*filled, strict=True)])


def _estimate(cell: Cell) -> Estimate | None:
    """Return the estimate of a cell, in the unit shown; None for any other cell."""
    match cell.main:
        case (Number(value=Estimate() as value, scale=scale),):
            return value.times(scale.factor)
    return None


def _plain(cell: Cell) -> Any:
    """Return a cell as a number, in the unit shown, or as text."""
    first = cell.main[0] if cell.main and not any(cell.main[1:]) else None
    if isinstance(first, Number) and not isinstance(first.value, Estimate):
        whole = isinstance(first.value, int)
        return first.value if whole else first.scale.factor * first.value
    if (estimate := _estimate(cell)) is not None and not math.isnan(estimate.value):
        return estimate.value
    return "; ".join(filter(None, (as_text(cell.main), as_text(cell.below))))


def _name(name: str, used: set[str]) -> str:
    """Return a name that a sheet may have, and that no other one has."""
    plain = _FORBIDDEN.sub(" ", visible(name)).strip(" '")[:LONGEST_NAME] or "table"
    unique, number = plain, 2
    while unique.casefold() in used:
        mark = f" {number}"
        unique, number = plain[: LONGEST_NAME - len(mark)] + mark, number + 1
    used.add(unique.casefold())
    return unique


def _fill(page: Any, sheet: Sheet, bold: Any) -> None:
    """Write a sheet row by row; its first rows say how wide its columns are."""
    rows = iter(sheet.rows)
    first = [*islice(rows, LOOKED_AT)]
    least, most = WIDTHS
    for column, head in enumerate(sheet.heads):
        texts = (f"{row[column]}" for row in first if isinstance(row[column], str))
        longest = max(map(len, (head, *texts)), default=0)
        page.set_column(column, column, min(max(least, longest + 1), most))
    page.freeze_panes(1, 0)
    for column, head in enumerate(sheet.heads):
        page.write_string(0, column, visible(head), bold)
    for number, row in enumerate(chain(first, rows), start=1):
        for column, value in enumerate(row):
            _write(page, number, column, value)


def _write(page: Any, row: int, column: int, value: Any) -> None:
    """Write a value: a text is never a formula, NaN an empty cell."""
    if isinstance(value, str):
        if value:
            page.write_string(row, column, visible(value)[:LONGEST_TEXT])
    elif isinstance(value, bool):
        page.write_boolean(row, column, value)
    elif math.isinf(value):
        page.write_string(row, column, "inf" if value > 0 else "-inf")
    elif not math.isnan(value):
        page.write_number(row, column, value)
