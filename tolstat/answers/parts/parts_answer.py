"""The answer about a file of measured parts, without a study."""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tolstat.answers.answer import Answer
from tolstat.answers.parts.judged_parts import JudgedParts, Sample, judged_parts
from tolstat.answers.parts.parts_cells import parts_cells
from tolstat.document.inline import Row
from tolstat.errors import DataError, DistributionError, GradeError, UnitError
from tolstat.model.description import Contributor
from tolstat.statistics.capability import Tolerance
from tolstat.study.data_files import measured_file, unit_of_column
from tolstat.study.distribution_entry import typed_tolerance
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.repeated_rows import copied_parts
from tolstat.study.study_schema import PartsEntry, read_entry
from tolstat.tables.table import MeasuredColumn
from tolstat.units.conversion import dimension, si_unit, to_si
from tolstat.units.grammar import SIDES, limit, quantity, refuse_two_signs, unit_of
from tolstat.units.scale import PLAIN, Scale

MOST_COLUMNS = 40  # of a file, of which none is named


@dataclass(frozen=True, repr=False)
class PartsAnswer(Answer):
    """Measured parts of a file, each characteristic against its tolerance.

    Attributes
    ----------
    file : str
        The file.
    characteristics : mapping of str to JudgedParts
        By name of a column or a characteristic.
    """

    file: str
    characteristics: Mapping[str, JudgedParts]
    answers = "parts"
    index = "characteristic"

    @property
    def _short(self) -> str:
        counts = (
            f"{name} {part.capability.parts}"
            for name, part in self.characteristics.items()
        )
        return f"{self.file}; {', '.join(counts)}"

    def rows(self) -> Sequence[Row]:
        """Return a row for each characteristic."""
        return [
            {"characteristic": name, **parts_cells(part)}
            for name, part in self.characteristics.items()
        ]


def parts(
    path: str | os.PathLike[str],
    columns: Sequence[str] = (),
    *,
    tolerance: str = "",
    nominal: str = "",
    lots: str = "",
    **keys: Any,
) -> PartsAnswer:
    """Return measured parts of a file, judged against the tolerance of their drawing.

    Parameters
    ----------
    path : path
        A text such as CSV, a workbook, or a Q-DAS file.
    columns : sequence of str
        Columns or characteristics; by default all with numbers.
    tolerance : str
        Such as "+-0.05 mm" about the nominal, "19.98..20.02 mm" or "<= 6.3 um". A
        Q-DAS file has its own.
    nominal : str
        Such as "20 mm".
    lots : str
        The column that names the lot of each part.
    **keys
        `unit`, and how the file is written: `decimal`, `delimiter`, `encoding`,
        `sheet`, `part`, `no_value`, as in a study.

    Returns
    -------
    PartsAnswer
        `save` writes its page (.html), its numbers (.json) or its table (.csv).

    Raises
    ------
    DataError
        If the file cannot be read, or in two ways.

    Examples
    --------
    >>> found = tolstat.parts("runs/rods.csv", ["length"], unit="mm",
    ...                       nominal="2450 mm", tolerance="+-1.2 mm")
    >>> found.frame()["Ppk"]["length"].round(2).item()
    1.04
    """
    typed = {"data": str(path), "column": "", **keys}
    entry = read_entry(PartsEntry, typed, "measured parts have")
    file = measured_file(Path(path), entry, columns)
    refuse_two_signs(nominal, tolerance)
    names = list(columns) or file.names(lots)
    if not names or len(names) > MOST_COLUMNS:
        raise DataError(
            f"{path} has {len(names)} columns of numbers; name those of measured parts"
        )
    try:
        measured = [file.measured(name, lots) for name in names]
    except DataError as error:
        alone = columns or len(names) == 1
        hint = "" if alone else "; or name the columns that have measured parts"
        raise DataError(f"{error}{hint}") from None
    judged = {
        column.name: _judged(
            column, tolerance, nominal, entry.unit, copied_parts(file, column.name)
        )
        for column in measured
    }
    return PartsAnswer(str(path), judged)


def _judged(
    column: MeasuredColumn,
    tolerance: str,
    nominal: str,
    typed: str | None,
    copies: Sequence[tuple[str, str]],
) -> JudgedParts:
    """Return a column, judged by what is typed, or else by what its file tells."""
    unit = unit_of_column(column, typed, "the key unit")
    with _naming("nominal and tolerance", nominal, tolerance):
        units = (unit_of(text) for text in (nominal, tolerance) if text)
        unit = unit or next(units, PLAIN)
    si = si_unit(dimension(unit))
    factor = to_si(1.0, unit, si)
    with _naming("nominal", nominal):
        size = quantity(nominal, si) if nominal else None
    if size is None and column.nominal is not None:
        size = factor * column.nominal
    contributor = Contributor(column.name, si, size=size)
    with _naming("tolerance", tolerance):
        zone = _tolerance(column, tolerance, contributor, factor)
    sample = Sample(
        factor * np.array(column.numbers),
        zone,
        nominal=np.nan if size is None else size,
        lots=column.lots,
        places=column.places,
        written=column.numbers,
        copies=copies,
        unit=factor,
    )
    return judged_parts(sample, Scale(si, unit), f"{column.path.name}: {column.words}")


@contextmanager
def _naming(key: str, *texts: str) -> Iterator[None]:
    """Name what was typed in what is wrong with it."""
    try:
        yield
    except (UnitError, DistributionError, GradeError) as error:
        typed = ", ".join(f'"{text}"' for text in texts if text)
        raise DataError(f"{key} = {typed}: {error}") from None


def _tolerance(
    column: MeasuredColumn, typed: str, contributor: Contributor, factor: float
) -> Tolerance:
    """Return the typed tolerance, or that of the file, as permitted values, SI."""
    if typed.strip().startswith(SIDES):
        return Tolerance(*limit(typed, contributor.unit))
    reader = DeviationReader(contributor)
    if zone := typed_tolerance({"tolerance": typed or None}, reader):
        size = contributor.size or 0.0
        numbers = factor * np.array(column.numbers)
        if np.median(np.abs(numbers)) < np.median(np.abs(numbers - size)):
            size = 0.0  # the column holds deviations
            if wrong := reader.other_unit(numbers):
                raise DataError(f"{column.path}: {wrong}")
        return Tolerance(size + zone.lower, size + zone.upper)
    return Tolerance(
        -np.inf if column.lower is None else factor * column.lower,
        np.inf if column.upper is None else factor * column.upper,
    )
