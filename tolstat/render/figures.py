"""Figures drawn by Matplotlib, for files: a plot or a table."""

import tolstat.render.any_backend  # noqa: F401

# isort: split
from functools import partial
from textwrap import wrap
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import TightLayoutEngine
from matplotlib.legend import Legend
from matplotlib.ticker import AutoLocator, MaxNLocator, NullLocator
from matplotlib.transforms import ScaledTranslation

from tolstat.document.blocks import Cell, Table
from tolstat.document.inline import Number, in_cell, plain
from tolstat.document.plot import Bars, Plot, PlotPanel
from tolstat.errors import QuestionError
from tolstat.literal import visible
from tolstat.render.colours import ROLES
from tolstat.render.panels import SIZE, SLOTS, Picture, shortened, wrapped
from tolstat.render.picture import STYLE, logarithmic
from tolstat.render.shapes import Shape
from tolstat.render.ticks import MOST_WORDS, TRANSFORMS

CLOSE: dict[str, Any] = {
    "borderaxespad": 0.1, "handlelength": 1.4, "columnspacing": 1.2,
}  # fmt: skip
ONE_LINE = 0.2  # inches that a legend stands higher above a title
DOTS = {"rings": "o"}  # markers; others have their name
MOST_POINTS = 2000  # of a scatter, above which it is rasterised
EDGE = 0.4  # of a letter: around all that is drawn
TITLE_EDGE = 0.05  # inches above the title of a file: less than twice `EDGE`
TICKS = 5  # along an axis of a small picture
BETWEEN_WORDS = 3  # parts of an axis with words on both sides: little room is left
HIGH_LETTERS = 12  # of the words along an upright axis, in an inch
LEGEND_COLUMNS = 4, 3, 2, 1  # as many as find room
LETTERS, HANDLE = 12, 5  # of a legend in an inch; what stands before a word of it
MARGINS = 0.7  # inches beside a panel
LINE = 11  # points between lines of words above a panel
MOST_ROWS = 60  # of a listing that is drawn


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
    picture = Picture(panel, legend=False)
    drawn = [(_draw(axes, s, panel.y.scale), s) for s in picture.shapes]
    for ticks, axis in ((axes.xaxis, panel.x), (axes.yaxis, panel.y)):
        if axis.scale in ("log", "symlog"):
            logarithmic(ticks, **{"linthresh": 10} if axis.scale == "symlog" else {})
    if panel.y.scale == "normal":
        low, high, shares = picture.y.low, picture.y.high, picture.y.ticks(0)
        scores = [low + (high - low) * tick.part for tick in shares]
        axes.set_yticks(scores, [tick.words for tick in shares])
        axes.set_ylim(low, high)
    _draw_marks(axes, picture)
    if picture.bars:
        _write_beside(axes, picture.bars)
    if panel.x.words:
        axes.xaxis.set_major_locator(MaxNLocator(MOST_WORDS, integer=True))
        axes.xaxis.set_major_formatter(partial(_word_at, panel.x.words))
        axes.tick_params(axis="x", rotation=90)
    axes.set(**{
        name: axis.ends
        for name, axis in (("xlim", panel.x), ("ylim", panel.y)) if axis.ends
    })  # fmt: skip
    return [handle for handle, shape in drawn if shape.name]


def _draw_marks(axes: Axes, picture: Picture) -> None:
    """Write the words of marks above the panel, in as few lines as keep them apart."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    picture.head(
        72 * (figure.get_figwidth() - MARGINS) * SIZE / mpl.rcParams["font.size"]
    )
    for mark, _, line in picture.marks:
        axes.annotate(
            mark.words, (picture.panel.x.factor * mark.value, 1.0),
            (0, 3 + LINE * line),
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
    return wrapped(words[int(x)]) if x in range(len(words)) else ""


def _draw(axes: Axes, shape: Shape, scale: str) -> Any:
    """Draw a shape; return what a legend shows of it."""
    x, y, name = shape.x, shape.y, shape.name
    with np.errstate(invalid="ignore"):
        y = TRANSFORMS[scale](y) if scale == "normal" else y
    named: dict[str, Any] = {
        "color": ROLES[shape.colour], "alpha": shape.alpha if shape.alpha < 1 else None,
        # a legend hides what begins with _
        "label": f" {name}" if name.startswith("_") else name or "_unnamed",
    }  # fmt: skip
    if shape.area and np.isinf(y).any():
        return axes.axvspan(x.min(), x.max(), linewidth=0, zorder=0, **named)
    if shape.area:
        ends = np.flatnonzero(np.isnan(x))
        parts = zip(np.split(x, ends), np.split(y, ends), strict=True)
        corners = [c[np.isfinite(c)] for part in parts for c in part]
        polygons = axes.fill(*(c for c in corners if len(c)), linewidth=0, **named)
        for polygon in polygons:
            getattr(polygon.sticky_edges, shape.based or "x").extend(
                [0.0] * bool(shape.based)
            )
        return polygons[0]
    named |= {"linestyle": shape.dash or "none", "linewidth": shape.width}
    if np.isinf(y).any():
        return axes.axvline(x[0], **named)
    if np.isinf(x).any():
        return axes.axhline(y[0], **named)
    rings = shape.dot == "rings"
    (line,) = axes.plot(
        x, y, marker=DOTS.get(shape.dot, shape.dot), markersize=shape.size,
        markeredgewidth=float(rings or shape.dot == "|"),
        fillstyle="none" if rings else "full", clip_on=shape.clip,
        rasterized=not shape.dash and len(x) > MOST_POINTS, **named,
    )  # fmt: skip
    return line


def _write_beside(axes: Axes, bars: Bars) -> None:
    """Write the names of bars, the first on top, and their words on the right."""
    if bars.words:
        axes.xaxis.set_major_locator(MaxNLocator(BETWEEN_WORDS))
    for place, words in enumerate(bars.words):
        axes.text(1.02, place, words, va="center", transform=axes.get_yaxis_transform())
    axes.set_yticks(range(len(bars.names)), [*map(shortened, bars.names)])
    axes.grid(visible=False, axis="y")
    axes.invert_yaxis()


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
