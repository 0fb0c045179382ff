"""Grid runs as curves: a response over one axis, several runs in one picture."""

from collections.abc import Sequence
from contextlib import suppress
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tolstat.answers.output_file import as_pictures, save
from tolstat.arrays import Array
from tolstat.document.blocks import Figure
from tolstat.document.plot import CURVE_COLOURS, Layer, Plot, PlotAxis, PlotPanel, curve
from tolstat.errors import QuestionError, allowed_names
from tolstat.model.view import Level
from tolstat.statistics.limits.limit import NO_LIMIT, within
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

TAKEN = "settings."  # before an axis whose name a contributor has too
MOST_CURVES = 12
FEW_POINTS = 100  # have markers


class GridAxis(NamedTuple):
    """An axis of a grid."""

    name: str
    values: Array  # of each trial: float64, SI, or words
    scale: Scale

    @property
    def words(self) -> list[str]:
        """Its words, in their order; none where it has numbers."""
        return [] if self.values.dtype.kind == "f" else self.distinct

    @property
    def distinct(self) -> list[Any]:
        """Its values, each once."""
        return list(dict.fromkeys(self.values.tolist()))

    @property
    def places(self) -> Array:
        """Where trials stand along it, SI; words by their number."""
        words = self.words
        numbers = map(words.index, self.values.tolist()) if words else self.values
        return np.array([*numbers], dtype=float)

    @property
    def title(self) -> str:
        """Its name, as shown."""
        return self.name.removeprefix(TAKEN)

    @property
    def plotted(self) -> PlotAxis:
        """The axis of a picture."""
        if words := self.words:
            return PlotAxis(self.title, words=tuple(words))
        return PlotAxis.of(self.title, self.scale)

    def words_of(self, value: float | str) -> str:
        """Return one of its values with its name and unit."""
        if not isinstance(value, str):
            value = f"{self.scale.factor * value:.6g} {self.scale.mark}".strip()
        return f"{self.title} {value}"


class Sweep(NamedTuple):
    """One curve."""

    label: str  # what is the same along it: the other axes of the grid
    same: dict[str, Any]  # the same as values, SI, by axis
    x: Array  # float64[point], the swept values; words by number: `GridAxis.places`
    y: Array  # float64[point], the response, SI; NaN where a trial failed


def grid_axis(run: Run, name: str) -> GridAxis:
    """Return an axis of the grid by the first column that it moved."""
    columns = [column.name for column in run.swept]
    columns += [part.name for part in run.contributors]
    if (moved := name) not in columns:
        moved = next(column for column in columns if column.rpartition("_")[0] == name)
    return GridAxis(name, run.column(moved), run.scales[moved])


def swept_axis(run: Run) -> str:
    """Return the axis of the grid with most numbers, else with most words.

    Raises
    ------
    QuestionError
        If the run is no grid, or has no axis of two values.
    """
    if not run.grid:
        raise QuestionError(
            f'{run.path}: only a run with sampling = "grid" is shown as curves'
        )
    axes = [grid_axis(run, name) for name in run.grid]
    several = [axis for axis in axes if len(axis.distinct) > 1]
    if not several:
        raise QuestionError(f"{run.path}: nothing in its grid has two values or more")
    return max(several, key=lambda axis: (not axis.words, len(axis.distinct))).name


def sweeps(run: Run, axis: str, response: str) -> list[Sweep]:
    """Return the curves of a grid run along an axis, one for each other combination.

    Raises
    ------
    QuestionError
        If the run has no such response.
    """
    names = [described.name for described in run.responses]
    if response not in names:
        raise QuestionError(
            f"no response '{response}'; {allowed_names(response, names)}"
        )
    others = [grid_axis(run, name) for name in run.grid if name != axis]
    x, y = grid_axis(run, axis).places, run.column(response)
    columns = [other.values.tolist() for other in others]
    trials_at: dict[tuple[Any, ...], list[int]] = {}
    for trial in range(run.trials):
        point = tuple(column[trial] for column in columns)
        trials_at.setdefault(point, []).append(trial)
    curves = []
    for point, trials in trials_at.items():
        pairs = [*zip(others, point, strict=True)]
        label = ", ".join(other.words_of(value) for other, value in pairs)
        rows = np.array(trials)[np.argsort(x[trials], kind="stable")]
        same = {other.name: value for other, value in pairs}
        curves.append(Sweep(label, same, x[rows], y[rows]))
    return curves


def responses_of_interest(run: Run) -> list[str]:
    """Return the responses with a reference or a limit."""
    columns = run.reference.columns if run.reference else ()
    referenced = [name for name in columns if name in run.units][1:]
    limited = [name for name in run.limits if name not in referenced]
    return [*referenced, *limited]


def point_words(run: Run, trial: int) -> str:
    """Return where a trial stands in the grid; of a table its number."""
    axes = (grid_axis(run, name) for name in run.grid)
    words = (axis.words_of(axis.values.tolist()[trial]) for axis in axes)
    return ", ".join(words) or f"trial {trial}"


def save_sweeps(runs: Sequence[Run], path: Path, responses: Sequence[str] = ()) -> None:
    """Draw grid runs over the same contributor or setting as curves, into a picture.

    By default it shows the responses with a reference or a limit.

    Raises
    ------
    QuestionError
        If a run is no grid, they do not sweep the same, or nothing is to be shown.
    """
    from tolstat.render.figures import draw

    title = "\n".join(run.title for run in runs)
    pictures = as_pictures(lambda: draw(sweep_plot(runs, responses), title))
    save(path, "a picture", pictures)


def sweep_plot(runs: Sequence[Run], responses: Sequence[str] = ()) -> Plot:
    """Return one picture for each response, with its limit and the reference."""
    axes = [grid_axis(run, swept_axis(run)) for run in runs]
    axis, *others = (" ".join([axis.name, *axis.words]) for axis in axes)
    for run, other in zip(runs[1:], others, strict=True):
        if other != axis:
            raise QuestionError(
                f"{runs[0].path} sweeps {axis}, {run.path} sweeps {other}; draw them "
                "separately"
            )
    chosen = list(responses) or responses_of_interest(runs[0])
    if not chosen:
        raise QuestionError(
            f"{runs[0].path} limits no response; name the responses to draw"
        )
    panels = tuple(_panel(runs, axes[0], response) for response in chosen)
    height = 3.3 * len(chosen) + 0.5
    return Plot(panels, width=7.0, height=height, legends=True)


def point_figure(run: Run, response: str) -> Figure:
    """Return a figure of a response: curves, or points where these are too many.

    Points that miss a limit have its colour. With two axes of numbers they stand in
    the plane of both, else the response stands over the axis, or over the trials.
    """
    words, axes = f"{response} of each trial", list[str]()
    with suppress(QuestionError):  # no axis, or too many curves
        axes = [swept_axis(run)]
        return Figure(words, sweep_plot([run], [response]), wide=True)
    limit = run.limits.get(response)
    permitted = (limit or NO_LIMIT).permitted
    axes += [axis for axis in run.grid if axes and axis not in axes]
    plane = [(a.plotted, a.places) for a in (grid_axis(run, axis) for axis in axes)]
    if len(plane) != 2 or plane[1][0].words:
        trials = (PlotAxis("trial"), np.arange(run.trials, dtype=float))
        values = (PlotAxis.of(response, run.scales[response]), run.column(response))
        plane = [(plane or [trials])[0], values]
    (x, along), (y, up) = plane
    met = within(run.column(response), permitted)
    layers: list[Layer] = [
        curve(along[among], up[among], colour, label, "large")
        for among, colour, label in (
            (met, "first", "met" if limit else "trial"),
            (~met, "limit", f"out of limit {limit.words}" if limit else ""),
        )
        if among.any()
    ]
    panel = PlotPanel(x, y, tuple(layers), title=response)
    return Figure(words, Plot((panel,), width=7.0, height=3.8, legends=True), wide=True)


def _panel(runs: Sequence[Run], axis: GridAxis, response: str) -> PlotPanel:
    # a response that the first run does not have is refused by `sweeps`
    scale = runs[0].scales.get(response)
    values = PlotAxis.of(response, scale) if scale else PlotAxis(response)
    layers, colours = list[Layer](), cycle(CURVE_COLOURS)
    cuts = ((run, cut) for run in runs for cut in sweeps(run, axis.name, response))
    for run, cut in cuts:
        of_run = run.path.stem if len(runs) > 1 else ""
        label = ": ".join(part for part in (of_run, cut.label) if part) or "run"
        line = "line" if len(cut.x) >= FEW_POINTS else "dotted"
        look = "dots" if axis.words else line
        layers.append(curve(cut.x, cut.y, next(colours), label, look))
    if len(layers) > MOST_CURVES:
        raise QuestionError(
            f"{len(layers)} curves are too many for one picture ({MOST_CURVES}); sweep "
            "less"
        )
    for run in runs:
        columns = run.reference.columns if run.reference else {}
        if run.reference and response in columns and axis.name in columns:
            x, y, label = columns[axis.name], columns[response], run.reference.label
            layers.append(curve(x, y, "ink", label, "rings"))
    for limit in {run.limits[response] for run in runs if response in run.limits}:
        for i, end in enumerate(limit.finite):
            layers.append(Level(end, "" if i else f"limit {limit.words}"))
    return PlotPanel(axis.plotted, values, tuple(layers))
