"""Figures drawn by Matplotlib, for files: a plot or a table."""

import tolstat.render.any_backend  # noqa: F401

# isort: split
from collections.abc import Sequence
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from tolstat.document.blocks import Cell, Table
from tolstat.document.inline import Number, in_cell, plain
from tolstat.document.plot import Bars, Plot
from tolstat.errors import QuestionError
from tolstat.literal import visible
from tolstat.render.colours import ROLES
from tolstat.render.panels import LINE, SIZE, Picture, fitted, laid_out, wrapped
from tolstat.render.picture import STYLE
from tolstat.render.shapes import Shape
from tolstat.render.ticks import INVERSES, TRANSFORMS, Ruler, Tick

LARGER = 10 / SIZE  # letters of a file, over those of a page
TITLE, HEAD = 0.3, 11  # inches, of the words above all panels; points of their letters
LEGEND: dict[str, Any] = {
    "loc": "lower right", "borderaxespad": 0.1, "handlelength": 1.4,
    "columnspacing": 1.2,
}  # fmt: skip
MATPLOTLIB = "log", "symlog"  # scales; normal scores are linear
DOTS = {"rings": "o"}  # markers; others have their name
MOST_POINTS = 2000  # of a scatter, above which it is rasterised
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
        top = 1 - TITLE / 6 / figure.get_figheight()
        room = 72 * 0.99 * figure.get_figwidth() * SIZE / HEAD
        words = fitted(visible(title), room)
        figure.suptitle(words, x=0.01, y=top, ha="left", fontsize=HEAD)
    return figure


def _figure(plot: Plot) -> Figure:
    """Return panels that lie as on a page, in larger letters.

    Rows of bars are as far apart as these need: such a figure is larger, too.
    """
    if any(isinstance(layer, Bars) for p in plot.panels for layer in p.layers):
        high = LARGER * plot.height + TITLE
        plot = plot._replace(width=LARGER * plot.width, height=high)
    high = (plot.height - TITLE) / LARGER
    page = plot._replace(width=plot.width / LARGER, height=high)
    needed, pictures = laid_out(page)
    if needed > high:
        plot = plot._replace(height=LARGER * needed + TITLE)
    figure, free = Figure(figsize=(plot.width, plot.height)), plot.height - TITLE
    drawn = list[Axes]()
    for picture in pictures:
        left, top, right, bottom = LARGER / 72 * np.array(picture.box)
        sides = left, free - bottom, right - left, bottom - top
        places = sides / np.array(2 * [plot.width, plot.height])
        drawn.append(figure.add_axes(tuple(places.tolist())))
    for axes, picture in zip(drawn, pictures, strict=True):
        _draw_panel(axes, picture)
    return figure


def _draw_panel(axes: Axes, picture: Picture) -> None:
    panel, y_ticks = picture.panel, picture.y_ticks(picture.y)
    _rule(axes, "x", picture.x, picture.x_ticks, picture.under)
    _rule(axes, "y", picture.y, y_ticks, picture.first)
    axes.grid(visible=not picture.bars, axis="y")
    axes.set_axisbelow(True)  # the grid, behind bars as on a page
    handles = [(_draw(axes, s, panel.y.scale), s) for s in picture.shapes]
    if panel.right:
        right = axes.twinx()
        right.grid(visible=False)
        right.spines["right"].set_visible(True)
        right.set_ylabel("\n".join(picture.label(panel.right.y.label)))
        _rule(right, "y", picture.y2, picture.y_ticks(picture.y2))
        handles += [(_draw(right, s, panel.right.y.scale), s) for s in picture.others]
    axes.set_title(panel.title)
    if picture.under:
        middle, label = picture.lower_label
        wide = picture.box.right - picture.box.left
        axes.set_xlabel(label, x=(middle - picture.box.left) / wide)
    axes.set_ylabel("\n".join(picture.label(panel.y.label)) if picture.first else "")
    for mark, part, line in picture.marks:
        axes.annotate(mark.words, (part, 1.0), (0, 3 + LARGER * LINE * line),
                      "axes fraction", "offset points", ha="center")  # fmt: skip
    words = picture.bars.words if picture.bars else ()
    for tick, beside in zip(y_ticks, words, strict=False):
        axes.text(1.02, tick.part, beside, va="center", transform=axes.transAxes)
    if picture.rows:
        named = [handle for handle, shape in handles if shape.name]
        for handle, entry in zip(named, picture.entries, strict=True):
            handle.set_label(_label(entry.name))
        columns = len(picture.rows[0])
        high = picture.box.bottom - picture.box.top
        above = LINE / high if panel.title and not picture.title_beside else 0.0
        axes.legend(handles=named, ncols=columns, bbox_to_anchor=(1.0, 1.0 + above),
                    **LEGEND)  # fmt: skip


def _rule(
    axes: Axes,
    way: Literal["x", "y"],
    ruler: Ruler,
    ticks: Sequence[Tick],
    written: bool = True,
) -> None:
    """Give the axis "x" or "y" its scale, its ends and its numbers."""
    scale = ruler.axis.scale
    axes.set(**{f"{way}scale": scale if scale in MATPLOTLIB else "linear"})
    parts = np.array([0.0, 1.0, *(tick.part for tick in ticks)])
    values = INVERSES[scale](ruler.low + (ruler.high - ruler.low) * parts)
    words = [wrapped(tick.words) if written else "" for tick in ticks]
    axes.set(**{f"{way}ticks": values[2:], f"{way}ticklabels": words})
    axes.set(**{f"{way}lim": values[:2]})
    axes.tick_params(axis=way, rotation=90 if ruler.axis.words else 0)
    getattr(axes, f"{way}axis").set_minor_locator(NullLocator())


def _draw(axes: Axes, shape: Shape, scale: str) -> Any:
    """Draw a shape; return what a legend shows of it."""
    x, y, name = shape.x, shape.y, shape.name
    with np.errstate(invalid="ignore"):
        y = TRANSFORMS[scale](y) if scale == "normal" else y
    named: dict[str, Any] = {
        "color": ROLES[shape.colour], "alpha": shape.alpha if shape.alpha < 1 else None,
        "label": _label(name),
    }  # fmt: skip
    if shape.area and np.isinf(y).any():
        return axes.axvspan(x.min(), x.max(), linewidth=0, zorder=0, **named)
    if shape.area:
        seen = np.isfinite(x) & np.isfinite(y)
        runs = np.split(np.arange(len(x)), np.flatnonzero(~seen))
        corners = [c[run[seen[run]]] for run in runs for c in (x, y) if seen[run].any()]
        return axes.fill(*(corners or [x[:0], y[:0]]), linewidth=0, **named)[0]
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


def _label(name: str) -> str:
    """Return the name of a legend's entry, which hides what begins with _."""
    return f" {name}" if name.startswith("_") else name or "_unnamed"


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
