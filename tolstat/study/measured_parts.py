"""Measured parts of a contributor: { data = "rods.csv", column = ..., unit = ... }."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tolstat.deviations.distributions import Distribution
from tolstat.deviations.measured import DOUBTFUL, FITS, Fitted, Measured, fit
from tolstat.errors import DataError, DistributionError, allowed_names
from tolstat.study.csv_table import read_csv
from tolstat.units.conversion import to_si
from tolstat.units.grammar import quantity

KEYS = ("data", "column", "unit", "nominal", "fit")


class Parts(NamedTuple):
    """Measured parts.

    Attributes
    ----------
    distribution : Distribution
        Of their deviations, SI.
    note : str
        What they are, for the summary of the run.
    written : str
        Unit in which they are given.
    """

    distribution: Distribution
    note: str
    written: str


def read_parts(keys: dict[str, Any], unit: str, folder: Path) -> Parts:
    """Read measured parts from a CSV file.

    Parameters
    ----------
    keys : dict
        `data` (the file), `column`; `unit`, if the head has none; `nominal` (a quantity
        to subtract, where the column holds sizes and not deviations); `fit` ("normal"
        or "lognormal").
    unit : str
        SI unit of the contributor.
    folder : Path
        Of the study.

    Returns
    -------
    Parts
        As measured, or fitted.

    Raises
    ------
    DataError, DistributionError, UnitError
        If the file, a key or a number is wrong.
    """
    for key, value in keys.items():
        if key not in KEYS:
            raise DistributionError(
                f"measured parts have no key {key}; {allowed_names(key, KEYS)}"
            )
        if not isinstance(value, str):
            raise DistributionError(f"{key}: a text is expected, in quotes")
    if "column" not in keys:
        raise DistributionError("the key column is missing")
    kind = keys.get("fit")
    if kind is not None and kind not in FITS:
        raise DistributionError(f"fit = '{kind}': {allowed_names(kind, FITS)}")
    table = read_csv(folder / keys["data"])
    head = dict(zip(table.heads, table.units, strict=True)).get(keys["column"], "")
    written = keys.get("unit", head)
    if head and head != written:
        raise DataError(
            f"{table.path} gives column {keys['column']} in {head}, the study in "
            f"{written}"
        )
    numbers, written = table.column(keys["column"]), "" if written == "1" else written
    values = [to_si(value, written, unit) for value in numbers]
    nominal = quantity(keys["nominal"], unit) if "nominal" in keys else 0.0
    parts = np.sort(np.array(values) - nominal)
    what = f"{len(parts)} parts of {keys['data']} (SHA-256 {table.digest[:12]})"
    if kind is None:
        return Parts(Measured(parts), f"{what}, each as likely as any other", written)
    fitted: Fitted = fit(parts, kind)
    doubt = ": doubtful" if fitted.p_value < DOUBTFUL else ""
    return Parts(
        fitted,
        f"{kind} distribution fitted to {what}, Anderson-Darling p = "
        f"{fitted.p_value:.3g}{doubt}",
        written,
    )
