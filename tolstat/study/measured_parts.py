"""Measured parts of a contributor: their file becomes a distribution."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tolstat.deviations.distributions import Distribution, Tolerance
from tolstat.deviations.measured import DOUBTFUL, Fitted, InOrder, Measured, fit
from tolstat.study.data_files import (
    measured_file,
    source_words,
    torn_by_commas,
    unit_of_column,
)
from tolstat.study.distribution_entry import typed_tolerance
from tolstat.study.files import beside
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.repeated_rows import copied_parts
from tolstat.study.study_schema import PartsEntry, read_entry
from tolstat.tables.table import MeasuredColumn
from tolstat.units.conversion import to_si
from tolstat.units.scale import Scale, scale_of


class Parts(NamedTuple):
    """Measured parts."""

    distribution: Distribution  # of their deviations, SI
    written: str  # unit in which they are given
    # mean and sigma of the fitted distribution, in that unit; empty without one
    fitted: str
    in_order: InOrder


def read_parts(
    keys: dict[str, Any], reader: DeviationReader, folder: Path | None
) -> Parts:
    """Return measured parts from a file; the reader notes what they are.

    From `data` (the file), `column`; `unit`, if the file has none; `holds` ("sizes" or
    "deviations"), where both are possible; `nominal` (a quantity to subtract
    from sizes, where neither model nor file knows one); `fit` ("normal" or
    "lognormal"); how the file is written, where it does not tell.
    """
    entry = read_entry(PartsEntry, keys, "measured parts have")
    contributor = reader.contributor
    file = measured_file(beside(folder, entry.data), entry, (entry.column,))
    column = file.measured(entry.column, entry.lots or "")
    written = unit_of_column(column, entry.unit, "the study")
    nominal = entry.nominal
    if nominal is None and column.nominal:
        nominal = f"{column.nominal!r} {written}"
    sized = reader.with_nominal(nominal) if nominal is not None else reader
    holds = entry.holds or ("sizes" if sized is not reader else "")
    values, sizes = sized.column(column.numbers, written, holds, column.places)
    if torn := torn_by_commas(file, column.name):
        reader.warnings.append(
            f"{entry.data}: {torn} may be one number with a decimal comma, in two "
            "columns; if so, write it with a point"
        )
    if not entry.repeats and (
        copies := copied_parts(file, column.name, refuse_pasted=True)
    ):
        (row, first), more = copies[0], len(copies) - 1
        others = f"; {more} more rows repeat others" if more else ""
        reader.warnings.append(
            f"{row} has the same cells as {first}{others}: a copy counts twice; remove "
            "it"
        )
    written = "" if written == "1" else written
    parts = np.sort(values)
    reader.warnings += sized.warnings if sized is not reader else []
    source = f"{len(parts)} parts of {entry.data} ({source_words(column)})"
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
    order = np.empty(len(values), np.int64)
    order[np.argsort(values, kind="stable")] = np.arange(len(values))
    in_order = InOrder(
        order, column.lots, _tolerance(entry, sized, column, written),
        f"{entry.data}: {column.words}",
    )  # fmt: skip
    return Parts(fitted or Measured(parts), written, words, in_order)


def _tolerance(
    entry: PartsEntry, reader: DeviationReader, column: MeasuredColumn, written: str
) -> Tolerance:
    """Return the tolerance of the drawing as deviations, SI: typed, or of the file."""
    if zone := typed_tolerance({"tolerance": entry.tolerance}, reader):
        return zone
    unit = reader.contributor.unit
    lower, upper = (
        none if end is None else to_si(end - (column.nominal or 0.0), written, unit)
        for end, none in ((column.lower, -math.inf), (column.upper, math.inf))
    )
    return Tolerance(lower, upper)


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
