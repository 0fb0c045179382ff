"""Cells in rows and columns under a head, with their places, before they are read."""

from pathlib import Path
from typing import NamedTuple


class Unusable(NamedTuple):
    """A cell of a workbook that is neither a number nor a text."""

    text: str  # as it is shown
    why: str  # it is no number

    def __str__(self) -> str:
        return self.text


class Quantity(NamedTuple):
    """A number of a workbook that its cell shows with a unit: 0.005 as 0.5 %."""

    number: float  # in that unit
    unit: str

    def __str__(self) -> str:
        return f"{self.number:.15g} {self.unit}"


# a float is a number that a program wrote as one
Cell = str | float | Unusable | Quantity


class Row(NamedTuple):
    """A row, and its number in the file, from 1."""

    line: int
    cells: list[Cell]


class Head(NamedTuple):
    """The head of a table."""

    position: int  # of its row
    body: int  # index of the first row of numbers
    names: tuple[str, ...]  # of the columns, without their units; empty for none
    units: tuple[str, ...]  # empty where there is none
    rival: int = 0  # line of a row above that may be the head, too; 0 for none


class Grid(NamedTuple):
    """The rows of a file or a sheet, from the head on."""

    path: Path
    digest: str  # SHA-256 of the file
    rows: list[Row]
    head: Head
    sheet: str = ""  # of a workbook
    separator: str = ""  # between columns of a text; empty for one column
    # how it was read, in words: separator, encoding, hidden rows
    words: tuple[str, ...] = ()
    plain: bool = False  # whether these words go without saying
    # whether an empty cell may be an error that the format does not tell
    doubtful: bool = False
    counted: str = "line"  # what the numbers of its rows count

    def row_place(self, line: int) -> str:
        """Return file and line."""
        if self.sheet:
            return f"{self.path}, {self.sheet}, row {line}"
        return f"{self.path}, {self.counted} {line}"

    def address(self, line: int, column: int, name: str) -> str:
        """Return file and address of a cell; of a text line and column."""
        if self.sheet:
            return f"{self.path}, {self.sheet}!{letters(column)}{line}"
        return f"{self.row_place(line)}, column {name}"


def letters(column: int) -> str:
    """Return the letters of a column of a workbook, from 0.

    Examples
    --------
    >>> letters(0), letters(25), letters(26)
    ('A', 'Z', 'AA')
    """
    words = ""
    column += 1
    while column:
        column, rest = divmod(column - 1, 26)
        words = chr(ord("A") + rest) + words
    return words
