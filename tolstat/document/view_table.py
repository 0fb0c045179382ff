"""A view of a model as columns of numbers, in the units that are shown."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.document.blocks import Column, Table, cell_of
from tolstat.document.inline import Number
from tolstat.model.view import Band, Chart, View
from tolstat.units.scale import COUNT, PLAIN, Scale, scale_of


class ViewColumn(NamedTuple):
    """A column of a view: numbers, SI, or words."""

    name: str
    values: NDArray[np.generic]
    scale: Scale | None  # None for words

    @property
    def head(self) -> str:
        """The name with the unit."""
        return self.scale.label(self.name) if self.scale else self.name

    @property
    def cells(self) -> list[Number | str | None]:
        """The values as numbers of a table, or words."""
        values = self.values.tolist()
        if self.scale is None:
            return [value if isinstance(value, str) else None for value in values]
        return [None if v != v else Number(float(v), self.scale) for v in values]


def view_columns(view: View) -> Iterator[ViewColumn]:
    """Yield the columns of a view.

    Of a chart whose curves share no points a row is one point of one curve.
    """
    chart = isinstance(view, Chart)
    if isinstance(view, Chart) and (
        view.regions or any(curve.at is not None for curve in view.curves)
    ):
        yield from _long(view)
        return
    first, *others = columns = list(view.columns())
    for axis, values in columns:
        scale = None
        if values.dtype.kind in "fiu":
            # a curve and the edges of its band, in one unit
            alike = [v for other, v in others if other.unit == axis.unit]
            shared = alike if chart and axis is not first[0] else [values]
            scale = view_scale(axis.unit, axis.shown, *shared)
        yield ViewColumn(axis.name, values, scale)


def _long(chart: Chart) -> Iterator[ViewColumn]:
    """Yield curves without common points as rows of name, place, value, unit."""
    units = {curve.name: curve.shown for curve in chart.curves}
    scales = {}
    for item in chart.items:
        owner = item.of if isinstance(item, Band) else item.name
        scale = view_scale(item.unit, units.get(owner, ""))
        for end in ("", ", lower", ", upper"):
            scales[item.name + end] = scale
    names, places, parts = zip(*chart.parts(), strict=True)
    sizes, along = [*map(len, places)], np.concatenate(places)
    values = [
        scales[name].factor * part for name, part in zip(names, parts, strict=True)
    ]
    scale = view_scale(chart.axis.unit, chart.axis.shown, along)
    yield ViewColumn("curve", np.repeat(names, sizes), None)
    yield ViewColumn(chart.axis.name, along, scale)
    yield ViewColumn("value", np.concatenate(values), Scale("1", PLAIN))
    marks = [scales[name].mark for name in names]
    yield ViewColumn("unit", np.repeat(marks, sizes), None)


def view_scale(unit: str, shown: str, *values: NDArray[np.generic]) -> Scale:
    """Return the scale of numbers of a view, SI: by the largest; a ratio as it is."""
    if unit == "1" and not shown:
        counts = bool(values) and all(column.dtype.kind in "iu" for column in values)
        return Scale(unit, COUNT if counts else PLAIN)
    finite = [np.abs(column[np.isfinite(column)]) for column in values]
    sizes = [float(column.max()) for column in finite if len(column)]
    return scale_of(unit, shown, max(sizes, default=0.0))


def view_table(view: View) -> Table:
    """Return a view as a table: heads with their units, rows of numbers and words."""
    columns = list(view_columns(view))
    heads = tuple(Column(column.head) for column in columns)
    cells = (map(cell_of, column.cells) for column in columns)
    return Table(heads, tuple(zip(*cells, strict=True)))
