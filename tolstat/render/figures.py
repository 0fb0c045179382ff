"""Figures drawn: a plot or a table, into a page or a file."""

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
from matplotlib.layout_engine import TightLayoutEngine
from matplotlib.legend import Legend
from matplotlib.patches import Patch
from matplotlib.ticker import AutoLocator, MaxNLocator, NullLocator
from matplotlib.transforms import ScaledTranslation
from scipy.special import ndtri

from tolstat.arrays import Array
from tolstat.document.blocks import Cell, Table
from tolstat.document.inline import Number, in_cell, plain
from tolstat.document.plot import (
    CURVE_COLOURS,
    Bars,
    Histogram,
    Intervals,
    Layer,
    Mark,
    Plot,
    PlotPanel,
)
from tolstat.errors import QuestionError
from tolstat.literal import visible
from tolstat.model.view import Band, Curve, Level, Region, Span
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

ROLES = {
    **dict(zip(CURVE_COLOURS, COLOURS, strict=True)),
    "limit": LIMIT, "ink": INK,
}  # fmt: skip
SLOTS = 3  # panels side by side that a figure has room for, however few there are
SHARES = (1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.5)  # along an axis of normal scores
CLOSE: dict[str, Any] = {
    "borderaxespad": 0.1, "handlelength": 1.4, "columnspacing": 1.2,
}  # fmt: skip
ONE_LINE = 0.2  # inches that a legend stands higher above a title
ABOVE = 1.04  # of the highest bar: where intervals stand
DOTS: dict[str, Any] = {"linestyle": "none", "marker": ".", "markeredgewidth": 0}
LARGE: dict[str, Any] = {"linestyle": "none", "marker": "o"}
LOOKS: dict[str, dict[str, Any]] = {
    "line": {},
    "dashed": {"linestyle": "--"},
    "dotted": {"marker": ".", "markersize": 4},
    "dots": {**DOTS, "markersize": 3},
    "faint": {**DOTS, "markersize": 2.2, "alpha": 0.4},
    "large": {**LARGE, "markersize": 4, "clip_on": False},  # not cut by an axis' end
    "rings": {**LARGE, "fillstyle": "none"},
}
MOST_POINTS = 2000  # of a scatter, above which it is rasterised
EDGE = 0.4  # of a letter: around all that is drawn
TITLE_EDGE = 0.05  # inches above the title of a file: less than twice `EDGE`
TICKS = 5  # along an axis of a small picture: each costs
NAME = 28  # letters of a name in a line beside an axis
BETWEEN_WORDS = 3  # parts of an axis with words on both sides: little room is left
LONGEST = 18  # letters of a name beside bars: its ends tell it from others
HIGH_LETTERS = 12  # of the words along an upright axis, in an inch
MOST_WORDS = 32  # along an axis; of more some are written
LEGEND_COLUMNS = 4, 3, 2, 1  # as many as find room
LETTERS, HANDLE = 12, 5  # of a legend in an inch; what stands before a word of it
LETTER = 0.075  # inches, about: of words above a panel
MARGINS = 0.7  # inches beside a panel
LINE = 11  # points between lines of words above a panel
MOST_ROWS = 60  # of a listing that is drawn


def as_svg(plot: Plot, alt: str) -> Markup:
    """Return a figure as SVG for a page; `alt` describes it."""
    with mpl.rc_context(PAGE_STYLE):
        return inline(_figure(plot), alt)


def draw(picture: Plot | Table, title: str) -> Figure:
    """Return a figure for a file.

    Raises
    ------
    QuestionError
        If a table has more rows than a picture can hold.
    """
    with mpl.rc_context(STYLE):
        figure = _table(picture) if isinstance(picture, Table) else _figure(picture)
        top = 1 - TITLE_EDGE / figure.get_figheight()
        figure.suptitle(visible(title), x=0.01, y=top, ha="left", fontsize=11)
    return figure


def _figure(plot: Plot) -> Figure:
    """Return drawn panels, with one legend above them or one for each."""
    figure = Figure(figsize=(plot.width, plot.height))
    whole: Any = None  # as `rect`: any other measures each word twice
    figure.set_layout_engine(TightLayoutEngine(pad=EDGE, rect=whole))
    n = len(plot.panels)
    if plot.side_by_side:
        grid = figure.subplots(1, max(n, SLOTS), sharey=True, squeeze=False)[0]
    else:
        grid = figure.subplots(n, 1, sharex=True, squeeze=False)[:, 0]
    for axes in grid[n:]:
        axes.set_axis_off()
    for axes, panel in zip(grid, plot.panels, strict=False):
        handles = _draw_panel(axes, panel)
        if axes is grid[0] or not plot.side_by_side:
            letters = round(
                HIGH_LETTERS * plot.height / (1 if plot.side_by_side else n)
            )
            axes.set_ylabel("\n".join(wrap(panel.y.label, letters)))
        if axes is grid[n - 1] or plot.side_by_side:
            axes.set_xlabel(panel.x.label)
        if plot.legends:
            _draw_legend(axes, panel, handles)
        else:
            _thin_out(axes)
            if axes is grid[0] and handles:
                _draw_handles(axes, "", handles)
    return figure


def _draw_panel(axes: Axes, panel: PlotPanel) -> list[Any]:
    handles = [handle for layer in panel.layers for handle in _draw(axes, layer, panel)]
    for ticks, axis in ((axes.xaxis, panel.x), (axes.yaxis, panel.y)):
        if axis.scale in ("log", "symlog"):
            logarithmic(ticks, **{"linthresh": 10} if axis.scale == "symlog" else {})
    if panel.y.scale == "normal":
        _normal_ticks(axes, panel)
    _draw_marks(axes, panel)
    if panel.x.words:
        axes.xaxis.set_major_locator(MaxNLocator(MOST_WORDS, integer=True))
        axes.xaxis.set_major_formatter(partial(_word_at, panel.x.words))
        axes.tick_params(axis="x", rotation=90)
    axes.set(**{
        name: axis.ends
        for name, axis in (("xlim", panel.x), ("ylim", panel.y)) if axis.ends
    })  # fmt: skip
    return handles


def _draw_marks(axes: Axes, panel: PlotPanel) -> None:
    """Write the words of marks above the panel, in as few lines as keep them apart."""
    marks = [layer for layer in panel.layers if isinstance(layer, Mark)]
    if not marks:
        return
    left, right = panel.x.ends or axes.get_xlim()
    figure = axes.get_figure(root=True)
    assert figure is not None
    width = figure.get_figwidth() - MARGINS
    taken: list[float] = []  # how far each line is written, the lowest first
    for mark in sorted(marks, key=lambda mark: mark.value):
        place = (panel.x.factor * mark.value - left) / (right - left)
        half = LETTER * (len(mark.words) + 1) / width / 2  # and a gap
        line = next(
            (i for i, end in enumerate(taken) if place - half > end), len(taken)
        )
        taken[line : line + 1] = [place + half]
        axes.annotate(
            mark.words, (panel.x.factor * mark.value, 1.0), (0, 3 + LINE * line),
            ("data", "axes fraction"), "offset points", ha="center",
        )  # fmt: skip


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
        legend, lines = _draw_handles(axes, panel.title, handles)
        legend.set_in_layout(lines > 1)  # further lines need room


def _draw_handles(axes: Axes, title: str, handles: list[Any]) -> tuple[Legend, int]:
    """Draw a legend above a panel, beside its title; return how many lines it has."""
    ncols, beside = _columns(title, handles, axes.figure)
    corner: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)}
    if not beside:
        lift = ScaledTranslation(0, ONE_LINE, axes.figure.dpi_scale_trans)
        corner["bbox_transform"] = axes.transAxes + lift
    legend = axes.legend(handles=handles, ncols=ncols, **corner, **CLOSE)
    return legend, -(-len(handles) // ncols) + (not beside)


def _columns(title: str, handles: list[Any], figure: Any) -> tuple[int, bool]:
    """Return the columns of a legend, and whether they find room beside a title."""
    letters = np.array([len(str(handle.get_label())) + HANDLE for handle in handles])
    for columns in LEGEND_COLUMNS:
        # filled one after the other, each as wide as the longest of its labels
        filled = np.array_split(letters, columns)
        wide = len(title) + sum(part.max(initial=0) for part in filled)
        if wide <= LETTERS * figure.get_figwidth():
            return columns, True
    return columns, not title


def _word_at(words: tuple[str, ...], x: float, _: int) -> str:
    return _wrapped(words[int(x)]) if x in range(len(words)) else ""


def _wrapped(name: str) -> str:
    """Return a name in lines, short enough to leave room for the picture."""
    return "\n".join(wrap(visible(name), NAME))


def _shortened(name: str) -> str:
    """Return a name, of a long one both ends: the page has all of it."""
    name = visible(name)
    end = LONGEST // 2
    return name if len(name) <= LONGEST else f"{name[:end]}…{name[1 - end :]}"


def _draw(axes: Axes, layer: Layer, panel: PlotPanel) -> list[Any]:
    """Draw a layer; return what a legend shows of it."""
    if isinstance(layer, Mark):  # its words stand above the panel: see `_draw_marks`
        axes.axvline(panel.x.factor * layer.value, color=ROLES[layer.colour],
                     linestyle=layer.dash, linewidth=1.2)  # fmt: skip
        return []
    words = layer.words if isinstance(layer, Span | Level) else layer.name
    # a legend hides what begins with _
    label = f" {words}" if words.startswith("_") else words or "_unnamed"
    colour, along, up = ROLES[layer.colour], panel.x.factor, panel.y.factor
    named: dict[str, Any] = {"color": colour, "label": label}
    handles: list[Any] = []
    match layer:
        case Curve():
            x = along * (panel.at if layer.at is None else layer.at)
            y = up * layer.values
            look = LOOKS["large" if layer.points else layer.look]
            handles += axes.plot(
                x, ndtri(y) if panel.y.scale == "normal" else y, **named, **look,
                rasterized="linestyle" in look and len(x) > MOST_POINTS,
            )  # fmt: skip
        case Band():
            between = axes.vlines if layer.bars else axes.fill_between
            between(along * panel.at, up * layer.lower, up * layer.upper, alpha=0.25,
                    linewidth=6 if layer.bars else 0, **named)  # fmt: skip
            handles.append(Patch(alpha=0.25, **named))
        case Region():
            handles += axes.fill(
                along * layer.at, up * layer.values, **named, alpha=0.2, linewidth=0
            )
        case Span(lower, upper) if upper > lower:
            axes.axvspan(along * lower, along * upper, color=GRID, alpha=0.5,
                         linewidth=0, zorder=0)  # fmt: skip
            return []
        case Span() | Level():
            handles.append(
                axes.axvline(along * layer.lower, linestyle=layer.dash, linewidth=1.2,
                             **named)
                if isinstance(layer, Span)
                else axes.axhline(up * layer.value, linestyle=layer.dash,
                                  linewidth=1.2, **named)
            )  # fmt: skip
        case Histogram(edges, heights):
            handles.append(axes.stairs(heights, edges, fill=True, linewidth=0, **named))
        case Intervals(below, above, values):  # above all else
            top = axes.get_ylim()[1]
            for ends in zip(below, above, strict=True):
                axes.plot(ends, [ABOVE * top] * 2, color=colour, linewidth=2.5)
            level = np.full(len(values), ABOVE * top)
            handles += axes.plot(values, level, "|", **named)
            axes.set_ylim(0, 1.1 * top)
        case Bars():
            handles.append(_draw_bars(axes, layer, panel, named))
        case _:
            assert_never(layer)
    return handles if words else []


def _draw_bars(axes: Axes, bars: Bars, panel: PlotPanel, named: dict[str, Any]) -> Any:
    """Draw horizontal bars; those of other kinds are below them."""
    kinds = [layer for layer in panel.layers if isinstance(layer, Bars)]
    row, places, reach = kinds.index(bars), np.arange(len(bars.names)), None
    if bars.ends is not None:
        reach = np.maximum([[-1.0], [1.0]] * (bars.ends - bars.values), 0.0)
    starts = np.zeros(len(places)) if bars.starts is None else bars.starts
    along = panel.x.factor
    if bars.colours:
        named["color"] = [ROLES[colour] for colour in bars.colours]
    thick = 0.5 if bars.look == "steps" else 0.04 if bars.look == "arrows" else 0.72
    handle = axes.barh(
        places + 0.8 * row / len(kinds), along * (bars.values - starts),
        thick / len(kinds), left=along * starts,
        xerr=None if reach is None else along * reach, **named,
        error_kw={"ecolor": INK, "elinewidth": 0.8, "capsize": 2},
    )  # fmt: skip
    if bars.look != "bars":
        _draw_steps(axes, bars, along * starts, along * bars.values)
    if bars.words:
        axes.xaxis.set_major_locator(MaxNLocator(BETWEEN_WORDS))
    for place, words in enumerate(bars.words):
        axes.text(1.02, place, words, va="center", transform=axes.get_yaxis_transform())
    if row == 0:
        axes.set_yticks(places, [*map(_shortened, bars.names)])
        axes.grid(visible=False, axis="y")
        axes.invert_yaxis()
    return handle


def _draw_steps(axes: Axes, bars: Bars, starts: Array, ends: Array) -> None:
    """Draw which way bars lead, and lines from each end to where the next begins."""
    for i, (start, end) in enumerate(zip(starts, ends, strict=True)):
        if start == end:
            axes.plot([end], [i], "o", color=INK, markersize=4)
        elif bars.look == "arrows":
            colour = ROLES[bars.colours[i] if bars.colours else bars.colour]
            axes.plot([end], [i], ">" if end > start else "<", color=colour,
                      markersize=5, clip_on=False)  # fmt: skip
        if i + 1 < len(starts) and starts[i + 1] == end:
            axes.plot([end, end], [i, i + 1], ":", color=INK, linewidth=0.8)


def _normal_ticks(axes: Axes, panel: PlotPanel) -> None:
    """Write shares on an axis of normal scores, down to the least that is shown."""
    curves = (layer for layer in panel.layers if isinstance(layer, Curve))
    least = min(curve.values.min() for curve in curves)
    ticks = [t for t in SHARES if t >= least / 2]
    ticks = sorted({*ticks, *(1 - t for t in ticks)})
    axes.set_yticks(ndtri(ticks), [f"{100 * t:.10g}" for t in ticks])
    axes.set_ylim(ndtri(least / 2), -ndtri(least / 2))


def _table(table: Table) -> Figure:
    heads, rows = [column.head for column in table.columns], table.rows
    if len(rows) > MOST_ROWS:
        raise QuestionError(
            f"{len(rows)} rows are too many for a picture ({MOST_ROWS}); write them to "
            "a .csv or an .html file"
        )
    cells = [[_cell(cell) for cell in row] for row in rows]
    cells = cells or [["none"] + [""] * (len(heads) - 1)]
    figure = Figure(figsize=(1.2 + 1.1 * len(heads), 1.2 + 0.24 * len(cells)))
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.86))
    axes.set_axis_off()
    table_axes = axes.table(cells, colLabels=heads, loc="upper left", cellLoc="right")
    table_axes.auto_set_font_size(False)
    table_axes.set_fontsize(8)
    table_axes.auto_set_column_width(list(range(len(heads))))
    return figure


def _cell(cell: Cell) -> str:
    return "".join(
        plain(in_cell(part)[0]) if isinstance(part, Number) else str(part)
        for part in cell.main
    )
