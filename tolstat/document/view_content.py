"""A view of a model as a plot, or as columns of numbers, in the units shown."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.document.blocks import Column, Table, cell_of
from tolstat.document.inline import Number
from tolstat.document.plot import CURVE_COLOURS, Layer, Plot, PlotAxis, PlotPanel
from tolstat.model.view import Band, Chart, Curve, Panel, View
from tolstat.units.scale import COUNT, PLAIN, Scale, scale_of

ROOM = 0.03  # of the axis, beside a dot at its end
STILL = -1.0, 1.0  # where nothing moves: no axis of rounding errors


def plot_of(chart: Chart) -> Plot:
    """Return a chart as panels one above the other.

    Spans are shaded, marks are dots on their curves, and the legend has their values.
    """
    panels = chart.pictures
    spans = [*chart.spans, *(span for panel in panels for span in panel.spans)]
    shaded = [span.words for span in spans if span.words and span.upper > span.lower]
    words = "; ".join(dict.fromkeys(shaded))
    scale = view_scale(chart.axis.unit, chart.axis.shown, chart.at)
    axis = PlotAxis.of(chart.axis.name, scale)
    x = axis._replace(
        label=f"{axis.label} (shaded: {words})" if words else axis.label,
        scale="log" if chart.axis.logarithmic else "",
        ends=_ends(chart, scale.factor),
    )
    height = max(1.75 * len(panels) + 0.8, 3.6)
    plots = tuple(_panel(chart, panel, x) for panel in panels)
    return Plot(plots, width=8.0, height=height, legends=True)


def _panel(chart: Chart, panel: Panel, x: PlotAxis) -> PlotPanel:
    spans = (
        span
        for span in (*chart.spans, *panel.spans)
        if span.upper > span.lower or chart.at[0] <= span.lower <= chart.at[-1]
    )
    y, layers = _side(chart, panel.names, 0)
    right = None
    if panel.right:
        other, others = _side(chart, panel.right, len(panel.names))
        right = PlotPanel(x, other, tuple(others), at=chart.at)
    if panel.logarithmic:  # where nothing moves, too, its ends are powers
        y = y._replace(scale="log", ends=None)
    layers = [*spans, *layers, *panel.levels]
    return PlotPanel(x, y, tuple(layers), panel.title, right, chart.at)


def _side(
    chart: Chart, names: tuple[str, ...], first: int
) -> tuple[PlotAxis, list[Layer]]:
    """Return an axis of values, and the layers against it."""
    chosen = replace(
        chart,
        curves=tuple(curve for curve in chart.curves if curve.name in names),
        bands=tuple(band for band in chart.bands if band.name in names),
        regions=tuple(region for region in chart.regions if region.name in names),
    )
    curves = chosen.curves
    unit = chart.units[curves[0].name if curves else names[0]]
    typed = next((curve.shown for curve in curves if curve.shown), "")
    scale = view_scale(unit, typed, *(values for _, _, values in chosen.parts()))
    owners = {band.name: band.of for band in chosen.bands if band.of in names}
    leading = [name for name in names if name not in owners]
    colours = {
        name: CURVE_COLOURS[(first + i) % len(CURVE_COLOURS)]
        for i, name in enumerate(leading)
    }
    points = {curve.name for curve in curves if curve.points}
    layers: list[Layer] = [
        region._replace(colour=colours[region.name]) for region in chosen.regions
    ]
    layers += [
        band._replace(
            colour=colours[owners.get(band.name, band.name)], bars=band.of in points
        )
        for band in chosen.bands
    ]
    for curve in curves:
        layers += _with_marks(chart, curve._replace(colour=colours[curve.name]), scale)
    moving = (np.unique(c.values[np.isfinite(c.values)]).size > 1 for c in curves)
    ends = STILL if curves and not any(moving) else None
    return PlotAxis(scale.mark, ends=ends, factor=scale.factor), layers


def _with_marks(chart: Chart, curve: Curve, scale: Scale) -> list[Curve]:
    """Return a curve whose name has the values of its marks, and their dots."""
    marks = [mark for mark in chart.marks if mark.curve == curve.name]
    words = [f"{m.words} {scale.words(m.value)}" for m in marks if m.words]
    name = ": ".join([curve.name.replace("_", " "), *words])
    dots = (
        curve._replace(
            name="", at=np.array([mark.at]), values=np.array([mark.value]), points=True
        )
        for mark in marks
    )
    return [curve._replace(name=name), *dots]


def _ends(chart: Chart, factor: float) -> tuple[float, float] | None:
    """Return the ends of the axis, with room for dots there."""
    places = np.concatenate([at for _, at, _ in chart.parts()] or [chart.at])
    places = places[np.isfinite(places)]
    if chart.axis.logarithmic:
        places = places[places > chart.axis.least]
    if not len(places) or places.min() == places.max():
        return None
    ends = np.array([places.min(), places.max()])
    dots = [mark.at for mark in chart.marks]
    for curve in chart.curves:
        if curve.points:
            dots += [*(chart.at if curve.at is None else curve.at)]
    if not chart.regions and np.isin(ends, dots).any():
        evenly = np.log(ends) if chart.axis.logarithmic else ends
        evenly = evenly + ROOM * np.ptp(evenly) * np.array([-1.0, 1.0])
        ends = np.exp(evenly) if chart.axis.logarithmic else evenly
    first, last = (factor * ends).tolist()
    return first, last


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
