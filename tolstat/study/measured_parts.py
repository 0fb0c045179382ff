"""Measured parts of a contributor: { data = "rods.csv", column = ..., unit = ... }."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.distributions import Distribution
from tolstat.deviations.measured import DOUBTFUL, Fitted, Measured, fit
from tolstat.errors import DataError, DistributionError
from tolstat.model.description import Contributor
from tolstat.study.csv_table import read_csv
from tolstat.study.study_schema import PartsEntry, read_entry
from tolstat.units.conversion import to_si
from tolstat.units.grammar import quantity
from tolstat.units.scale import Scale, scale_of

PART_OF_SIZE = 0.5  # of its nominal size: half of the parts cannot deviate so much
FAR = 10  # times their spread away from zero: the values may be sizes


class Parts(NamedTuple):
    """Measured parts."""

    distribution: Distribution  # of their deviations, SI
    note: str  # for the summary of the run
    written: str  # unit in which they are given
    # mean and sigma of the fitted distribution, in that unit; empty without one
    fitted: str = ""


def read_parts(
    keys: dict[str, Any], contributor: Contributor, folder: Path | None
) -> Parts:
    """Return measured parts from a CSV file.

    From `data` (the file), `column`; `unit`, if the head has none; `nominal` (a
    quantity to subtract, where the column holds sizes and not deviations); `fit`
    ("normal" or "lognormal").
    """
    entry = read_entry(PartsEntry, keys, "measured parts have")
    table = read_csv(folder, entry.data)
    head = table.units.get(entry.column, "")
    written = head if entry.unit is None else entry.unit
    if head and head != written:
        raise DataError(
            f"{table.path} gives column {entry.column} in {head}, the study in "
            f"{written}"
        )
    numbers, written = table.column(entry.column), "" if written == "1" else written
    values = [to_si(value, written, contributor.unit) for value in numbers]
    nominal = (
        quantity(entry.nominal, contributor.unit) if entry.nominal is not None else 0.0
    )
    parts = np.sort(np.array(values) - nominal)
    _refuse_sizes(parts, entry, contributor, written)
    hint = "" if nominal else _hint_at_sizes(parts, contributor, written)
    what = f"{len(parts)} parts of {entry.data} (SHA-256 {table.digest[:12]})"
    if entry.fit is None:
        note = f"{what}, all equally likely"
        return Parts(Measured(parts), note + hint, written)
    fitted: Fitted = fit(parts, entry.fit)
    warning = ": doubtful" if fitted.p_value < DOUBTFUL else ""
    words = _fitted_in_words(fitted, scale_of(contributor.unit, written))
    return Parts(
        fitted,
        f"{entry.fit} distribution fitted to {what}, {words}, Anderson-Darling p = "
        f"{fitted.p_value:.3g}{warning}{hint}",
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


def _refuse_sizes(
    parts: Array, entry: PartsEntry, contributor: Contributor, written: str
) -> None:
    """Refuse values if half of them deviate by half the nominal size or more."""
    size = contributor.size
    if not size or np.median(np.abs(parts)) < PART_OF_SIZE * size:
        return
    scale = scale_of(contributor.unit, written)
    less = f" less nominal = '{entry.nominal}'" if entry.nominal else ""
    raise DistributionError(
        f"column {entry.column}{less} goes {_from_to(parts, scale)}, but "
        f"{contributor.name} is nominally {scale.factor * size:g} {scale.mark}: "
        "these are too large for deviations; if they are sizes, give the nominal to "
        f'subtract, nominal = "{scale.factor * size:g} {scale.mark}"'
    )


def _hint_at_sizes(parts: Array, contributor: Contributor, written: str) -> str:
    """Return a hint if parts without a known nominal size look like sizes."""
    off = np.abs(parts).min()
    one_sided = parts[0] * parts[-1] > 0
    if contributor.size or not one_sided or off < FAR * np.ptp(parts):
        return ""
    scale = scale_of(contributor.unit, written)
    return (
        f"; they go {_from_to(parts, scale)}, far from zero for their spread: if these "
        "are sizes and not deviations, give nominal"
    )


def _from_to(parts: Array, scale: Scale) -> str:
    """Return the range of parts in words; six figures separate sizes."""
    least, largest = scale.factor * parts[0], scale.factor * parts[-1]
    return f"from {least:.6g} to {largest:.6g} {scale.mark}".rstrip()
