"""A view as rows: on the screen, as CSV, as a page."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tolstat.model.view import Axis, View
from tolstat.units.scale import COUNT, Scale, scale_of


def _scaled(
    view: View,
) -> Iterator[tuple[str, Scale | None, NDArray[np.generic]]]:
    """Yield each column with how it is shown; None for words."""
    for axis, values in view.columns():
        if values.dtype.kind not in "fiu":
            yield axis.name, None, values
            continue
        yield axis.name, _scale(axis, values), values


def _scale(axis: Axis, values: NDArray[np.generic]) -> Scale:
    shown = axis.shown or (
        COUNT if values.dtype.kind in "iu" and axis.unit == "1" else ""
    )
    finite = np.abs(values[np.isfinite(values)])
    return scale_of(axis.unit, shown, float(finite.max()) if len(finite) else 0.0)


def view_rows(view: View) -> tuple[list[str], list[list[str]]]:
    """Write a view as text.

    Parameters
    ----------
    view : Chart or Listing
        Curves with points of their own are left out.

    Returns
    -------
    tuple of list
        Heads with their units, and rows.
    """
    heads, columns = [], []
    for name, scale, values in _scaled(view):
        heads.append(scale.label(name) if scale else name)
        columns.append([_cell(scale, value) for value in values.tolist()])
    return heads, [list(row) for row in zip(*columns, strict=True)]


def _cell(scale: Scale | None, value: float | str) -> str:
    if isinstance(value, str):
        return value
    return "" if value != value or scale is None else scale.number(value)


def as_csv(view: View) -> str:
    """Write a view as CSV, all figures, in the units that its heads name."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    columns = list(_scaled(view))
    writer.writerow(
        f"{name} [{scale.mark}]" if scale and scale.mark else name
        for name, scale, _ in columns
    )
    shown = [
        [v if s is None or s.factor == 1 else s.factor * v for v in values.tolist()]
        for _, s, values in columns
    ]
    writer.writerows(zip(*shown, strict=True))
    return buffer.getvalue()
