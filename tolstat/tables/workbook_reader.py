"""Rows of a workbook: XLSX, XLSM, ODS and XLS, by python-calamine.

That library reads values; an error and a formula that was never calculated look empty
to it, and 0.5 % is 0.005. Such cells, and hidden rows, are read from the XML of XLSX
and ODS here.
"""

import datetime
import io
import posixpath
import re
import zipfile
from collections.abc import Collection, Iterator
from decimal import Decimal
from itertools import product
from typing import Any, NamedTuple
from xml.etree import ElementTree

from tolstat.errors import LONGEST_MESSAGE, DataError, allowed_names
from tolstat.regular_files import UNREADABLE_ARCHIVE
from tolstat.tables.grid import Cell, Grid, Quantity, Row, Unusable
from tolstat.tables.heads import head_of, is_empty
from tolstat.tables.raw_file import RawFile

ENDINGS = (".xlsx", ".xlsm", ".ods", ".xls")
MOST_UNPACKED = 256_000_000  # bytes of all files of a workbook
MOST_CELLS = 20_000_000
ZIP = b"PK\x03\x04"
NEVER = "a formula that was never calculated (save the file in a spreadsheet program)"
PERCENT = ("9", "10")  # numbers of Excel's own formats, 0 % and 0.00 %
_IN_QUOTES = re.compile(r'"[^"]*"|\\.|_.|\[[^\]]*\]')  # in a format: shown as it is
_ADDRESS = re.compile(r"([A-Z]{1,3})([0-9]{1,7})")


class Marks(NamedTuple):
    """What the XML of a sheet says beside its values; rows and columns from 0."""

    unusable: dict[tuple[int, int], Unusable]
    percent: set[tuple[int, int]]  # shown as 100 times their value
    hidden: set[int]  # rows
    cells: int  # of the smallest rectangle that holds all


def read_workbook(file: RawFile) -> Grid:
    """Return the rows of a sheet from its head on.

    Raises
    ------
    DataError
        If the file is no workbook, unpacks to too much, has several sheets with
        numbers and none is named, or python-calamine is not installed.
    """
    path, sheet = file.path, file.form.sheet
    try:
        import python_calamine as calamine
    except ImportError as error:
        raise DataError(
            f"{path}: workbooks need python-calamine, pip install 'tolstat[excel]'; or "
            "save the sheet as CSV"
        ) from error
    archive = _archive(file)
    try:
        book = calamine.CalamineWorkbook.from_filelike(io.BytesIO(file.raw))
        names = {part.name: part.visible for part in book.sheets_metadata}
        visible = calamine.SheetVisibleEnum.Visible
        shown = [name for name, seen in names.items() if seen == visible]
        if sheet and sheet not in names:
            allowed = allowed_names(sheet, names)
            raise DataError(f"{path} has no sheet '{sheet}'; {allowed}")
        chosen = {
            name: grid
            for name in ([sheet] if sheet else shown)
            if (grid := _sheet(file, archive, book, name))
        }
    except DataError:
        raise
    except (calamine.CalamineError, LookupError, SyntaxError, ValueError) as error:
        words = str(error)[:LONGEST_MESSAGE]
        raise DataError(f"{path} cannot be read as a workbook: {words}") from None
    if not chosen:
        which = f"sheet '{sheet}'" if sheet else "a visible sheet"
        raise DataError(
            f"{path}: no head above numbers was found in {which}; above each column of "
            "numbers a name is expected"
        )
    if len(chosen) > 1:
        several = ", ".join(f"'{name}'" for name in chosen)
        raise DataError(
            f"{path} has several sheets with numbers: {several}; give sheet = "
            f'"{next(iter(chosen))}"'
        )
    return next(iter(chosen.values()))


def _archive(file: RawFile) -> zipfile.ZipFile | None:
    """Return the files of XLSX and ODS, all of them as large as they say; else None."""
    path, raw = file.path, file.raw
    if not raw.startswith(ZIP):
        return None
    try:
        archive = zipfile.ZipFile(io.BytesIO(raw))
        size = sum(info.file_size for info in archive.infolist())
        if size > MOST_UNPACKED:
            raise DataError(
                f"{path} unpacks to {size / 1e6:.0f} MB; at most "
                f"{MOST_UNPACKED / 1e6:.0f} MB are allowed"
            )
        damaged = archive.testzip()  # reads no more of a file than its size
    except UNREADABLE_ARCHIVE as error:
        raise DataError(f"{path} cannot be read as a workbook: {error}") from None
    if damaged:
        raise DataError(f"{path} is damaged: {damaged}")
    return archive


def _sheet(
    file: RawFile, archive: zipfile.ZipFile | None, book: Any, name: str
) -> Grid | None:
    """Return the rows of a sheet; None if it has no head above numbers."""
    marks = _marks(archive, name) if archive else Marks({}, set(), set(), 0)
    if marks.cells > MOST_CELLS:
        raise DataError(
            f"{file.path}, {name}: {marks.cells} cells lie between the first and the "
            f"last; at most {MOST_CELLS} are allowed"
        )
    values = book.get_sheet_by_name(name).to_python(skip_empty_area=False)
    rows = [
        Row(
            i + 1,
            [
                marks.unusable.get((i, j)) or _cell(x, percent=(i, j) in marks.percent)
                for j, x in enumerate(cells)
            ],
        )
        for i, cells in enumerate(values)
    ]
    rows = [row for row in rows if not all(map(is_empty, row.cells))]
    if (head := head_of(rows, file.requested)) is None:
        return None
    table = rows[head.position :]
    lines = [row.line for row in table]
    hidden = [str(line) for line in lines if line - 1 in marks.hidden]
    words = [f"sheet {name}"]
    if head.position:
        words.append(f"{head.position} row{'s' * (head.position > 1)} skipped")
    if hidden:
        which = f"{', '.join(hidden[:5])}{', ...' * (len(hidden) > 5)}"
        words.append(f"hidden row{'s' * (len(hidden) > 1)} {which} not left out")
    return Grid(
        file.path, file.digest, table, head,
        sheet=name, words=tuple(words), doubtful=archive is None,
    )  # fmt: skip


def _cell(value: Any, *, percent: bool) -> Cell:
    """Return the value of a cell: a number, a text, or what is neither."""
    if isinstance(value, bool):
        return Unusable(str(value).upper(), "a truth value")
    if isinstance(value, int | float) and percent:
        return Quantity(float(100 * Decimal(repr(value))), "%")
    if isinstance(value, int | float):
        return float(value)
    if isinstance(value, str):
        return value.strip()
    kind = "a duration" if isinstance(value, datetime.timedelta) else "a date or a time"
    return Unusable(str(value), kind)


def _marks(archive: zipfile.ZipFile, sheet: str) -> Marks:
    """Return what the XML of a sheet says beside its values."""
    if "content.xml" in archive.namelist():
        with archive.open("content.xml") as file:
            return _marks_of_ods(file, sheet)
    part, recalculated = _part_of_xlsx(archive, sheet)
    with archive.open(part) as file:
        return _marks_of_xlsx(file, _percent_styles(archive), recalculated=recalculated)


def _part_of_xlsx(archive: zipfile.ZipFile, sheet: str) -> tuple[str, bool]:
    """Return the file of a sheet, and whether its formulas wait for a calculation."""
    book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
    relations = ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels"))
    targets = {part.get("Id"): part.get("Target", "") for part in relations}
    target, recalculated = "", False
    for element in book.iter():
        if _name(element) == "sheet" and element.get("name") == sheet:
            identity = next((v for k, v in element.items() if k.endswith("}id")), "")
            target = targets[identity]
        if _name(element) == "calcPr":
            recalculated = element.get("fullCalcOnLoad") in ("1", "true")
    return posixpath.normpath(posixpath.join("/xl", target)).lstrip("/"), recalculated


def _percent_styles(archive: zipfile.ZipFile) -> set[str]:
    """Return the numbers of the styles that show 100 times a value."""
    if "xl/styles.xml" not in archive.namelist():
        return set()
    styles, formats = ElementTree.fromstring(archive.read("xl/styles.xml")), {*PERCENT}
    for element in styles.iter():
        if _name(element) == "numFmt" and "%" in _IN_QUOTES.sub(
            "", element.get("formatCode", "")
        ):
            formats.add(element.get("numFmtId", ""))
    of_cells = next((part for part in styles if _name(part) == "cellXfs"), ())
    return {
        f"{number}"
        for number, style in enumerate(of_cells)
        if style.get("numFmtId") in formats
    }


def _marks_of_xlsx(
    file: Any, percent_styles: Collection[str], *, recalculated: bool
) -> Marks:
    """Return errors, formulas without value, percentages, hidden rows.

    Programs that cannot calculate write no value, or 0, and that all is to be
    calculated when the file is opened.
    """
    unusable, percent = dict[tuple[int, int], Unusable](), set[tuple[int, int]]()
    hidden: set[int] = set()
    last_row = last_column = -1
    for element in _elements(file, "row"):
        row = int(element.get("r", last_row + 2)) - 1
        last_row, column = max(last_row, row), -1
        if element.get("hidden") in ("1", "true"):
            hidden.add(row)
        for cell in element:
            address = _ADDRESS.fullmatch(cell.get("r", ""))
            column = _column(address[1]) if address else column + 1
            last_column = max(last_column, column)
            if cell.get("s") in percent_styles:
                percent.add((row, column))
            parts = {_name(part): part.text or "" for part in cell}
            value = parts.get("v", "")
            if cell.get("t") == "e":
                unusable[row, column] = Unusable(value, "an error")
            elif "f" in parts and (not value or (recalculated and _float(value) == 0)):
                unusable[row, column] = Unusable(f"={parts['f']}", NEVER)
    return Marks(unusable, percent, hidden, (last_row + 1) * (last_column + 1))


def _marks_of_ods(file: Any, sheet: str) -> Marks:
    """Return errors, formulas without value, percentages, hidden rows."""
    unusable, percent = dict[tuple[int, int], Unusable](), set[tuple[int, int]]()
    hidden: set[int] = set()
    last_row = last_column = -1
    for table in _elements(file, "table"):
        if _attribute(table, "name") != sheet:
            continue
        row = 0
        for element in table.iter():
            if _name(element) != "table-row":
                continue
            many = int(_attribute(element, "number-rows-repeated") or 1)
            if _attribute(element, "visibility") in ("collapse", "filter"):
                hidden.update(range(row, row + min(many, 10_000)))
            column = 0
            for cell in element:
                if not _name(cell).endswith("table-cell"):
                    continue
                wide = int(_attribute(cell, "number-columns-repeated") or 1)
                if len(cell) or _attribute(cell, "formula"):
                    last_row = max(last_row, row + many - 1)
                    last_column = max(last_column, column + wide - 1)
                    if (last_row + 1) * (last_column + 1) > MOST_CELLS:
                        break
                    places = product(
                        range(row, row + many), range(column, column + wide)
                    )
                    if mark := _mark_of_ods(cell):
                        unusable.update(dict.fromkeys(places, mark))
                    elif _attribute(cell, "value-type") == "percentage":
                        percent.update(places)
                column += wide
            row += many
    return Marks(unusable, percent, hidden, (last_row + 1) * (last_column + 1))


def _mark_of_ods(cell: ElementTree.Element) -> Unusable | None:
    """Return what makes a cell unusable; None for any other."""
    text = "".join(cell.itertext()).strip()
    kinds = {v for k, v in cell.items() if k.endswith("}value-type")}
    formula = _attribute(cell, "formula")
    if "error" in kinds or (formula and text.startswith(("#", "Err:"))):
        return Unusable(text, "an error")
    return Unusable(formula, NEVER) if formula and not kinds else None


def _elements(file: Any, name: str) -> Iterator[ElementTree.Element]:
    """Yield the elements of a name, and forget each one afterwards."""
    for _, element in ElementTree.iterparse(file):
        if _name(element) == name:
            yield element
            element.clear()


def _name(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _attribute(element: ElementTree.Element, name: str) -> str:
    return next((v for k, v in element.items() if k.rpartition("}")[2] == name), "")


def _column(word: str) -> int:
    """Return the index of a column by its letters, from 0."""
    index = 0
    for letter in word:
        index = 26 * index + ord(letter) - ord("A") + 1
    return index - 1


def _float(text: str) -> float:
    """Return a number, or NaN for any other text."""
    try:
        return float(text)
    except ValueError:
        return float("nan")
