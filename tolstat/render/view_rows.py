"""A view as rows of numbers: for tables, as CSV."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tolstat.document.inline import Number
from tolstat.model.view import Band, Chart, Curve, Region, View
from tolstat.render.serialize import csv_text
from tolstat.units.scale import COUNT, PLAIN, Scale, scale_of

Scaled = tuple[str, Scale | None, NDArray[np.generic]]


def _scaled(view: View) -> Iterator[Scaled]:
    """Yield each column with how it is shown; None for words."""
    if isinstance(view, Chart):
        own = [curve.at is not None for curve in view.curves]
        if view.regions or any(own):
            yield from _long(view)
            return
    columns = list(view.columns())
    for axis, values in columns:
        if values.dtype.kind not in "fiu":
            yield axis.name, None, values
            continue
        # a curve and the edges of its band, in one unit
        alike = [v for a, v in columns[1:] if a.unit == axis.unit]
        chart = isinstance(view, Chart) and axis is not columns[0][0]
        scale = view_scale(axis.unit, axis.shown, *(alike if chart else [values]))
        yield axis.name, scale, values


def _long(chart: Chart) -> Iterator[Scaled]:
    """Yield what shares no points as rows of name, place, value, unit."""
    scales = {}
    drawn: list[Curve | Band | Region] = [*chart.curves, *chart.bands, *chart.regions]
    for each in drawn:
        scale = view_scale(each.unit, getattr(each, "shown", ""))
        for part in (each.name, f"{each.name}, lower", f"{each.name}, upper"):
            scales[part] = scale
    names, places, values, units = [], [], [], []
    for name, at, there in chart.parts():
        names += [name] * len(at)
        places.append(at)
        values.append(scales[name].factor * there)
        units += [scales[name].mark] * len(at)
    along = np.concatenate(places)
    yield "curve", None, np.array(names)
    yield chart.axis.name, view_scale(chart.axis.unit, chart.axis.shown, along), along
    yield "value", Scale("1", PLAIN), np.concatenate(values)
    yield "unit", None, np.array(units)


def view_scale(unit: str, shown: str, *values: NDArray[np.generic]) -> Scale:
    """Choose how numbers of a view, SI, are shown: by the largest; a ratio as it is."""
    if unit == "1" and not shown:
        whole = all(each.dtype.kind in "iu" for each in values)
        return Scale(unit, COUNT if whole and values else PLAIN)
    finite = [np.abs(each[np.isfinite(each)]) for each in values]
    sizes = [float(each.max()) for each in finite if len(each)]
    return scale_of(unit, shown, max(sizes, default=0.0))


def view_rows(view: View) -> tuple[list[str], list[list[Number | str | None]]]:
    """Return a view as heads with their units, and rows of numbers and words.

    Of a chart whose curves share no points a row is one point of one curve.
    """
    heads, columns = [], []
    for name, scale, values in _scaled(view):
        heads.append(scale.label(name) if scale else name)
        columns.append([_number(scale, value) for value in values.tolist()])
    return heads, [list(row) for row in zip(*columns, strict=True)]


def _number(scale: Scale | None, value: float | str) -> Number | str | None:
    if isinstance(value, str):
        return value
    return None if value != value or scale is None else Number(float(value), scale)


def as_csv(view: View) -> str:
    """Write a view as CSV, all figures, in the units that its heads name."""
    columns = list(_scaled(view))
    heads = (
        f"{name} [{scale.mark}]" if scale and scale.mark else name
        for name, scale, _ in columns
    )
    shown = [
        [v if s is None or s.factor == 1 else s.factor * v for v in values.tolist()]
        for _, s, values in columns
    ]
    return csv_text(heads, zip(*shown, strict=True))
