"""Points of a publication or a measurement, shown beside a swept response."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import DataError, allowed_names
from tolstat.model.description import Description
from tolstat.study.csv_table import read_csv
from tolstat.study.given_points import Swept
from tolstat.units.conversion import to_si


def read_reference(
    given: dict[str, Any],
    swept: tuple[Swept, ...],
    description: Description,
    folder: Path | None,
) -> tuple[str, dict[str, NDArray[np.float64]]]:
    """Read the section [reference]: its label, and the columns of its points, SI.

    The first column is swept, the others are responses, or swept too where the grid has
    several axes, each with its unit in the head.
    """
    for key in ("data", "label"):
        if not isinstance(given.get(key), str):
            raise DataError(f"the key {key} is missing, or no text")
    if unknown := [key for key in given if key not in ("data", "label")]:
        raise DataError(f"no key {unknown[0]}; allowed: data, label")
    table = read_csv(folder, given["data"])
    units = {axis.name: axis.unit for axis in swept if axis.words is None}
    if table.heads[0] not in units:
        raise DataError(
            f"{table.path}: the first column, '{table.heads[0]}', is to be swept by "
            f"[grid]; {allowed_names(table.heads[0], units)}"
        )
    responses = {each.name: each.unit for each in description.responses}
    columns = {}
    for place, (head, written) in enumerate(zip(table.heads, table.units, strict=True)):
        known = {**units, **responses} if place else units
        if head not in known:
            raise DataError(
                f"{table.path}, column {head}: {allowed_names(head, known)}"
            )
        unit = "" if written == "1" else written
        try:
            factor = to_si(1.0, unit, known[head])
        except ValueError as error:
            raise DataError(f"{table.path}, column {head}: {error}") from None
        columns[head] = np.array(table.column(head)) * factor
    return given["label"], columns
