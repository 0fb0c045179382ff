"""A figure as data: panels of layers, in the units that are shown."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Line(NamedTuple):
    """A curve; `colour` names its role."""

    x: Array
    y: Array
    colour: str = "first"
    label: str = ""


class Points(NamedTuple):
    """Dots; `faint` where there are many of them."""

    x: Array
    y: Array
    colour: str = "first"
    label: str = ""
    faint: bool = False


class Fill(NamedTuple):
    """The area between two curves."""

    x: Array
    lower: Array
    upper: Array
    colour: str = "first"
    label: str = ""


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


class Ranges(NamedTuple):
    """Intervals by name, one below the other, each with its estimate."""

    names: tuple[str, ...]
    lower: Array
    upper: Array
    at: Array
    colours: tuple[str, ...]


Layer = Line | Points | Fill | Stairs | Bars | Rule | Spans | Ranges


class PlotAxis(NamedTuple):
    """An axis; `scale`: "", "log", "symlog", or "normal" for shares as normal scores.

    Attributes
    ----------
    label, scale : str
        What goes along it, with its unit; how.
    ends : tuple of float or None
        Where it begins and ends; None: by what is shown.
    """

    label: str
    scale: str = ""
    ends: tuple[float, float] | None = None


class PlotPanel(NamedTuple):
    """One picture: layers over two axes."""

    x: PlotAxis
    y: PlotAxis
    layers: tuple[Layer, ...]


class Plot(NamedTuple):
    """Panels, one below the other or `side_by_side`; size in inches.

    Attributes
    ----------
    panels : tuple of PlotPanel
        One axis is shared by all: that along, or that up where they are side by side.
    side_by_side : bool
        How they lie.
    width, height : float
        Of the whole.
    """

    panels: tuple[PlotPanel, ...]
    side_by_side: bool = False
    width: float = 3.5
    height: float = 2.5
