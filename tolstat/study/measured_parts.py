"""Measured parts of a contributor: { data = "rods.csv", column = ..., unit = ... }."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tolstat.deviations.distributions import Distribution
from tolstat.deviations.measured import DOUBTFUL, Fitted, Measured, fit
from tolstat.errors import DataError
from tolstat.study.csv_table import read_csv
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.study_schema import PartsEntry, read_entry
from tolstat.units.scale import Scale, scale_of


class Parts(NamedTuple):
    """Measured parts."""

    distribution: Distribution  # of their deviations, SI
    note: str  # for the summary of the run
    written: str  # unit in which they are given
    # mean and sigma of the fitted distribution, in that unit; empty without one
    fitted: str = ""


def read_parts(
    keys: dict[str, Any], reader: DeviationReader, folder: Path | None
) -> Parts:
    """Return measured parts from a CSV file.

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
    if entry.fit is None:
        return Parts(Measured(parts), f"{source}, all equally likely", written)
    fitted: Fitted = fit(parts, entry.fit)
    warning = ": doubtful" if fitted.p_value < DOUBTFUL else ""
    words = _fitted_in_words(fitted, scale_of(contributor.unit, written))
    return Parts(
        fitted,
        f"{entry.fit} distribution fitted to {source}, {words}, Anderson-Darling p = "
        f"{fitted.p_value:.3g}{warning}",
        written,
        words,
    )


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
