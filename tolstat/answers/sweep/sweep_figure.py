"""Grid runs as curves: responses over the swept axis, several runs in one picture."""

import math
from collections.abc import Sequence
from contextlib import suppress
from itertools import cycle
from pathlib import Path

import numpy as np

from tolstat.answers.output_file import check_ending, replace
from tolstat.answers.sweep import curves
from tolstat.document.blocks import Figure
from tolstat.document.plot import (
    CURVE_COLOURS,
    Layer,
    Plot,
    PlotAxis,
    PlotPanel,
    curve,
)
from tolstat.errors import QuestionError
from tolstat.model.view import Level
from tolstat.statistics.limits.limit import within
from tolstat.store.stored_run import Run

EVERY = (-math.inf, math.inf)
MOST_CURVES = 12
FEW_POINTS = 100  # have markers


def save_sweeps(runs: Sequence[Run], path: Path, responses: Sequence[str] = ()) -> None:
    """Draw grid runs over the same contributor or setting as curves, into a picture.

    By default it shows the responses with a reference or a limit.

    Raises
    ------
    QuestionError
        If a run is no grid, they do not sweep the same, or nothing is to be shown.
    """
    from tolstat.render.figures import draw
    from tolstat.render.picture import PICTURES, picture

    check_ending(path, "a picture", PICTURES)
    title = "\n".join(run.title for run in runs)
    figure = draw(sweep_plot(runs, responses), title)
    replace(path, picture(figure, path.suffix.lower()))


def sweep_plot(runs: Sequence[Run], responses: Sequence[str] = ()) -> Plot:
    """Return one picture for each response, with its limit and the reference."""
    axis = curves.swept_axis(runs[0])
    words = tuple(curves.words_along(runs[0], axis))
    for run in runs[1:]:
        other = curves.swept_axis(run)
        others = tuple(curves.words_along(run, other))
        if (other, others) != (axis, words):
            raise QuestionError(
                f"{runs[0].path} sweeps {' '.join([axis, *words])}, {run.path} sweeps "
                f"{' '.join([other, *others])}; draw them separately"
            )
    chosen = list(responses) or curves.responses_of_interest(runs[0])
    if not chosen:
        raise QuestionError(
            f"{runs[0].path} limits no response; name the responses to draw"
        )
    x = _axis(runs[0], axis)
    panels = tuple(_panel(runs, axis, x, response) for response in chosen)
    height = 3.3 * len(chosen) + 0.5
    return Plot(panels, width=7.0, height=height, legends=True)


def point_figure(run: Run, response: str) -> Figure:
    """Return a figure of a response: curves, or points where these are too many.

    Points that miss a limit have its colour. With two axes of numbers they stand in
    the plane of both, else the response stands over the axis, or over the trials.
    """
    words, axes = f"{response} of each trial", list[str]()
    with suppress(QuestionError):  # no axis, or too many curves
        axes = [curves.swept_axis(run)]
        return Figure(words, sweep_plot([run], [response]), wide=True)
    limit = run.limits.get(response)
    axes += [axis for axis in run.grid if axes and axis not in axes]
    plane = [(_axis(run, axis), curves.places(run, axis)) for axis in axes]
    if len(plane) != 2 or plane[1][0].words:
        trials = (PlotAxis("trial"), np.arange(run.trials, dtype=float))
        values = (PlotAxis.of(response, run.scales[response]), run.column(response))
        plane = [(plane or [trials])[0], values]
    (x, along), (y, up) = plane
    met = within(run.column(response), limit.permitted if limit else EVERY)
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


def _axis(run: Run, axis: str) -> PlotAxis:
    """Return an axis of the grid as one of a picture."""
    label = axis.removeprefix(curves.TAKEN)
    if words := curves.words_along(run, axis):
        return PlotAxis(label, words=tuple(words))
    return PlotAxis.of(label, curves.axis_scale(run, axis))


def _panel(runs: Sequence[Run], axis: str, x: PlotAxis, response: str) -> PlotPanel:
    # a response that the first run does not have is refused by `sweeps`
    scale = runs[0].scales.get(response)
    y = PlotAxis.of(response, scale) if scale else PlotAxis(response)
    layers, colours = list[Layer](), cycle(CURVE_COLOURS)
    cuts = ((run, cut) for run in runs for cut in curves.sweeps(run, axis, response))
    for run, cut in cuts:
        of_run = run.path.stem if len(runs) > 1 else ""
        label = ": ".join(part for part in (of_run, cut.label) if part) or "run"
        line = "line" if len(cut.x) >= FEW_POINTS else "dotted"
        look = "dots" if x.words else line
        layers.append(curve(cut.x, cut.y, next(colours), label, look))
    if len(layers) > MOST_CURVES:
        raise QuestionError(
            f"{len(layers)} curves are too many for one picture ({MOST_CURVES}); sweep "
            "less"
        )
    for run in runs:
        columns = run.reference.columns if run.reference else {}
        if run.reference and response in columns and axis in columns:
            label = run.reference.label
            layers.append(
                curve(columns[axis], columns[response], "ink", label, "rings")
            )
    for limit in {run.limits[response] for run in runs if response in run.limits}:
        for i, end in enumerate(filter(math.isfinite, limit.permitted)):
            layers.append(Level(end, "" if i else f"limit {limit.words}"))
    return PlotPanel(x, y, tuple(layers))
