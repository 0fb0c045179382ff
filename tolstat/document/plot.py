"""A figure as data: panels of layers over axes with their units.

Curves, bands, regions, spans and levels are those of a model's views.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.model.view import Band, Curve, Level, Region, Span
from tolstat.units.scale import Scale

CURVE_COLOURS = ("first", "second", "third", "fourth", "fifth", "sixth")


class Histogram(NamedTuple):
    """Bars without gaps: one more edge than heights."""

    edges: Array
    heights: Array
    colour: str = "first"
    name: str = ""


class Bars(NamedTuple):
    """Horizontal bars by name, the first on top; `ends`: [2, bar], or None."""

    names: tuple[str, ...]
    values: Array  # where they end
    ends: Array | None = None
    colour: str = "first"
    name: str = ""
    starts: Array | None = None  # where they begin; None: at zero
    colours: tuple[str, ...] = ()  # of each bar; empty: that of all
    words: tuple[str, ...] = ()  # on the right of the panel, one for each bar
    look: str = "bars"  # or "steps", with a line from each end to the next, or "arrows"


class Mark(NamedTuple):
    """An upright line with its words above the panel."""

    value: float
    words: str
    colour: str = "ink"
    dash: str = "-"


class Intervals(NamedTuple):
    """Intervals above the rest, each with its estimate."""

    lower: Array
    upper: Array
    values: Array
    colour: str = "second"
    name: str = ""


Layer = Curve | Band | Region | Span | Level | Histogram | Bars | Mark | Intervals


def curve(
    x: Array, y: Array, colour: str = "first", name: str = "", look: str = "line"
) -> Curve:
    """Return a curve of a figure, in the units of its axes."""
    return Curve(name, "", "", "", y, x, colour=colour, look=look)


class PlotAxis(NamedTuple):
    """An axis."""

    label: str  # the quantity, with its unit
    scale: str = ""  # or "log", "symlog", "normal" for shares as normal scores
    ends: tuple[float, float] | None = None  # in the unit of the label; None: by data
    words: tuple[str, ...] = ()  # at 0, 1, 2, ... instead of numbers
    factor: float = 1.0  # times the numbers of the layers: those of the label

    @classmethod
    def of(cls, name: str, scale: Scale) -> PlotAxis:
        """Return the axis of a quantity whose numbers are SI."""
        return cls(scale.label(name), factor=scale.factor)


class PlotPanel(NamedTuple):
    """One picture: layers over two axes; `right`: more against an axis there."""

    x: PlotAxis
    y: PlotAxis
    layers: tuple[Layer, ...]
    title: str = ""
    right: PlotPanel | None = None
    at: Array = np.empty(0)  # where layers without places of their own have values


class Plot(NamedTuple):
    """Panels, one below the other or `side_by_side`; size in inches.

    One axis is shared by all: that along, or that up where they are side by side.
    """

    panels: tuple[PlotPanel, ...]
    side_by_side: bool = False
    width: float = 3.5
    height: float = 2.5
    legends: bool = False  # each panel has its own, beside its title; else one for all
