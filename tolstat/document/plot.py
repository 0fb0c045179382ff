"""A figure as data: panels of layers, in the units that are shown."""

from __future__ import annotations

from typing import NamedTuple

from tolstat.arrays import Array


class Line(NamedTuple):
    """A curve, or dots; `colour` names its role.

    `look` is "line", "dotted" (a line whose points are seen), "dots", "faint" where
    there are many of them, "large" or "rings".
    """

    x: Array
    y: Array
    colour: str = "first"
    label: str = ""
    look: str = "line"


class Fill(NamedTuple):
    """The area between two curves; `bars`: upright ones, beside points."""

    x: Array
    lower: Array
    upper: Array
    colour: str = "first"
    label: str = ""
    bars: bool = False


class Area(NamedTuple):
    """The area within an outline."""

    x: Array
    y: Array
    colour: str = "first"
    label: str = ""


class Shade(NamedTuple):
    """A stretch of the axis along, shaded."""

    lower: float
    upper: float


class Stairs(NamedTuple):
    """Bars of a histogram: one more edge than heights."""

    edges: Array
    heights: Array
    colour: str = "first"
    label: str = ""


class Bars(NamedTuple):
    """Horizontal bars by name, the first on top; `ends`: [2, bar], or None."""

    names: tuple[str, ...]
    values: Array
    ends: Array | None = None
    colour: str = "first"
    label: str = ""


class Rule(NamedTuple):
    """A line across the panel: at an `x` (upright), or at a `y`."""

    at: float
    upright: bool
    colour: str = "ink"
    label: str = ""
    dash: str = "--"


class Spans(NamedTuple):
    """Intervals above the rest, each with its estimate."""

    lower: Array
    upper: Array
    at: Array
    colour: str = "second"
    label: str = ""


Layer = Line | Fill | Area | Shade | Stairs | Bars | Rule | Spans


class PlotAxis(NamedTuple):
    """An axis."""

    label: str  # the quantity, with its unit
    scale: str = ""  # or "log", "symlog", "normal" for shares as normal scores
    ends: tuple[float, float] | None = None  # None: by the data
    words: tuple[str, ...] = ()  # at 0, 1, 2, ... instead of numbers


class PlotPanel(NamedTuple):
    """One picture: layers over two axes; `right`: more against an axis there."""

    x: PlotAxis
    y: PlotAxis
    layers: tuple[Layer, ...]
    title: str = ""
    right: PlotPanel | None = None


class Plot(NamedTuple):
    """Panels, one below the other or `side_by_side`; size in inches.

    One axis is shared by all: that along, or that up where they are side by side.
    """

    panels: tuple[PlotPanel, ...]
    side_by_side: bool = False
    width: float = 3.5
    height: float = 2.5
    legends: bool = False  # each panel has its own, beside its title; else one for all
