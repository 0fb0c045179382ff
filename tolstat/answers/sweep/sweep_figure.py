"""Grid runs as curves: responses over the swept axis, several runs in one picture."""

import math
from collections.abc import Sequence
from contextlib import suppress
from itertools import cycle
from pathlib import Path

import numpy as np

from tolstat.answers.sweep import curves
from tolstat.document.blocks import Figure
from tolstat.document.plot import Layer, Line, Plot, PlotAxis, PlotPanel, Rule
from tolstat.errors import PictureError
from tolstat.render.output_file import check_ending
from tolstat.render.shown_view import CURVE_COLOURS
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
    PictureError
        If a run is no grid, they do not sweep the same, or nothing is to be shown.
    """
    from tolstat.render.figures import draw
    from tolstat.render.picture import PICTURES, write

    check_ending(path, "a picture", PICTURES, PictureError)
    title = "\n".join(run.title for run in runs)
    write(draw(sweep_plot(runs, responses), title), path)


def sweep_plot(runs: Sequence[Run], responses: Sequence[str] = ()) -> Plot:
    """Return one picture for each response, with its limit and the reference."""
    axis = curves.swept_axis(runs[0])
    words = tuple(curves.words_along(runs[0], axis))
    for run in runs[1:]:
        other = curves.swept_axis(run)
        others = tuple(curves.words_along(run, other))
        if (other, others) != (axis, words):
            raise PictureError(
                f"{runs[0].path} sweeps {' '.join([axis, *words])}, {run.path} sweeps "
                f"{' '.join([other, *others])}; draw them separately"
            )
    chosen = list(responses) or curves.responses_of_interest(runs[0])
    if not chosen:
        raise PictureError(
            f"{runs[0].path} limits no response; name the responses to draw"
        )
    x, along = _axis(runs[0], axis)
    panels = tuple(_panel(runs, axis, x, along, response) for response in chosen)
    height = 3.3 * len(chosen) + 0.5
    return Plot(panels, width=7.0, height=height, legends=True)


def point_figure(run: Run, response: str) -> Figure:
    """Return a figure of a response: curves, or points where these are too many.

    Points that miss a limit have its colour. With two axes of numbers they stand in
    the plane of both, else the response stands over the axis, or over the trials.
    """
    words, axes = f"{response} of each trial", list[str]()
    with suppress(PictureError):  # no axis, or too many curves
        axes = [curves.swept_axis(run)]
        return Figure(words, sweep_plot([run], [response]), wide=True)
    limit, scale = run.limits.get(response), run.scales[response]
    axes += [each for each in run.grid if axes and each not in axes]
    shown = [
        (x, factor * curves.places(run, each))
        for each in axes
        for x, factor in [_axis(run, each)]
    ]
    values = (PlotAxis(scale.label(response)), scale.factor * run.column(response))
    if len(shown) != 2 or shown[1][0].words:
        trials = (PlotAxis("trial"), np.arange(run.trials, dtype=float))
        shown = [(shown or [trials])[0], values]
    (x, at), (y, up) = shown
    met = within(run.column(response), limit.permitted if limit else EVERY)
    layers: list[Layer] = [
        Line(at[among], up[among], colour, label, "large")
        for among, colour, label in (
            (met, "first", "met" if limit else "trial"),
            (~met, "limit", f"out of limit {limit.words}" if limit else ""),
        )
        if among.any()
    ]
    panel = PlotPanel(x, y, tuple(layers), title=response)
    return Figure(words, Plot((panel,), width=7.0, height=3.8, legends=True), wide=True)


def _axis(run: Run, axis: str) -> tuple[PlotAxis, float]:
    """Return an axis of the grid as one of a picture, and the factor to its unit."""
    label = axis.removeprefix(curves.TAKEN)
    if words := curves.words_along(run, axis):
        return PlotAxis(label, words=tuple(words)), 1.0
    scale = curves.axis_scale(run, axis)
    return PlotAxis(scale.label(label)), scale.factor


def _panel(
    runs: Sequence[Run], axis: str, x: PlotAxis, along: float, response: str
) -> PlotPanel:
    # a response that the first run does not have is refused by `sweeps`
    scale = runs[0].scales.get(response)
    times = scale.factor if scale else 1.0
    layers: list[Layer] = []
    colours = cycle(CURVE_COLOURS)
    cut = [(run, each) for run in runs for each in curves.sweeps(run, axis, response)]
    for run, sweep in cut:
        of_run = run.path.stem if len(runs) > 1 else ""
        label = ": ".join(part for part in (of_run, sweep.label) if part) or "run"
        look = "line" if len(sweep.x) >= FEW_POINTS else "dotted"
        look, at = "dots" if x.words else look, along * sweep.x
        layers.append(Line(at, times * sweep.y, next(colours), label, look))
    if len(layers) > MOST_CURVES:
        raise PictureError(
            f"{len(layers)} curves are too many for one picture ({MOST_CURVES}); sweep "
            "less"
        )
    for run in runs:
        known = run.reference.columns if run.reference else {}
        if run.reference and response in known and axis in known:
            at, values = along * known[axis], times * known[response]
            layers.append(Line(at, values, "ink", run.reference.label, "rings"))
    for limit in {run.limits[response] for run in runs if response in run.limits}:
        said = f"limit {limit.words}"
        for end in filter(math.isfinite, limit.permitted):
            layers.append(Rule(times * end, False, "limit", said))
            said = ""
    y = PlotAxis(scale.label(response) if scale else response)
    return PlotPanel(x, y, tuple(layers))
