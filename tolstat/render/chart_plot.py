"""A chart of a model as a plot: units and colours chosen."""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.document import plot as data
from tolstat.document.plot import Plot, PlotAxis, PlotPanel
from tolstat.model.view import Chart, Curve, Panel
from tolstat.render.view_rows import view_scale
from tolstat.units.scale import Scale

CURVE_COLOURS = ("first", "second", "third", "fourth", "fifth", "sixth")
ROOM = 0.03  # of the axis, beside a dot at its end
STILL = -1.0, 1.0  # where nothing moves: no axis of rounding errors


def plot_of(chart: Chart) -> Plot:
    """Return a chart as panels one above the other.

    Spans are shaded, marks are dots on their curves, and the legend says how high they
    are.
    """
    panels = chart.pictures
    shaded = [*chart.spans, *(span for panel in panels for span in panel.spans)]
    said = "; ".join(dict.fromkeys(span.words for span in shaded if span.words))
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
        for span in (*chart.spans, *panel.spans)
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
    """Return the unit, ends and layers of what is shown against one axis."""
    curves = [each for each in chart.curves if each.name in names]
    bands = [each for each in chart.bands if each.name in names]
    regions = [each for each in chart.regions if each.name in names]
    shown = [*(each.values for each in curves), *(each.values for each in regions)]
    shown += [ends for each in bands for ends in (each.lower, each.upper)]
    unit = chart.units[curves[0].name if curves else names[0]]
    scale = view_scale(unit, curves[0].shown if curves else "", *shown)
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
        made = data.Whiskers if band.of in dots else data.Fill
        colour = colours[of.get(band.name, band.name)]
        ends = times * band.lower, times * band.upper
        layers.append(made(along * chart.at, *ends, colour, band.name))
    for curve in curves:
        marks = [mark for mark in chart.marks if mark.curve == curve.name]
        words = [f"{m.words} {scale.words(m.value)}" for m in marks if m.words]
        label = ": ".join([curve.name.replace("_", " "), *words])
        drawn = along * _places(chart, curve), times * curve.values, colours[curve.name]
        if curve.points:
            layers.append(data.Points(*drawn, label, mark="o"))
        else:
            layers.append(data.Line(*drawn, label))
        for mark in marks:
            at = np.array([along * mark.at]), np.array([times * mark.value])
            layers.append(data.Points(*at, colours[curve.name], mark="o"))
    moving = (np.unique(c.values[np.isfinite(c.values)]).size > 1 for c in curves)
    still = curves and not any(moving)
    return scale, STILL if still else None, layers


def _places(chart: Chart, curve: Curve) -> Array:
    return chart.at if curve.at is None else curve.at


def _ends(chart: Chart, factor: float) -> tuple[float, float] | None:
    """Return where the axis begins and ends; dots there have room."""
    places = np.concatenate([at for _, at, _ in chart.parts()] or [chart.at])
    places = places[np.isfinite(places)]
    if chart.axis.logarithmic:
        places = places[places > chart.axis.least]
    if not len(places) or places.min() == places.max():
        return None
    ends = np.array([places.min(), places.max()])
    dots = [mark.at for mark in chart.marks]
    for curve in chart.curves:
        dots += _places(chart, curve).tolist() if curve.points else []
    if not chart.regions and np.isin(ends, dots).any():
        evenly = np.log(ends) if chart.axis.logarithmic else ends
        evenly = evenly + ROOM * np.ptp(evenly) * np.array([-1.0, 1.0])
        ends = np.exp(evenly) if chart.axis.logarithmic else evenly
    first, last = (factor * ends).tolist()
    return first, last
