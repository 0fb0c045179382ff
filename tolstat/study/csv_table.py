"""CSV files beside a study: measured parts, trials, published points."""

import csv
import hashlib
import math
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.distributions import Distribution
from tolstat.deviations.measured import DOUBTFUL, Fitted, Measured, fit
from tolstat.errors import DataError, UnitError, allowed_names
from tolstat.study.files import as_text, beside, content
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.study_schema import PartsEntry, read_entry
from tolstat.units.conversion import to_si
from tolstat.units.grammar import bare_number
from tolstat.units.scale import Scale, scale_of

MOST_MEGABYTES = 32  # of a CSV file
LONGEST_CELL = 1000  # characters
ROWS = 5  # of a column: fewer tell nothing
_WHOLE = re.compile(r"[+-]?[0-9]+")
_HEAD = re.compile(r"(?P<name>.+?)\s*(?:\[(?P<unit>[^\]]*)\])?")


class CsvTable(NamedTuple):
    """A CSV file as text."""

    path: Path  # its file
    digest: str  # SHA-256 of its content
    units: dict[str, str]  # of each column, by its name; empty where the head has none
    lines: list[tuple[int, list[str]]]  # the rows, each with its line number

    @property
    def places(self) -> list[str]:
        """File and line of each row."""
        return [f"{self.path}, line {line}" for line, _ in self.lines]

    def torn_by_commas(self, name: str) -> str:
        """Return the text of a number that a decimal comma may tear in two columns.

        Whole numbers beside digits, as many in each row: 6,8 may be 6.8. Empty where a
        cell shows that it is a number of its own.
        """
        where, rows = [*self.units].index(name), [cells for _, cells in self.lines]
        for first in (where - 1, where):
            pairs = [cells[first : first + 2] for cells in rows] if first >= 0 else []
            if not pairs or not all(
                len(pair) == 2 and _WHOLE.fullmatch(pair[0]) and pair[1].isdigit()
                for pair in pairs
            ):
                continue
            if len(pairs) >= ROWS and len({len(pair[1]) for pair in pairs}) == 1:
                return ",".join(pairs[0])
        return ""

    def column(self, name: str) -> list[float]:
        """Return the numbers of a column, as written."""
        if name not in self.units:
            allowed = allowed_names(name, self.units)
            raise DataError(f"{self.path} has no column '{name}'; {allowed}")
        where = [*self.units].index(name)
        numbers = []
        for line, cells in self.lines:
            try:
                numbers.append(bare_number(cells[where]))
            except UnitError as error:
                raise DataError(
                    f"{self.path}, line {line}, column {name}: '{cells[where]}' is not "
                    f"a number ({error})"
                ) from None
        return numbers

    def values(self, name: str, unit: str) -> Array:
        """Return the numbers of a column, SI."""
        written = self.units[name]
        try:
            factor = to_si(1.0, "" if written == "1" else written, unit)
        except ValueError as error:
            raise DataError(f"{self.path}, column {name}: {error}") from None
        return np.array(self.column(name)) * factor


def read_csv(folder: Path | None, name: str) -> CsvTable:
    """Return a CSV file: commas between columns, a head, `#` before remarks.

    A head may carry its unit: `rod_length_1 [mm]`. At least one row is required.
    """
    path = beside(folder, name)
    raw = content(path, MOST_MEGABYTES)
    text = as_text(path, raw).removeprefix("sep=,\n")  # as Excel begins a file
    numbered = [
        (line, _cells(path, line, row))
        for line, row in enumerate(text.splitlines(), start=1)
        if row.strip() and not row.lstrip().startswith("#")
    ]
    if len(numbered) < 2:
        raise DataError(f"{path} is empty: a head and a row of numbers are expected")
    (_, head), *lines = numbered
    signs = {";": "semicolons", "\t": "tabs"}
    if len(head) == 1 and (
        other := [w for sign, w in signs.items() if sign in head[0]]
    ):
        raise DataError(
            f"{path} has {other[0]} between its columns; use commas, and points as "
            "decimal signs"
        )
    for line, cells in lines:
        if len(cells) != len(head):
            hint = "; is a comma its decimal sign? Use points" * (
                len(cells) > len(head)
            )
            raise DataError(
                f"{path}, line {line}: {len(cells)} cells under {len(head)} heads{hint}"
            )
    heads = filter(None, map(_HEAD.fullmatch, head))
    units = {match["name"]: (match["unit"] or "").strip() for match in heads}
    if len(units) < len(head):
        raise DataError(f"{path}: every column needs a different name")
    return CsvTable(path, hashlib.sha256(raw).hexdigest(), units, lines)


def _cells(path: Path, line: int, row: str) -> list[str]:
    """Return the cells of a row; refuse a cell that is too long."""
    try:
        cells = [cell.strip() for cell in next(csv.reader([row]))]
    except csv.Error as error:
        raise DataError(f"{path}, line {line}: {error}") from None
    if (longest := max(map(len, cells))) > LONGEST_CELL:
        raise DataError(
            f"{path}, line {line}: a cell has {longest} characters; at most "
            f"{LONGEST_CELL} are allowed"
        )
    return cells


class Parts(NamedTuple):
    """Measured parts."""

    distribution: Distribution  # of their deviations, SI
    written: str  # unit in which they are given
    # mean and sigma of the fitted distribution, in that unit; empty without one
    fitted: str = ""


def read_parts(
    keys: dict[str, Any], reader: DeviationReader, folder: Path | None
) -> Parts:
    """Return measured parts from a CSV file; the reader notes what they are.

    From `data` (the file), `column`; `unit`, if the head has none; `holds` ("sizes" or
    "deviations"), where both are possible; `nominal` (a quantity to subtract
    from sizes, where the model knows none); `fit` ("normal" or "lognormal").
    """
    entry = read_entry(PartsEntry, keys, "measured parts have")
    contributor = reader.contributor
    table = read_csv(folder, entry.data)
    head = table.units.get(entry.column, "")
    written = head if entry.unit is None else entry.unit
    if head and head != written:
        raise DataError(
            f"{table.path} gives column {entry.column} in {head}, the study in "
            f"{written}"
        )
    sized = reader.with_nominal(entry.nominal) if entry.nominal is not None else reader
    holds = entry.holds or ("sizes" if sized is not reader else "")
    numbers, places = table.column(entry.column), table.places
    values, sizes = sized.column(numbers, written, holds, places)
    if torn := table.torn_by_commas(entry.column):
        reader.warnings.append(
            f"{table.path}: {torn} may be one number with a decimal comma, in two "
            "columns; if so, write it with a point"
        )
    written = "" if written == "1" else written
    parts = np.sort(values)
    reader.warnings += sized.warnings if sized is not reader else []
    source = f"{len(parts)} parts of {entry.data} (SHA-256 {table.digest[:12]})"
    if sizes:
        source = f"sizes of {source}"
    fitted: Fitted | None = fit(parts, entry.fit) if entry.fit else None
    words, note = "", f"{source}, all equally likely"
    if fitted:
        words = _fitted_in_words(fitted, scale_of(contributor.unit, written))
        warning = ": doubtful" if fitted.p_value < DOUBTFUL else ""
        note = (
            f"{entry.fit} distribution fitted to {source}, {words}, Anderson-Darling "
            f"p = {fitted.p_value:.3g}{warning}"
        )
    reader.notes.append(f"{contributor.name}: {note}")
    return Parts(fitted or Measured(parts), written, words)


def _fitted_in_words(fitted: Fitted, scale: Scale) -> str:
    """Return mean and sigma of the deviations, not only of their logarithms."""
    if fitted.kind == "normal":
        return f"mean {scale.words(fitted.mean)}, sigma {scale.words(fitted.sigma)}"
    variance = fitted.sigma**2
    mean = math.exp(fitted.mean + variance / 2)
    sigma = mean * math.sqrt(math.expm1(variance))
    return (
        f"mean {scale.words(mean)}, sigma {scale.words(sigma)}, "
        f"median {scale.words(math.exp(fitted.mean))}, "
        f"sigma of the natural logarithm {fitted.sigma:.4g}"
    )
