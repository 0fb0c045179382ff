"""A view of a model in the units that are shown: as rows, as CSV, as a plot."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.document import plot as data
from tolstat.document.inline import Number
from tolstat.document.plot import Plot, PlotAxis, PlotPanel
from tolstat.model.view import Band, Chart, Curve, Panel, Region, View
from tolstat.render.serialize import csv_text
from tolstat.units.scale import COUNT, PLAIN, Scale, scale_of

Scaled = tuple[str, Scale | None, NDArray[np.generic]]
CURVE_COLOURS = ("first", "second", "third", "fourth", "fifth", "sixth")
ROOM = 0.03  # of the axis, beside a dot at its end
STILL = -1.0, 1.0  # where nothing moves: no axis of rounding errors


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
    """Yield curves without common points as rows of name, place, value, unit."""
    scales = {}
    drawn: list[Curve | Band | Region] = [*chart.curves, *chart.bands, *chart.regions]
    shown = {curve.name: curve.shown for curve in chart.curves}
    for each in drawn:
        of = each.of if isinstance(each, Band) else each.name
        scale = view_scale(each.unit, shown.get(of, ""))
        for part in (each.name, f"{each.name}, lower", f"{each.name}, upper"):
            scales[part] = scale
    names, places, parts = zip(*chart.parts(), strict=True)
    sizes, along = [*map(len, places)], np.concatenate(places)
    values = [
        scales[name].factor * part for name, part in zip(names, parts, strict=True)
    ]
    yield "curve", None, np.repeat(names, sizes)
    yield chart.axis.name, view_scale(chart.axis.unit, chart.axis.shown, along), along
    yield "value", Scale("1", PLAIN), np.concatenate(values)
    yield "unit", None, np.repeat([scales[name].mark for name in names], sizes)


def view_scale(unit: str, shown: str, *values: NDArray[np.generic]) -> Scale:
    """Return the scale of numbers of a view, SI: by the largest; a ratio as it is."""
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
    """Return a view as CSV, all figures, in the units that its heads name."""
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


def plot_of(chart: Chart) -> Plot:
    """Return a chart as panels one above the other.

    Spans are shaded, marks are dots on their curves, and the legend has their values.
    """
    panels = chart.pictures
    shaded = [*chart.spans, *(span for panel in panels for span in panel.spans)]
    wide = [span.words for span in shaded if span.words and span.upper > span.lower]
    said = "; ".join(dict.fromkeys(wide))
    along = view_scale(chart.axis.unit, chart.axis.shown, chart.at)
    label = along.label(chart.axis.name)
    x = PlotAxis(
        f"{label} (shaded: {said})" if said else label,
        "log" if chart.axis.logarithmic else "",
        _ends(chart, along.factor),
    )
    height = max(1.75 * len(panels) + 0.8, 3.6)
    made = tuple(_panel(chart, panel, x, along) for panel in panels)
    return Plot(made, width=8.0, height=height, legends=True)


def _panel(chart: Chart, panel: Panel, x: PlotAxis, along: Scale) -> PlotPanel:
    factor = along.factor
    shades = (
        data.Shade(factor * span.lower, factor * span.upper)
        if span.upper > span.lower
        else data.Rule(factor * span.lower, True, "ink", span.words, ":")
        for span in (*chart.spans, *panel.spans)
        if span.upper > span.lower or chart.at[0] <= span.lower <= chart.at[-1]
    )
    scale, ends, layers = _side(chart, panel.names, 0, factor)
    levels = (
        data.Rule(scale.factor * at, False, "limit", words)
        for at, words in panel.levels
    )
    right = None
    if panel.right:
        other, limits, drawn = _side(chart, panel.right, len(panel.names), factor)
        right = PlotPanel(x, PlotAxis(other.mark, "", limits), tuple(drawn))
    y = PlotAxis(scale.mark, "log" if panel.logarithmic else "", ends)
    return PlotPanel(x, y, (*shades, *layers, *levels), panel.title, right)


def _side(
    chart: Chart, names: tuple[str, ...], first: int, along: float
) -> tuple[Scale, tuple[float, float] | None, list[data.Layer]]:
    """Return the unit, ends and layers of one axis."""
    curves = [each for each in chart.curves if each.name in names]
    bands = [each for each in chart.bands if each.name in names]
    regions = [each for each in chart.regions if each.name in names]
    shown = [*(each.values for each in curves), *(each.values for each in regions)]
    shown += [ends for each in bands for ends in (each.lower, each.upper)]
    unit = chart.units[curves[0].name if curves else names[0]]
    typed = next((curve.shown for curve in curves if curve.shown), "")
    scale = view_scale(unit, typed, *shown)
    times = scale.factor
    of = {band.name: band.of for band in bands if band.of in names}
    leading = [name for name in names if name not in of]
    every = len(CURVE_COLOURS)
    colours = {n: CURVE_COLOURS[(first + i) % every] for i, n in enumerate(leading)}
    layers: list[data.Layer] = [
        data.Area(along * each.at, times * each.values, colours[each.name], each.name)
        for each in regions
    ]
    dots = {curve.name for curve in curves if curve.points}
    for band in bands:
        colour = colours[of.get(band.name, band.name)]
        ends = times * band.lower, times * band.upper
        bars = band.of in dots
        layers.append(data.Fill(along * chart.at, *ends, colour, band.name, bars))
    for curve in curves:
        marks = [mark for mark in chart.marks if mark.curve == curve.name]
        words = [f"{m.words} {scale.words(m.value)}" for m in marks if m.words]
        label = ": ".join([curve.name.replace("_", " "), *words])
        at, colour = along * _places(chart, curve), colours[curve.name]
        look = "large" if curve.points else "line"
        layers.append(data.Line(at, times * curve.values, colour, label, look))
        for mark in marks:
            dot = np.array([along * mark.at]), np.array([times * mark.value])
            layers.append(data.Line(*dot, colour, look="large"))
    moving = (np.unique(c.values[np.isfinite(c.values)]).size > 1 for c in curves)
    still = curves and not any(moving)
    return scale, STILL if still else None, layers


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
    dots += [x for curve in chart.curves if curve.points for x in _places(chart, curve)]
    if not chart.regions and np.isin(ends, dots).any():
        evenly = np.log(ends) if chart.axis.logarithmic else ends
        evenly = evenly + ROOM * np.ptp(evenly) * np.array([-1.0, 1.0])
        ends = np.exp(evenly) if chart.axis.logarithmic else evenly
    first, last = (factor * ends).tolist()
    return first, last


def _places(chart: Chart, curve: Curve) -> Array:
    return chart.at if curve.at is None else curve.at
