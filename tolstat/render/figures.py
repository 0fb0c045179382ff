"""Figures drawn: a plot, a chart or a listing, into a page or a file."""

import tolstat.render.any_backend  # noqa: F401

# isort: split
from functools import partial
from textwrap import wrap
from typing import Any, assert_never

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import AutoLocator, MaxNLocator, NullLocator
from scipy.special import ndtri

from tolstat.document import plot as data
from tolstat.document.digits import in_cell, plain
from tolstat.document.inline import Number
from tolstat.document.plot import Plot, PlotPanel
from tolstat.errors import PictureError
from tolstat.literal import visible
from tolstat.model.view import Chart, Listing, View
from tolstat.render.picture import (
    COLOURS,
    GRID,
    INK,
    LIMIT,
    PAGE_STYLE,
    STYLE,
    inline,
    logarithmic,
)
from tolstat.render.shown_view import CURVE_COLOURS, plot_of, view_rows

ROLES = {
    **dict(zip(CURVE_COLOURS, COLOURS, strict=True)),
    "limit": LIMIT, "ink": INK,
}  # fmt: skip
SLOTS = 3  # panels side by side that a figure has room for, however few there are
SHARES = (1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.5)  # along an axis of normal scores
CLOSE: dict[str, Any] = {
    "borderaxespad": 0.1, "handlelength": 1.4, "columnspacing": 1.2,
}  # fmt: skip
ABOVE = 1.04  # of the highest bar: where intervals stand
DOTS: dict[str, Any] = {"linestyle": "none", "marker": ".", "markeredgewidth": 0}
LARGE: dict[str, Any] = {"linestyle": "none", "marker": "o"}
LOOKS: dict[str, dict[str, Any]] = {
    "line": {},
    "dotted": {"marker": ".", "markersize": 4},
    "dots": {**DOTS, "markersize": 3},
    "faint": {**DOTS, "markersize": 2.2, "alpha": 0.4},
    "large": {**LARGE, "markersize": 4, "clip_on": False},  # not cut by an axis' end
    "rings": {**LARGE, "fillstyle": "none"},
}
MOST_POINTS = 2000  # of a scatter, above which it is rasterised
TICKS = 5  # along an axis of a small picture: each costs
NAME = 28  # letters of a name in a line beside an axis
MOST_WORDS = 32  # along an axis; of more some are written
LEGEND_COLUMNS = 4, 3, 2, 1  # as many as find room
LETTERS, HANDLE = 12, 5  # of a legend in an inch; what stands before a word of it
MOST_ROWS = 60  # of a listing that is drawn


def as_svg(picture: Plot | Chart, alt: str) -> Markup:
    """Return a figure as SVG for a page; `alt` describes it."""
    with mpl.rc_context(PAGE_STYLE):
        return inline(_drawn(picture), alt)


def draw(picture: Plot | View, title: str) -> Figure:
    """Return a figure for a file, drawn from data; a listing as a table.

    Raises
    ------
    PictureError
        If a listing has more rows than a picture can hold.
    """
    with mpl.rc_context(STYLE):
        figure = _listing(picture) if isinstance(picture, Listing) else _drawn(picture)
        figure.suptitle(visible(title), x=0.01, ha="left", fontsize=11)
    return figure


def _drawn(picture: Plot | Chart) -> Figure:
    """Return drawn panels, with one legend above them or one for each."""
    plot = plot_of(picture) if isinstance(picture, Chart) else picture
    figure = Figure(figsize=(plot.width, plot.height), layout="constrained")
    n = len(plot.panels)
    if plot.side_by_side:
        every = figure.subplots(1, max(n, SLOTS), sharey=True, squeeze=False)[0]
    else:
        every = figure.subplots(n, 1, sharex=True, squeeze=False)[:, 0]
    for axes in every[n:]:
        axes.set_axis_off()
    for axes, panel in zip(every, plot.panels, strict=False):
        handles = _draw_panel(axes, panel)
        if axes is every[0] or not plot.side_by_side:
            axes.set_ylabel(panel.y.label)
        if axes is every[n - 1] or plot.side_by_side:
            axes.set_xlabel(panel.x.label)
        if plot.legends:
            _draw_legend(axes, panel, handles)
        else:
            _thin_out(axes)
            if axes is every[0] and handles:
                ncols = _columns("", handles, figure)
                figure.legend(handles=handles, loc="outside upper left", ncols=ncols,
                              **CLOSE)  # fmt: skip
    return figure


def _draw_panel(axes: Axes, panel: PlotPanel) -> list[Any]:
    handles = [each for layer in panel.layers for each in _draw(axes, layer, panel)]
    for axis, how in ((axes.xaxis, panel.x), (axes.yaxis, panel.y)):
        if how.scale in ("log", "symlog"):
            logarithmic(axis, **{"linthresh": 10} if how.scale == "symlog" else {})
    if panel.y.scale == "normal":
        _normal_ticks(axes, panel)
    if panel.x.words:
        axes.xaxis.set_major_locator(MaxNLocator(MOST_WORDS, integer=True))
        axes.xaxis.set_major_formatter(partial(_word_at, panel.x.words))
        axes.tick_params(axis="x", rotation=90)
    axes.set(**{
        name: how.ends
        for name, how in (("xlim", panel.x), ("ylim", panel.y)) if how.ends
    })  # fmt: skip
    return handles


def _thin_out(axes: Axes) -> None:
    """Leave few ticks in a small picture."""
    for axis in (axes.xaxis, axes.yaxis):
        if isinstance(axis.get_major_locator(), AutoLocator):
            axis.set_major_locator(MaxNLocator(TICKS))
        if axis.get_scale() == "log":
            axis.set_minor_locator(NullLocator())


def _draw_legend(axes: Axes, panel: PlotPanel, handles: list[Any]) -> None:
    """Draw the right axis, and a legend on the line of the title."""
    axes.set_title(panel.title or " ")
    if panel.right:
        right = axes.twinx()
        right.grid(visible=False)
        right.spines["right"].set_visible(True)
        right.set_ylabel(panel.right.y.label)
        handles += _draw_panel(right, panel.right)
    if handles:
        ncols = _columns(panel.title, handles, axes.figure)
        place: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)}
        legend = axes.legend(handles=handles, ncols=ncols, **place, **CLOSE)
        legend.set_in_layout(len(handles) > ncols)  # further lines need room


def _columns(title: str, handles: list[Any], figure: Any) -> int:
    """Return how many columns of a legend find room beside a title."""
    letters = np.array([len(str(each.get_label())) + HANDLE for each in handles])
    for columns in LEGEND_COLUMNS:
        # filled one after the other, each as wide as the longest of its labels
        filled = np.array_split(letters, columns)
        wide = len(title) + sum(part.max(initial=0) for part in filled)
        if wide <= LETTERS * figure.get_figwidth():
            break
    return columns


def _word_at(words: tuple[str, ...], x: float, _: int) -> str:
    return _wrapped(words[int(x)]) if x in range(len(words)) else ""


def _wrapped(name: str) -> str:
    """Return a name in lines, short enough to leave room for the picture."""
    return "\n".join(wrap(visible(name), NAME))


def _draw(axes: Axes, layer: data.Layer, panel: PlotPanel) -> list[Any]:
    """Draw a layer; return what a legend shows of it."""
    words = getattr(layer, "label", "")
    # a legend hides what begins with _
    label = f" {words}" if words.startswith("_") else words or "_unnamed"
    colour = ROLES[getattr(layer, "colour", "ink")]
    named: dict[str, Any] = {"color": colour, "label": label}
    drawn: list[Any] = []
    match layer:
        case data.Line(x, y):
            up, look = ndtri(y) if panel.y.scale == "normal" else y, LOOKS[layer.look]
            many = "linestyle" in look and len(x) > MOST_POINTS
            drawn += axes.plot(x, up, **named, **look, rasterized=many)
        case data.Fill(x, lower, upper):
            between = axes.vlines if layer.bars else axes.fill_between
            width = 6 if layer.bars else 0
            between(x, lower, upper, linewidth=width, alpha=0.25, **named)
            drawn.append(Patch(alpha=0.25, **named))
        case data.Area(x, y):
            drawn += axes.fill(x, y, **named, alpha=0.2, linewidth=0)
        case data.Shade(lower, upper):
            axes.axvspan(lower, upper, color=GRID, alpha=0.5, linewidth=0, zorder=0)
        case data.Stairs(edges, heights):
            drawn.append(axes.stairs(heights, edges, fill=True, linewidth=0, **named))
        case data.Rule(at, upright):
            across = axes.axvline if upright else axes.axhline
            drawn.append(across(at, linestyle=layer.dash, linewidth=1.2, **named))
        case data.Spans(lower, upper, at):  # above all else
            top = axes.get_ylim()[1]
            for ends in zip(lower, upper, strict=True):
                axes.plot(ends, [ABOVE * top] * 2, color=colour, linewidth=2.5)
            drawn += axes.plot(at, np.full(len(at), ABOVE * top), "|", **named)
            axes.set_ylim(0, 1.1 * top)
        case data.Bars(names, values, ends):  # those of other kinds are below them
            beside = [each for each in panel.layers if isinstance(each, data.Bars)]
            place, of = beside.index(layer), len(beside)
            reach = None
            if ends is not None:
                reach = np.maximum([[-1.0], [1.0]] * (ends - values), 0.0)
            drawn.append(axes.barh(
                np.arange(len(names)) + 0.8 * place / of, values, 0.72 / of,
                xerr=reach, **named,
                error_kw={"ecolor": INK, "elinewidth": 0.8, "capsize": 2},
            ))  # fmt: skip
            if place == 0:
                axes.set_yticks(np.arange(len(names)), [*map(_wrapped, names)])
                axes.grid(visible=False, axis="y")
                axes.invert_yaxis()
        case _:
            assert_never(layer)
    return drawn if words else []


def _normal_ticks(axes: Axes, panel: PlotPanel) -> None:
    """Write shares on an axis of normal scores, down to the least that is shown."""
    least = min(each.y.min() for each in panel.layers if isinstance(each, data.Line))
    ticks = [t for t in SHARES if t >= least / 2]
    ticks = sorted({*ticks, *(1 - t for t in ticks)})
    axes.set_yticks(ndtri(ticks), [f"{100 * t:.10g}" for t in ticks])
    axes.set_ylim(ndtri(least / 2), -ndtri(least / 2))


def _listing(listing: Listing) -> Figure:
    heads, rows = view_rows(listing)
    if len(rows) > MOST_ROWS:
        raise PictureError(
            f"{len(rows)} rows are too many for a picture ({MOST_ROWS}); write them to "
            "a .csv or an .html file"
        )
    cells = [[_in_cell(each) for each in row] for row in rows]
    cells = cells or [["none"] + [""] * (len(heads) - 1)]
    figure = Figure(figsize=(1.2 + 1.1 * len(heads), 1.2 + 0.24 * len(cells)))
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.86))
    axes.set_axis_off()
    table = axes.table(cells, colLabels=heads, loc="upper left", cellLoc="right")
    table.auto_set_font_size(False)
    table.set_fontsize(8)
    table.auto_set_column_width(list(range(len(heads))))
    return figure


def _in_cell(cell: Number | str | None) -> str:
    return plain(in_cell(cell)[0]) if isinstance(cell, Number) else cell or ""
