"""A table of a file: columns by name, their numbers, and how they were read."""

import math
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import DataError, UnitError, allowed_names
from tolstat.tables.cell_units import is_unit, split_cell
from tolstat.tables.grid import Cell, Grid, Head, Row, Unusable
from tolstat.tables.heads import (
    has_number,
    is_empty,
    is_number,
    split_head,
    summary_word,
    summary_words_at_end,
)
from tolstat.tables.no_value import numbers_of_codes, refuse_codes
from tolstat.tables.numerals import (
    COMMA,
    NAMES,
    POINT,
    Proof,
    number,
    proof,
    settled_decimal,
)
from tolstat.tables.raw_file import Form
from tolstat.units.conversion import same_unit


class MeasuredColumn(NamedTuple):
    """The measured values of one characteristic, as written."""

    path: Path
    name: str
    unit: str  # empty where the file has none
    numbers: tuple[float, ...]
    places: tuple[str, ...]  # file and row of each
    words: str  # how the file was read
    plain: bool  # whether these words go without saying
    digest: str  # SHA-256 of the file
    left_out: int = 0  # values that are missing or do not count
    # of the drawing, in the unit; None where the file has none
    nominal: float | None = None
    lower: float | None = None
    upper: float | None = None
    lots: tuple[str, ...] = ()  # the lot of each value; empty without lots
    sequence: bool = False  # whether the file says when each was measured


@dataclass(frozen=True)
class Table:
    """The table of a text or a sheet.

    Attributes
    ----------
    grid : Grid
        Its head, and its rows from there on.
    form : Form
        What the study says: cells with a code of `no_value` are empty here, and rows
        that are not of `only` are not read.
    """

    grid: Grid
    form: Form

    @property
    def head(self) -> Head:
        """Names and units of its columns."""
        return self.grid.head

    @property
    def path(self) -> Path:
        """Its file."""
        return self.grid.path

    @property
    def digest(self) -> str:
        """SHA-256 of its file."""
        return self.grid.digest

    @cached_property
    def columns(self) -> dict[str, int]:
        """The index of each column by its name; those without name are left out."""
        names = [(name, i) for i, name in enumerate(self.head.names) if name]
        columns = dict(names)
        if len(columns) < len(names):
            raise DataError(f"{self.path}: every column needs a different name")
        return columns

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column, by its name; empty where the file has none.

        It stands in the head, or in all cells that are not empty.
        """
        return {
            name: self.head.units[i] or self._unit_of_cells(i)
            for name, i in self.columns.items()
        }

    @cached_property
    def rows(self) -> list[Row]:
        """The rows below the head; refuse those of a summary."""
        if self.head.rival:
            head = self.grid.rows[0]
            raise DataError(
                f"{self.grid.row_place(self.head.rival)} may be the head, and line "
                f"{head.line} a row with a cell that is no number: "
                f"{', '.join(str(x) for x in head.cells if not has_number(x))}; "
                "correct the cell, or name a column"
            )
        rows = self.grid.rows[self.head.body - self.head.position :]
        rows = [row for row in rows if not all(map(is_empty, row.cells))]
        for name, word in self.form.only:
            index = self._index(name)
            words = [_text(row.cells[index]) for row in rows]
            rows = [row for row, text in zip(rows, words, strict=True) if text == word]
            if not rows:
                allowed = allowed_names(word, dict.fromkeys(words))
                raise DataError(
                    f"{self.path}, column {name} has no '{word}'; {allowed}"
                )
        at_end = summary_words_at_end(rows)
        for row in rows:
            if word := summary_word(row) or at_end.get(row.line, ""):
                raise DataError(
                    f"{self.grid.row_place(row.line)}: '{word}' names a row of a "
                    "summary or of the drawing, and not of a part; remove the row"
                )
        return rows

    @cached_property
    def places(self) -> list[str]:
        """File and row of each row."""
        return [self.grid.row_place(row.line) for row in self.rows]

    @property
    def numeric(self) -> list[str]:
        """The columns in which all cells that are not empty are numbers."""
        shares = self._shares_of_numbers
        return [name for name, share in shares.items() if share == 1.0]

    def names(self, lots: str = "") -> list[str]:
        """Return the columns of measured parts: those of numbers.

        Neither those that count 1, 2, 3 nor that of the lots. One with a word or
        another unit in it is among them: reading it names that cell.
        """
        shares = self._shares_of_numbers.items()
        names = [name for name, share in shares if share >= 0.5 and name != lots]
        return [name for name in names if not self.counts_rows(name)]

    @cached_property
    def _shares_of_numbers(self) -> dict[str, float]:
        """The share of numbers among the cells that are not empty, by column."""
        shares = {}
        for name, i in self.columns.items():
            filled = [r.cells[i] for r in self.rows if not is_empty(r.cells[i])]
            shares[name] = sum(map(has_number, filled)) / max(1, len(filled))
        return shares

    def _cells(self, index: int) -> list[Cell]:
        """Return the cells of a column, without a unit that all of them have."""
        cells = [row.cells[index] for row in self.rows]
        if self._unit_of_cells(index):
            cells = [split_cell(cell)[0] for cell in cells]
        return cells

    def _unit_of_cells(self, index: int) -> str:
        """Return the unit that all cells of a column have; empty without one."""
        units = self._units_in_cells[index]
        return next(iter(units)) if len(units) == 1 else ""

    @cached_property
    def _units_in_cells(self) -> list[Counter[str]]:
        """How often each unit or none stands beside numbers, of columns with units."""
        columns = range(len(self.head.names))
        split = ([split_cell(row.cells[i]) for row in self.rows] for i in columns)
        return [
            Counter(unit for x, unit in cells if is_number(x))
            if any(unit for _, unit in cells)
            else Counter()
            for cells in split
        ]

    @cached_property
    def decimal(self) -> str:
        """The decimal sign; empty where no number has one."""
        if self.form.decimal:
            return self.form.decimal
        cells = (cell for name in self.numeric for cell in self._texts(name))
        between_commas = self.grid.separator == COMMA
        return settled_decimal(cells, between_commas=between_commas)

    def _texts(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield the numbers of a column that are texts, each with its address."""
        index = self._index(name)
        for row, cell in zip(self.rows, self._cells(index), strict=True):
            if isinstance(cell, str) and not is_empty(cell):
                yield cell, self.grid.address(row.line, index, name)

    @property
    def words(self) -> str:
        """How it was read: "semicolons, decimal comma, 3 lines skipped"."""
        first, *rest = self.grid.words
        decimal = [NAMES[self.decimal]] if self.decimal else []
        only = [f"rows with {name} = {word}" for name, word in self.form.only]
        return ", ".join((first, *decimal, *rest, *only))

    @property
    def plain(self) -> bool:
        """Whether it goes without saying how it was read."""
        return self.grid.plain and not self.form.only and self.decimal in ("", POINT)

    def column(self, name: str, without: Collection[int] = ()) -> Array:
        """Return the numbers of a column, as written; refuse empty cells.

        Rows `without` one, by their index, are NaN.
        """
        numbers = self.numbers(name, without)
        self._refuse_codes(numbers, name)
        for i in np.flatnonzero(np.isnan(numbers)).tolist():
            if i not in without:
                cell = self.rows[i].cells[self._index(name)]
                raise DataError(f"{self._address(i, name)}: '{cell}' is not a number")
        return numbers

    def measured(self, name: str, lots: str = "") -> MeasuredColumn:
        """Return the measured values of a column; empty cells are left out."""
        numbers = self.numbers(name)
        self._refuse_codes(numbers, name)
        empty = np.isnan(numbers)
        if empty.all():
            raise DataError(f"{self.path}, column {name}: no number")
        if empty.any() and self.grid.doubtful:
            raise DataError(
                f"{self._address(int(empty.argmax()), name)} is empty, or an error "
                "that an XLS file hides; save the file as XLSX"
            )
        words = self.texts(lots) if lots else []
        for row, word in enumerate(words):
            if not word.isprintable():
                raise DataError(
                    f"{self._address(row, lots)}: a lot is a text without control "
                    "characters"
                )
        filled, left_out = np.flatnonzero(~empty).tolist(), int(empty.sum())
        head = self.head.names[self._index(name)]
        return MeasuredColumn(
            self.path,
            head,
            self.units[head],
            tuple(numbers[filled].tolist()),
            tuple(self.places[i] for i in filled),
            f"{self.words}, {left_out} empty" if left_out else self.words,
            plain=self.plain and not left_out,
            digest=self.digest,
            left_out=left_out,
            lots=tuple(words[i] for i in filled) if words else (),
        )

    def empty_rows(self, name: str) -> set[int]:
        """Return the rows without a value in a column, by their index."""
        index = self._index(name)
        return {i for i, row in enumerate(self.rows) if is_empty(row.cells[index])}

    def counts_rows(self, name: str) -> bool:
        """Return whether a column counts the rows: 1, 2, 3."""
        if name not in self.numeric:
            return False
        numbers = self.numbers(name)
        numbers = numbers[~np.isnan(numbers)]
        return len(numbers) > 1 and bool((np.diff(numbers) == 1).all())

    def texts(self, name: str) -> list[str]:
        """Return the cells of a column as texts."""
        index = self._index(name)
        return [_text(row.cells[index]) for row in self.rows]

    def _index(self, name: str) -> int:
        for typed in (name, split_head(name)[0]):  # with its unit
            if typed in self.columns:
                return self.columns[typed]
        allowed = allowed_names(name, self.columns)
        raise DataError(f"{self.path} has no column '{name}'; {allowed}")

    def _address(self, row: int, name: str) -> str:
        """Return file and address of a cell, by the index of its row."""
        return self.grid.address(self.rows[row].line, self._index(name), name)

    def numbers(self, name: str, without: Collection[int] = ()) -> Array:
        """Return the numbers of a column, as written, float64[row].

        NaN for empty cells, and for rows `without` one.
        """
        index = self._index(name)
        cells = self._cells(index)
        for i, cell in enumerate(cells):
            if is_number(cell) or is_empty(cell) or i in without:
                continue
            wrong = f"'{cell}' is"
            if split_cell(cell)[1]:
                self._refuse_units(index, name)
            if isinstance(cell, Unusable):
                wrong = f"{cell.text} is {cell.why}, and"
            raise DataError(f"{self._address(i, name)}: {wrong} not a number")
        if not self.form.decimal and any(
            self.decimal not in text and proof(text) is Proof.EITHER
            for text, _ in self._texts(name)
        ):  # thousands: another column may hold no numbers, such as 24.12 or 1.1
            settled_decimal(self._texts(name), source="column")
        head, unit = self.head.units[index], self._unit_of_cells(index)
        if head and unit and not (is_unit(head) and same_unit(head, unit)):
            raise DataError(
                f"{self.path}, column {name}: its cells are in {unit}, its head says "
                f"{head}; correct one"
            )
        numbers = [
            math.nan if i in without else self._number(cell, i, name)
            for i, cell in enumerate(cells)
        ]
        return np.array(numbers, np.float64)

    def _refuse_units(self, index: int, name: str) -> NoReturn:
        """Refuse a column whose cells have several units: the first unusual cell."""
        usual, _ = self._units_in_cells[index].most_common(1)[0]
        numbers = [row for row in self.rows if has_number(row.cells[index])]
        row = next(r for r in numbers if split_cell(r.cells[index])[1] != usual)
        others = f"the unit {usual}" if usual else "no unit"
        raise DataError(
            f"{self.grid.address(row.line, index, name)}: '{row.cells[index]}' is not "
            f"a number as the others, which have {others}; write the same unit in all "
            "cells, or in the head alone"
        )

    def _refuse_codes(self, numbers: Array, name: str) -> None:
        """Refuse a number that looks like a code for no value."""
        if self.form.no_value is None:
            filled = np.flatnonzero(~np.isnan(numbers))
            addresses = [self._address(i, name) for i in filled.tolist()]
            lines = [str(self.rows[i].line) for i in filled.tolist()]
            refuse_codes(numbers[filled], addresses, lines)

    def _number(self, cell: Cell, row: int, name: str) -> float:
        if isinstance(cell, float):
            return cell
        if not isinstance(cell, str) or is_empty(cell):
            return math.nan
        try:
            value = number(cell, self.decimal)
        except UnitError as error:
            address = self._address(row, name)
            raise DataError(f"{address}: '{cell}' is not a number ({error})") from None
        return math.nan if value in self._coded else value

    @cached_property
    def _coded(self) -> set[float]:
        return numbers_of_codes(self.form.no_value or ())


def _text(cell: Cell) -> str:
    return f"{cell:g}" if isinstance(cell, float) else str(cell).strip()
