"""A view drawn: charts as panels one above the other, listings as a table."""

from __future__ import annotations

from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tolstat.arrays import Array
from tolstat.errors import PictureError
from tolstat.model.view import Band, Chart, Curve, Listing, Panel, Region, View
from tolstat.render.picture import COLOURS, logarithmic, mark_level, styled
from tolstat.render.view_table import view_rows, view_scale
from tolstat.units.scale import Scale

WINDOW = "#f2f2f2"
LEGEND_COLUMNS = 4, 3, 2, 1  # as many as find room
LINE, HANDLE = 98, 5  # letters beside each other; what stands before a word of a legend
ROOM = 0.03  # of the axis, beside a dot at its end
MOST_ROWS = 60  # of a listing that is drawn
Handles = list[Line2D | Patch]


def draw_view(view: View, title: str) -> Figure:
    """Draw what a machine shows.

    Parameters
    ----------
    view : Chart or Listing
        As a machine returns it.
    title : str
        Which machine.

    Returns
    -------
    Figure
        A page. Of a chart: spans are shaded, marks are dots on their curves, and the
        legend says how high they are.

    Raises
    ------
    PictureError
        If a listing has more rows than a picture can hold.
    """
    with styled():
        figure = _chart(view) if isinstance(view, Chart) else _listing(view)
        figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def _chart(chart: Chart) -> Figure:
    panels = chart.pictures
    figure = Figure(figsize=(8.0, max(1.75 * len(panels) + 0.8, 3.6)))
    figure.set_layout_engine("constrained")
    every = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    along = along_of(chart)
    for axes, panel in zip(every, panels, strict=True):
        axes.set_title(panel.title or " ")  # the line that the legend stands on
        for span in (*chart.spans, *panel.spans):
            ends = along.factor * span.lower, along.factor * span.upper
            axes.axvspan(*ends, color=WINDOW, zorder=0)
        handles = _draw(axes, chart, panel.names, 0, panel)
        if panel.right:
            right = axes.twinx()
            right.grid(visible=False)
            right.spines["right"].set_visible(True)
            handles += _draw(right, chart, panel.right, len(panel.names), None)
        # above the picture, on the line of its title, where it covers nothing
        columns = _columns(panel.title, [str(h.get_label()) for h in handles])
        legend = axes.legend(
            handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0),
            ncols=columns, borderaxespad=0.1, handlelength=1.4, columnspacing=1.2,
        )  # fmt: skip
        legend.set_in_layout(len(handles) > columns)  # further lines need room
        if panel.logarithmic:
            logarithmic(axes.yaxis)
    shaded = [*chart.spans, *(span for panel in panels for span in panel.spans)]
    said = "; ".join(dict.fromkeys(span.words for span in shaded if span.words))
    label = along.label(chart.axis.name)
    every[-1].set_xlabel(f"{label} (shaded: {said})" if said else label)
    if chart.axis.logarithmic:
        logarithmic(every[-1].xaxis)
    places = np.concatenate([at for _, at, _ in chart.parts()] or [chart.at])
    places = places[np.isfinite(places)]
    if chart.axis.logarithmic:
        places = places[places > chart.axis.least]
    if len(places) and places.min() < places.max():
        first, last = places.min(), places.max()
        dots = [mark.at for mark in chart.marks]
        for curve in chart.curves:
            if curve.points:
                dots += (chart.at if curve.at is None else curve.at).tolist()
        if not chart.regions and np.isin([first, last], dots).any():
            evenly = every[0].xaxis.get_transform()
            left, right = evenly.transform([first, last])
            room = ROOM * (right - left)
            first, last = evenly.inverted().transform([left - room, right + room])
        every[0].set_xlim(along.factor * first, along.factor * last)
    return figure


def _columns(title: str, labels: list[str]) -> int:
    """Return how many columns of a legend find room beside a title."""
    letters = np.array([len(label) + HANDLE for label in labels])
    for columns in LEGEND_COLUMNS:
        # filled one after the other, each as wide as the longest of its labels
        filled = [part for part in np.array_split(letters, columns) if len(part)]
        if len(title) + sum(part.max() for part in filled) <= LINE:
            break
    return columns


def along_of(chart: Chart) -> Scale:
    """Return how the axis of a chart is shown."""
    return view_scale(chart.axis.unit, chart.axis.shown, chart.at)


def _draw(
    axes: Axes, chart: Chart, names: tuple[str, ...], first: int, panel: Panel | None
) -> Handles:
    """Draw curves, bands and regions of one unit; return what the legend shows."""
    curves = [c for c in chart.curves if c.name in names]
    bands = [b for b in chart.bands if b.name in names]
    regions = [r for r in chart.regions if r.name in names]
    scale = _scale(curves, [*bands, *regions])
    axes.set_ylabel(scale.mark)
    x, times = along_of(chart).factor, scale.factor
    of = {band.name: band.of for band in bands if band.of in names}
    leading = [name for name in names if name not in of]
    colours = dict(zip(leading, cycle(COLOURS[first:] + COLOURS[:first]), strict=False))
    dots = {curve.name for curve in curves if curve.points}
    handles: Handles = []
    for region in regions:
        (drawn,) = axes.fill(
            x * region.at, times * region.values, color=colours[region.name], alpha=0.2,
            linewidth=0, label=region.name,
        )  # fmt: skip
        handles.append(drawn)
    for band in bands:
        colour = colours[of.get(band.name, band.name)]
        ends = x * chart.at, times * band.lower, times * band.upper
        if band.of in dots:
            axes.vlines(*ends, color=colour, alpha=0.25, linewidth=6)
        else:
            axes.fill_between(*ends, color=colour, alpha=0.25, linewidth=0)
        handles.append(Patch(color=colour, alpha=0.25, label=band.name))
    for curve in curves:
        at = chart.at if curve.at is None else curve.at
        look = "o" if curve.points else "-"
        (line,) = axes.plot(
            x * at, times * curve.values, look, color=colours[curve.name], markersize=4,
            clip_on=not curve.points,  # no dot is cut by the end of an axis
        )  # fmt: skip
        words = curve.name.replace("_", " ")
        for mark in chart.marks:
            if mark.curve == curve.name:
                axes.plot(
                    x * mark.at, times * mark.value, "o", color=line.get_color(),
                    markersize=4,
                )  # fmt: skip
                if mark.words:
                    words += f": {mark.words} {scale.words(mark.value)}"
        line.set_label(words)
        handles.append(line)
    for level in panel.levels if panel else ():
        line = mark_level(axes, times * level.value, level.words)
        handles += [line] if level.words else []
    if curves and not any(_moves(curve.values) for curve in curves):
        axes.set_ylim(-1, 1)  # nothing moves: no axis of rounding errors
    return handles


def _moves(values: Array) -> bool:
    """Tell whether a curve is more than one value; it may have gaps."""
    there = values[np.isfinite(values)]
    return len(there) > 0 and bool(np.ptp(there) > 0)


def _scale(curves: list[Curve], others: list[Band | Region]) -> Scale:
    """Choose one unit for all that a panel shows, by the largest of it."""
    first = curves[0] if curves else others[0]
    values = [curve.values for curve in curves]
    for each in others:
        values += [v for v in each[2:] if isinstance(v, np.ndarray)]
    return view_scale(first.unit, getattr(first, "shown", ""), *values)


def _listing(listing: Listing) -> Figure:
    heads, rows = view_rows(listing)
    if len(rows) > MOST_ROWS:
        raise PictureError(
            f"{len(rows)} rows are too many for a picture ({MOST_ROWS}); write them to "
            "a .csv or an .html file"
        )
    rows = rows or [["none"] + [""] * (len(heads) - 1)]
    figure = Figure(figsize=(1.2 + 1.1 * len(heads), 1.2 + 0.24 * len(rows)))
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.86))
    axes.set_axis_off()
    table = axes.table(rows, colLabels=heads, loc="upper left", cellLoc="right")
    table.auto_set_font_size(False)
    table.set_fontsize(8)
    table.auto_set_column_width(list(range(len(heads))))
    return figure
