"""Views of a model, as data with names and units: charts, and tables of rows.

All numbers are SI; a renderer chooses the units.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.units.conversion import dimension

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.model.description import Response


class Axis(NamedTuple):
    """The axis of a chart, or a column of a table."""

    name: str
    unit: str  # SI
    shown: str = ""  # unit in which it is shown; by its size if empty
    logarithmic: bool = False
    least: float = 0.0  # SI: start of a logarithmic axis


class Curve(NamedTuple):
    """One quantity over the axis of its chart.

    Where a response has the same name, its peak is the curve's.
    """

    name: str
    unit: str
    symbol: str
    sentence: str
    values: Array  # [point], SI; NaN leaves a gap
    at: Array | None = None  # [point], SI, on the axis; the chart's own points if None
    shown: str = ""  # unit in which it is shown; by its size if empty
    points: bool = False  # drawn as points, such as measured ones, not as a line
    colour: str = ""  # its role in a figure; by its place in its panel if empty
    # "line", "dotted" (a line whose points are seen), "dots", "faint" where there are
    # many of them, "large" or "rings"
    look: str = "line"

    @classmethod
    def of(cls, response: Response, values: Array) -> Curve:
        """Return the curve whose peak is a response, with the response's name."""
        sentence = response.sentence.removeprefix("peak of ").removeprefix("peak ")
        symbol, shown = response.symbol.strip("|"), response.shown
        return cls(response.name, response.unit, symbol, sentence, values, shown=shown)


class Band(NamedTuple):
    """The range of a curve: two values at each of the chart's points.

    It takes the colour of its curve; beside points it is drawn as bars.
    """

    name: str  # for the legend
    unit: str
    lower: Array  # [point], SI
    upper: Array
    of: str = ""  # its curve; empty without one
    colour: str = ""
    bars: bool = False  # upright ones, beside points


def bands_of(name: str, unit: str, values: Array) -> tuple[Band, ...]:
    """Return the band of a curve from float64[trial, point]; none without trials.

    It lies between their 5 % and 95 % quantiles.
    """
    if not len(values):
        return ()
    with np.errstate(invalid="ignore"):
        lower, upper = np.quantile(values, (0.05, 0.95), axis=0)
    return (Band(f"{name}, 5..95 %", unit, lower, upper, of=name),)


class Mark(NamedTuple):
    """A dot on the curve of that name, in its colour."""

    curve: str
    at: float  # SI
    value: float
    words: str = ""  # for the legend, before the value: "peak"


def peaks_of(
    curves: Sequence[Curve], at: Array, *, least: float = -np.inf, words: str = "peak"
) -> tuple[Mark, ...]:
    """Return marks where curves over the points `at` are greatest to either side.

    Peaks count from `least` on; a curve that ends in a failure, NaN, has none.
    """
    marks = []
    for curve in curves:
        counts = np.isfinite(curve.values) & (at >= least)
        top = int(np.where(counts, np.abs(curve.values), -1.0).argmax())
        if np.isfinite(curve.values[-1]) and counts[top]:
            value = float(curve.values[top])
            marks.append(Mark(curve.name, float(at[top]), value, words))
    return tuple(marks)


class Region(NamedTuple):
    """An area: the outline of what is possible, stable, permitted."""

    name: str  # for the legend
    unit: str  # SI, of the values
    at: Array  # [corner], SI
    values: Array
    colour: str = ""


class Span(NamedTuple):
    """A shaded part of the axis: from, to (SI), in words; a line where both are one."""

    lower: float
    upper: float
    words: str
    colour: str = "ink"
    dash: str = ":"


class Level(NamedTuple):
    """A value (SI) marked across a panel; words are its name."""

    value: float
    words: str
    colour: str = "limit"
    dash: str = "--"


class Panel(NamedTuple):
    """The content of one picture of a chart."""

    title: str
    names: tuple[str, ...]  # curves, bands and regions of one unit
    right: tuple[str, ...] = ()  # curves of another unit, against an axis on the right
    levels: tuple[Level, ...] = ()
    logarithmic: bool = False
    spans: tuple[Span, ...] = ()  # shaded in this picture alone

    @classmethod
    def of(cls, title: str, *items: Curve | Band | Region, **more: Any) -> Panel:
        """Return the picture of these curves, bands and regions."""
        return cls(title, tuple(item.name for item in items), **more)

    @property
    def every(self) -> tuple[str, ...]:
        """Names of all curves, bands and regions that it shows."""
        return (*self.names, *self.right)


class Picture:
    """A panel with what it shows, for `Chart.of`; arguments as those of `Panel.of`."""

    def __init__(self, title: str, *items: Curve | Band | Region, **more: Any) -> None:
        self.panel, self.items = Panel.of(title, *items, **more), items


@dataclass(frozen=True)
class Chart:
    """Curves, bands, marks and regions over one axis."""

    axis: Axis
    at: Array  # [point], SI: where on the axis the curves have their values
    curves: tuple[Curve, ...] = ()
    bands: tuple[Band, ...] = ()
    marks: tuple[Mark, ...] = ()
    regions: tuple[Region, ...] = ()
    spans: tuple[Span, ...] = ()
    panels: tuple[Panel, ...] = ()

    @classmethod
    def of(cls, axis: Axis, at: Array, *pictures: Picture, **more: Any) -> Chart:
        """Return the chart of these pictures, with all that they show."""
        items = {item.name: item for picture in pictures for item in picture.items}
        curves = tuple(i for i in items.values() if isinstance(i, Curve))
        bands = tuple(i for i in items.values() if isinstance(i, Band))
        regions = (i for i in items.values() if isinstance(i, Region))
        more["regions"] = tuple(regions)
        more["panels"] = tuple(picture.panel for picture in pictures)
        return cls(axis, at, curves, bands, **more)

    @property
    def pictures(self) -> tuple[Panel, ...]:
        """Its panels; one for each unit where it has none."""
        units: dict[str, list[str]] = {}
        for name, unit in self.units.items():
            units.setdefault(unit, []).append(name)
        return self.panels or tuple(Panel("", tuple(names)) for names in units.values())

    @property
    def items(self) -> list[Curve | Band | Region]:
        """Its curves, bands and regions."""
        return [*self.curves, *self.bands, *self.regions]

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each curve, band and region."""
        return {item.name: item.unit for item in self.items}

    def columns(self) -> Iterator[tuple[Axis, Array]]:
        """Yield the axis, then curves and bands over its points, each with its unit."""
        yield self.axis, self.at
        for curve in self.curves:
            if curve.at is None:
                yield Axis(curve.name, curve.unit, curve.shown), curve.values
        shown = {curve.name: curve.shown for curve in self.curves}
        for band in self.bands:
            for side, ends in (("lower", band.lower), ("upper", band.upper)):
                name = f"{band.name}, {side}"
                yield Axis(name, band.unit, shown.get(band.of, "")), ends

    def parts(self) -> Iterator[tuple[str, Array, Array]]:
        """Yield all curves, bands and regions: name, where on the axis, values, SI."""
        for curve in self.curves:
            yield curve.name, self.at if curve.at is None else curve.at, curve.values
        for band in self.bands:
            yield f"{band.name}, lower", self.at, band.lower
            yield f"{band.name}, upper", self.at, band.upper
        for region in self.regions:
            yield region.name, region.at, region.values

    def frame(self) -> pd.DataFrame:
        """Return the curves and bands as a DataFrame over the axis, SI.

        `attrs["units"]` holds the units. Curves with separate points are left out.
        """
        (axis, _), *_ = columns = [*self.columns()]
        return _frame(columns).set_index(axis.name)


@dataclass(frozen=True)
class Listing:
    """Rows: a catalogue of designs, a table of frequencies."""

    heads: tuple[Axis, ...]  # of the columns
    values: tuple[NDArray[np.generic], ...]  # column by column: numbers, SI, or words
    sentence: str = ""  # describes a row

    @classmethod
    def of(
        cls, sentence: str, *columns: tuple[str, str, str, NDArray[np.generic]]
    ) -> Listing:
        """Return rows, from columns: name, SI unit, unit shown, values."""
        heads = tuple(Axis(name, unit, shown) for name, unit, shown, _ in columns)
        return cls(heads, tuple(column[3] for column in columns), sentence)

    def columns(self) -> Iterator[tuple[Axis, NDArray[np.generic]]]:
        """Yield each column with its head."""
        yield from zip(self.heads, self.values, strict=True)

    def parts(self) -> Iterator[tuple[str, NDArray[np.generic], NDArray[np.generic]]]:
        """Yield each column over the first: name, the first, values."""
        for head, values in self.columns():
            yield head.name, self.values[0], values

    def frame(self) -> pd.DataFrame:
        """Return the rows as a DataFrame, SI; `attrs["units"]` holds the units."""
        return _frame([*self.columns()])


View = Chart | Listing


def typed_unit(quantity: Any, typed: Mapping[str, str]) -> str:
    """Return the unit of a quantity: as typed, by name or kind; else as declared.

    A bare number is no unit for a count or a ratio.
    """
    kind, declared = dimension(quantity.unit), str(quantity.shown)
    units = (typed.get(key, "") for key in (quantity.name, str(kind)))
    for unit in filter(None, units):
        if dimension(unit) == kind and not (unit == "1" and declared):
            return unit
    return declared


def in_units(view: View, typed: Mapping[str, str]) -> Any:
    """Return a view in typed units; see `typed_unit`."""

    def retyped(items: Any) -> Any:
        return tuple(item._replace(shown=typed_unit(item, typed)) for item in items)

    if isinstance(view, Listing):
        return replace(view, heads=retyped(view.heads))
    return replace(view, axis=retyped([view.axis])[0], curves=retyped(view.curves))


class Offer(NamedTuple):
    """A view that a model offers, by the name that is typed.

    The function gets deviations[trial, contributor], SI, and the settings. The first
    trial is shown; `n_others` trials of the study follow, for bands. Without
    tolerances there is only the first.
    """

    name: str
    sentence: str  # describes the view
    function: Callable[[Array, Any], View]
    n_others: int = 0


def _frame(columns: list[tuple[Axis, NDArray[Any]]]) -> pd.DataFrame:
    import pandas as pd

    frame = pd.DataFrame({head.name: values for head, values in columns})
    frame.attrs["units"] = {head.name: head.unit for head, _ in columns}
    return frame
