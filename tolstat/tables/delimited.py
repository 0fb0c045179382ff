"""Rows of a text: CSV with any separator, lines above its head, remarks."""

import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from tolstat.errors import DataError
from tolstat.tables.cell_units import is_unit
from tolstat.tables.encodings import UTF_8, text_of_data
from tolstat.tables.grid import Grid, Head, Row
from tolstat.tables.heads import head_of
from tolstat.tables.numerals import COMMA, Proof, is_torn, proof
from tolstat.tables.raw_file import RawFile

LONGEST_CELL = 1000  # characters
SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "vertical bars", ",": "commas"}
BLANKS = "blanks"
NONE = "\x1f"  # in no line of a text
TYPED = {"tab": "\t", "\\t": "\t", "space": " "}
_END = re.compile(r"end|ende|eof|end of file|\(.*\)|[-=*_]+", re.IGNORECASE)
_EXCEL = re.compile(r'"?sep=(.)"?\s*')  # as Excel begins a file

Lines = Sequence[tuple[int, str]]  # with their numbers


class Split(NamedTuple):
    """The rows of a text by a separator."""

    separator: str
    rows: list[Row]
    width: int  # the usual number of cells of a row
    head: Head | None  # among the rows of this width


def usual_width(rows: Sequence[Row]) -> int:
    """Return the most frequent number of cells; of equally frequent ones the larger."""
    counts = Counter(len(row.cells) for row in rows)
    return max(counts, key=lambda width: (counts[width], width))


def read_delimited(file: RawFile) -> Grid:
    """Return the rows of a text from its head on; `#` begins a remark.

    The last remark above the numbers may be the head.

    Raises
    ------
    DataError
        If there is no head above numbers, columns may be separated in two ways, or a
        row has more or fewer cells than its head.
    """
    path, delimiter = file.path, file.form.delimiter
    decoded = text_of_data(path, file.raw, file.form.encoding)
    filled = [
        (number, line)
        for number, line in enumerate(decoded.text.split("\n"), start=1)
        if line.strip()
    ]
    lines = [line for line in filled if not line[1].lstrip().startswith("#")]
    if lines and (first := _EXCEL.fullmatch(lines[0][1])):
        delimiter = delimiter or first[1]
        del lines[0]
    if len(lines) < 2:
        raise DataError(f"{path} is empty: a head and a row of numbers are expected")
    delimiter = TYPED.get(delimiter, delimiter)
    split = _split(file, lines, delimiter)
    remarks = filled[: filled.index(lines[0])]
    if split.head is None and remarks:
        number, remark = remarks[-1]
        lines = [(number, remark.lstrip("# \t")), *lines]
        split = _split(file, lines, delimiter)
    separator, rows, head = split.separator, split.rows, split.head
    usual = [row for row in rows if len(row.cells) == split.width]
    if head is None:
        _refuse_short_head(path, split)
        raise DataError(
            f"{path}: no head above numbers was found; above each column of numbers a "
            'name is expected. Where blanks separate columns, give delimiter = "space"'
        )
    first_line = usual[head.position].line
    table = [row for row in rows if row.line >= first_line]
    below = 0
    while split.width > 1 and len(cells := table[-1].cells) == 1:
        if not _END.fullmatch(str(cells[0])):
            break
        del table[-1]
        below += 1
    for row in table:
        if len(row.cells) != split.width:
            hint = "; is a comma its decimal sign? Use points" * (
                separator == COMMA and len(row.cells) > split.width
            )
            raise DataError(
                f"{path}, line {row.line}: {len(row.cells)} cells under {split.width} "
                f"heads{hint}"
            )
    _check_decimal_comma(file, split, table)
    skipped = len(rows) - len(table) - below
    words = [SEPARATORS.get(separator, f"'{separator}' between columns")]
    if separator in (NONE, " "):
        words = ["one column" if separator == NONE else BLANKS]
    outside = [
        f"{count} line{'s' * (count > 1)} {place}"
        for count, place in ((skipped, "skipped"), (below, "below skipped"))
        if count
    ]
    return Grid(
        path, file.digest, table, head,
        separator="" if separator == NONE else separator,
        words=(*words, decoded.encoding, *outside),
        plain=separator in (COMMA, NONE) and decoded.encoding == UTF_8 and not outside,
    )  # fmt: skip


def _split(file: RawFile, lines: Lines, delimiter: str) -> Split:
    """Return the rows by the separator that fits, or the typed one."""
    if delimiter:
        if len(delimiter) != 1:
            raise DataError(
                f'delimiter = "{delimiter}": one character is expected, or "tab" or '
                '"space"'
            )
        return _by(file, lines, delimiter)
    used = [sign for sign in SEPARATORS if any(sign in line for _, line in lines)]
    splits = [_by(file, lines, sign) for sign in used]
    fits = [split for split in splits if split.width > 1 and split.head]
    strong = [split for split in fits if split.separator != COMMA]
    if len(strong) > 1:
        names = " or ".join(SEPARATORS[split.separator] for split in strong)
        raise DataError(
            f"{file.path}: columns may be separated by {names}; give delimiter = "
            f'"{strong[0].separator}"'.replace("\t", "tab")
        )
    if fits:
        return (strong or fits)[0]
    several = [split for split in splits if split.width > 1]
    alone = _by(file, lines, NONE)
    return alone if alone.head or not several else several[0]


def _refuse_short_head(path: Path, split: Split) -> None:
    """Refuse a row before the first usual one that has one cell less."""
    first = next(i for i, row in enumerate(split.rows) if len(row.cells) == split.width)
    above = split.rows[first - 1] if first else None
    if above and len(above.cells) == split.width - 1 > 0:
        comma = " (or is a comma its decimal sign?)" * (split.separator == COMMA)
        raise DataError(
            f"{path}, line {above.line}: {split.width - 1} heads above {split.width} "
            f"columns{comma}; add the head that is missing. R leaves out that of the "
            "names of rows: write with col.names = NA"
        )


def _by(file: RawFile, lines: Lines, separator: str) -> Split:
    """Return the rows by one separator."""
    rows = [*_rows(file.path, lines, separator)]
    width = usual_width(rows)
    usual = [row for row in rows if len(row.cells) == width]
    return Split(separator, rows, width, head_of(usual, file.requested))


def _rows(path: Path, lines: Lines, separator: str) -> Iterator[Row]:
    """Yield rows with the number of the line in which they begin; refuse long cells."""
    if separator == " ":
        for number, line in lines:
            words = re.findall(r'"[^"]*"|\S+', line)
            yield Row(number, [word.strip('"') for word in words])
        return
    reader = csv.reader((f"{line}\n" for _, line in lines), delimiter=separator)
    begun = 0
    while True:
        try:
            cells = next(reader, None)
        except csv.Error as error:
            raise DataError(f"{path}, line {lines[begun][0]}: {error}") from None
        if cells is None:
            return
        cells = [cell.strip() for cell in cells]
        if (longest := max(map(len, cells), default=0)) > LONGEST_CELL:
            raise DataError(
                f"{path}, line {lines[begun][0]}: a cell has {longest} characters; at "
                f"most {LONGEST_CELL} are allowed"
            )
        if any(cells):
            yield Row(lines[begun][0], [*cells])
        begun = reader.line_num


def _check_decimal_comma(file: RawFile, split: Split, table: Sequence[Row]) -> None:
    """Refuse commas that are either a decimal sign or a separator."""
    assert split.head
    body = [row.cells for row in table[split.head.body - split.head.position :]]
    texts = [[str(cell) for cell in cells] for cells in body]
    either = False
    if split.separator == NONE and not file.form.decimal:
        either = any(
            proof(cells[0]) is Proof.COMMA or "," in cells[0] for cells in texts
        )
    second = split.head.names[-1]  # "length, mm" is one head
    if split.separator == COMMA and split.width == 2 and is_unit(second) and second[1:]:
        either = all(is_torn(*pair) for pair in texts)
    if either:
        example = ",".join(texts[0])
        raise DataError(
            f"{file.path}: '{example}' may be one number with a decimal comma, or two "
            'columns; give decimal = "," or delimiter = ","'
        )
