"""Figures drawn: a plot or a chart, into a page or a file."""

from __future__ import annotations

from typing import assert_never

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from scipy.special import ndtri

from tolstat.document.plot import (
    Array,
    Bars,
    Fill,
    Layer,
    Line,
    Plot,
    PlotAxis,
    PlotPanel,
    Points,
    Ranges,
    Rule,
    Spans,
    Stairs,
)
from tolstat.model.view import Chart
from tolstat.render.page_picture import (
    INK,
    MOST_POINTS,
    few_ticks,
    inline,
    legend_above,
    page_figure,
)
from tolstat.render.picture import COLOURS, LIMIT, in_legend, logarithmic
from tolstat.render.view_picture import draw_view

ROLES = {
    **dict(zip(("first", "second", "third", "fourth"), COLOURS, strict=False)),
    "limit": LIMIT, "ink": INK, "met": "#00734f", "not met": "#b00020",
    "undecided": "#8a5a00",
}  # fmt: skip
SLOTS = 3  # panels side by side that a figure has room for, however few there are
SHARES = (1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.5)  # along an axis of normal scores
ABOVE = 1.04  # of the highest bar: where intervals stand


def as_svg(picture: Plot | Chart, alt: str) -> Markup:
    """Draw a figure into a page.

    Parameters
    ----------
    picture : Plot or Chart
        As data.
    alt : str
        What it shows, for those who do not see it.
    """
    if isinstance(picture, Chart):
        return inline(draw_view(picture, ""), alt)
    with page_figure(picture.width, picture.height) as figure:
        draw_plot(figure, picture)
        return inline(figure, alt)


def draw_plot(figure: Figure, plot: Plot) -> None:
    """Draw panels into an empty figure, with one legend above them."""
    n = len(plot.panels)
    if plot.side_by_side:
        every = figure.subplots(1, max(n, SLOTS), sharey=True, squeeze=False)[0]
    else:
        every = figure.subplots(n, 1, sharex=True, squeeze=False)[:, 0]
    for axes in every[n:]:
        axes.set_axis_off()
    for axes, panel in zip(every, plot.panels, strict=False):
        _draw_panel(axes, panel)
        if axes is every[0] or not plot.side_by_side:
            axes.set_ylabel(panel.y.label)
        if axes is every[n - 1] or plot.side_by_side:
            axes.set_xlabel(panel.x.label)
    legend_above(every[0])


def _draw_panel(axes: Axes, panel: PlotPanel) -> None:
    beside = [each for each in panel.layers if isinstance(each, Bars)]
    for layer in panel.layers:
        if isinstance(layer, Bars):
            _draw_bars(axes, layer, beside.index(layer), len(beside))
        else:
            _draw(axes, layer, panel)
    for axis, how in ((axes.xaxis, panel.x), (axes.yaxis, panel.y)):
        if how.scale == "log":
            logarithmic(axis)
            axis.set_minor_locator(NullLocator())
        elif how.scale == "symlog":
            logarithmic(axis, linthresh=10)
    if panel.y.scale == "normal":
        _normal_ticks(axes, panel)
    if panel.x.ends:
        axes.set_xlim(*panel.x.ends)
    if panel.y.ends:
        axes.set_ylim(*panel.y.ends)
    if not beside:
        few_ticks(axes)


def _draw(axes: Axes, layer: Layer, panel: PlotPanel) -> None:
    words = "" if isinstance(layer, Ranges) else layer.label
    label = in_legend(words) if words else "_unnamed"
    match layer:
        case Line(x, y, colour):
            axes.plot(x, y, color=ROLES[colour], linewidth=1, label=label)
        case Points(x, y, colour, _, faint):
            axes.plot(
                x, _up(y, panel.y), ".", color=ROLES[colour], label=label,
                markersize=2.2 if faint else 3, alpha=0.4 if faint else 1.0,
                markeredgewidth=0, rasterized=len(x) > MOST_POINTS,
            )  # fmt: skip
        case Fill(x, lower, upper, colour):
            axes.fill_between(
                x, lower, upper, color=ROLES[colour], alpha=0.25, linewidth=0,
                label=label,
            )  # fmt: skip
        case Stairs(edges, heights, colour):
            axes.stairs(
                heights, edges, fill=True, color=ROLES[colour], linewidth=0, label=label
            )
        case Rule(at, upright, colour, _, dash):
            across = axes.axvline if upright else axes.axhline
            across(at, color=ROLES[colour], linestyle=dash, linewidth=1.2, label=label)
        case Spans(lower, upper, at, colour):
            _draw_spans(axes, lower, upper, at, ROLES[colour], label)
        case Ranges():
            _draw_ranges(axes, layer)
        case Bars():
            pass  # drawn beside each other
        case _:
            assert_never(layer)


def _up(shares: Array, axis: PlotAxis) -> Array:
    """Return where on the axis something stands."""
    if axis.scale != "normal":
        return shares
    scores: Array = ndtri(shares)
    return scores


def _normal_ticks(axes: Axes, panel: PlotPanel) -> None:
    """Write shares on an axis of normal scores, down to the least that is shown."""
    least = min(each.y.min() for each in panel.layers if isinstance(each, Points))
    ticks = [t for t in SHARES if t >= least / 2]
    ticks = sorted({*ticks, *(1 - t for t in ticks)})
    axes.set_yticks(ndtri(ticks), [f"{100 * t:.10g}" for t in ticks])
    axes.set_ylim(ndtri(least / 2), -ndtri(least / 2))


def _draw_spans(
    axes: Axes, lower: Array, upper: Array, at: Array, colour: str, label: str
) -> None:
    """Draw intervals above all else."""
    top = axes.get_ylim()[1]
    for ends in zip(lower, upper, strict=True):
        axes.plot(ends, [ABOVE * top] * 2, color=colour, linewidth=2.5)
    axes.plot(at, np.full(len(at), ABOVE * top), "|", color=colour, label=label)
    axes.set_ylim(0, 1.1 * top)


def _draw_bars(axes: Axes, layer: Bars, place: int, of: int) -> None:
    """Draw bars of one kind, those of other kinds below them."""
    height = 0.72 / of
    at = np.arange(len(layer.names)) + 0.8 * place / of
    reach = None
    if layer.ends is not None:
        reach = np.maximum([[-1.0], [1.0]] * (layer.ends - layer.values), 0.0)
    axes.barh(
        at, layer.values, height, color=ROLES[layer.colour], xerr=reach,
        label=in_legend(layer.label),
        error_kw={"ecolor": INK, "elinewidth": 0.8, "capsize": 2},
    )  # fmt: skip
    if place == 0:
        axes.set_yticks(np.arange(len(layer.names)), layer.names)
        axes.invert_yaxis()
        axes.grid(visible=False, axis="y")


def _draw_ranges(axes: Axes, layer: Ranges) -> None:
    rows = np.arange(len(layer.names))
    for row, lower, upper, at, colour in zip(
        rows, layer.lower, layer.upper, layer.at, layer.colours, strict=True
    ):
        axes.plot([lower, upper], [row, row], color=ROLES[colour], alpha=0.4,
                  linewidth=6, solid_capstyle="butt")  # fmt: skip
        axes.plot(at, row, "o", color=ROLES[colour], markersize=4)
    axes.set_yticks(rows, layer.names)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
