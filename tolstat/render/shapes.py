"""What a panel shows, as shapes over its axes, for pages and for files."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, assert_never

import numpy as np

from tolstat.arrays import Array
from tolstat.document.plot import Bars, Histogram, Intervals, Layer, Mark, PlotPanel
from tolstat.model.view import Band, Curve, Level, Region, Span

ENDS = np.array([-np.inf, np.inf])  # of an axis
WIDE, HALF_ALPHA = 6.0, 0.25  # points, of an upright bar; of a band
ABOVE = 1.1  # of the highest bar: where intervals stand
THICKNESS = {"bars": 0.72, "steps": 0.5, "arrows": 0.04}  # of a row
FINE = 0.8  # points


class Shape(NamedTuple):
    """A line, an area or dots, in the units of the labels of the axes."""

    x: Array  # NaN leaves a gap; infinite ends are those of the axis
    y: Array
    colour: str  # its role
    width: float = 1.2  # of a line, points
    dash: str = "-"  # empty: no line
    area: bool = False
    dot: str = ""  # "o", "rings", "|", "<" or ">"
    size: float = 2.0  # of a dot, points
    alpha: float = 1.0
    name: str = ""  # in the legend
    clip: bool = True  # at the ends of the axes
    based: str = ""  # "x" or "y": it stands on zero, where the axis ends


LOOKS: dict[str, dict[str, Any]] = {
    "line": {},
    "dashed": {"dash": "--"},
    "dotted": {"dot": "o", "size": 3.0},
    "dots": {"dot": "o", "dash": "", "size": 1.5},
    "faint": {"dot": "o", "dash": "", "size": 1.1, "alpha": 0.4},
    "large": {"dot": "o", "dash": "", "size": 4.0, "clip": False},  # whole at an end
    "rings": {"dot": "rings", "dash": "", "size": 6.0},
}


def shapes_of(panel: PlotPanel) -> list[Shape]:
    """Return what a panel shows, from back to front."""
    shapes: list[Shape] = []
    for layer in panel.layers:
        shapes += _shapes(layer, panel, shapes)
    return sorted(shapes, key=lambda shape: shape.colour != "grid")


def _shapes(layer: Layer, panel: PlotPanel, behind: Sequence[Shape]) -> Iterator[Shape]:
    along, up, colour = panel.x.factor, panel.y.factor, layer.colour
    match layer:
        case Curve():
            x = along * (panel.at if layer.at is None else layer.at)
            look = LOOKS["large" if layer.points else layer.look]
            yield Shape(x, up * layer.values, colour, name=layer.name, **look)
        case Band():
            x, ends = along * panel.at, up * np.array([layer.lower, layer.upper])
            named: dict[str, Any] = {"alpha": HALF_ALPHA, "name": layer.name}
            if layer.bars:
                y = np.vstack([ends, np.full(len(x), np.nan)]).T.ravel()
                yield Shape(np.repeat(x, 3), y, colour, WIDE, **named)
                return
            finite = np.isfinite(ends[0] + ends[1])
            for run in np.split(np.arange(len(x)), np.flatnonzero(~finite)):
                if len(run := run[finite[run]]):
                    outline = np.concatenate([run, run[::-1]])
                    y = np.concatenate([ends[0][run], ends[1][run][::-1]])
                    yield Shape(x[outline], y, colour, area=True, **named)
                    named["name"] = ""
        case Region():
            x, y = along * layer.at, up * layer.values
            yield Shape(x, y, colour, area=True, alpha=0.2, name=layer.name)
        case Span(lower, upper) if upper > lower:
            x = along * np.array([lower, lower, upper, upper])
            yield Shape(x, ENDS[[0, 1, 1, 0]], "grid", area=True, alpha=0.5)
        case Span():
            x = np.full(2, along * layer.lower)
            yield Shape(x, ENDS, colour, dash=layer.dash, name=layer.words)
        case Mark():  # its words stand above the panel
            yield Shape(np.full(2, along * layer.value), ENDS, colour, dash=layer.dash)
        case Level():
            y = np.full(2, up * layer.value)
            yield Shape(ENDS, y, colour, dash=layer.dash, name=layer.words)
        case Histogram(edges, heights):
            y = np.repeat(np.concatenate([[0.0], heights, [0.0]]), 2)[1:-1]
            yield Shape(
                np.repeat(edges, 2), y, colour, area=True, name=layer.name, based="y"
            )
        case Intervals(lower, upper, values):
            tops = [float(shape.y.max()) for shape in behind if shape.based == "y"]
            level = ABOVE * max(tops, default=1.0)
            for x in np.transpose([lower, upper]):
                yield Shape(x, np.full(2, level), colour, 2.5)
            y = np.full(len(values), level)
            yield Shape(values, y, colour, dash="", dot="|", size=6.0, name=layer.name)
        case Bars():
            yield from _bars(layer, panel)
        case _:
            assert_never(layer)


def _bars(bars: Bars, panel: PlotPanel) -> Iterator[Shape]:
    """Yield horizontal bars, in rows from 0 on."""
    places, half = np.arange(len(bars.names)), THICKNESS[bars.look] / 2
    ends = panel.x.factor * bars.values
    starts = 0.0 * ends if bars.starts is None else panel.x.factor * bars.starts
    colours = np.array(bars.colours or [bars.colour] * len(places))
    for colour in dict.fromkeys(colours.tolist()):
        a, b, row = (part[colours == colour] for part in (starts, ends, places))
        gap = np.full(len(row), np.nan)
        x = np.stack([a, b, b, a, gap], axis=1).ravel()
        y = np.stack([row - half, row - half, row + half, row + half, gap], axis=1)
        yield Shape(x, y.ravel(), colour, area=True, name=bars.name, based="x")
    if bars.ends is not None:
        reach = np.maximum([[-1.0], [1.0]] * (bars.ends - bars.values), 0.0)
        lower, upper = panel.x.factor * (bars.values + [[-1.0], [1.0]] * reach)
        x = np.stack([lower, upper, np.full(len(lower), np.nan)], axis=1).ravel()
        yield Shape(x, np.repeat(places, 3), "ink", FINE, dot="|", size=4.0)
    if bars.look == "bars":
        return
    for i, (start, end) in enumerate(zip(starts, ends, strict=True)):
        at = np.array([end]), np.array([float(i)])
        if start == end:
            yield Shape(*at, "ink", dash="", dot="o", size=4.0, clip=False)
        elif bars.look == "arrows":
            dot = ">" if end > start else "<"
            yield Shape(*at, colours[i], dash="", dot=dot, size=5.0, clip=False)
        if i + 1 < len(starts) and starts[i + 1] == end:
            yield Shape(np.full(2, end), np.array([i, i + 1.0]), "ink", FINE, ":")
