"""Grid runs drawn: responses over what was swept, several machines in one picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tolstat.answers.sweep.curves import axis_scale, sweeps, swept_axis, words_along
from tolstat.errors import PictureError
from tolstat.render.picture import in_legend, mark_level, styled
from tolstat.store.stored_run import Run

MOST_CURVES = 12
MOST_WORDS = 32  # along the axis; of more some are written
FEW_POINTS = 100  # are shown each by itself


def responses_of_interest(run: Run) -> list[str]:
    """List what has a reference or a limit: what the study asks about."""
    columns = run.reference.columns if run.reference else ()
    known = [name for name in columns if name in run.units][1:]
    limited = [name for name in run.limits if name not in known]
    return [*known, *limited]


def draw_sweeps(runs: Sequence[Run], responses: Sequence[str] = ()) -> Figure:
    """Draw responses over what was swept.

    Parameters
    ----------
    runs : sequence of Run
        Grid runs over the same contributor or setting.
    responses : sequence of str
        Names; what has a reference or a limit if none are given.

    Returns
    -------
    Figure
        One picture for each response, with its limit and the reference.

    Raises
    ------
    PictureError
        If a run is no grid, they do not sweep the same, or nothing is to be shown.
    """
    axis = swept_axis(runs[0])
    for run in runs[1:]:
        if (other := swept_axis(run)) != axis:
            raise PictureError(
                f"{runs[0].path} sweeps {axis}, {run.path} sweeps {other}; draw each "
                "by itself"
            )
    chosen = list(responses) or responses_of_interest(runs[0])
    if not chosen:
        raise PictureError(
            f"{runs[0].path} limits no response; name what is to be drawn with "
            "--response NAME"
        )
    with styled():
        figure = Figure(figsize=(7.0, 3.3 * len(chosen) + 0.5))
        figure.set_layout_engine("constrained")
        every = figure.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0]
        for axes, response in zip(every, chosen, strict=True):
            _draw(axes, runs, axis, response)
        if words := words_along(runs[0], axis):
            every[-1].set_xlabel(axis)
            every[-1].xaxis.set_major_locator(MaxNLocator(MOST_WORDS, integer=True))
            every[-1].xaxis.set_major_formatter(_word_at(words))
            every[-1].tick_params(axis="x", rotation=90)
        else:
            every[-1].set_xlabel(axis_scale(runs[0], axis).label(axis))
        title = "\n".join(run.title for run in runs)
        figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def _word_at(words: Sequence[str]) -> Callable[[float, int], str]:
    """Write beside the axis what stands at a number."""

    def word(x: float, _: int) -> str:
        return words[int(x)] if x in range(len(words)) else ""

    return word


def _draw(axes: Axes, runs: Sequence[Run], axis: str, response: str) -> None:
    # a response that the first run does not have is refused by `sweeps`
    words = words_along(runs[0], axis)
    along = 1.0 if words else axis_scale(runs[0], axis).factor
    scale = runs[0].scales.get(response)
    times = scale.factor if scale else 1.0
    curves = 0
    for run in runs:
        for sweep in sweeps(run, axis, response):
            of_run = run.path.stem if len(runs) > 1 else ""
            label = ": ".join(part for part in (of_run, sweep.label) if part)
            y = times * sweep.y
            (line,) = axes.plot(along * sweep.x, y, label=in_legend(label or "run"))
            if len(y) < FEW_POINTS or words:
                line.set(marker=".", markersize=4)
            if words:
                line.set(linestyle="none")
            curves += 1
    if curves > MOST_CURVES:
        raise PictureError(
            f"{curves} curves are too many for one picture ({MOST_CURVES}); sweep less"
        )
    for run in runs:
        known = run.reference.columns if run.reference else {}
        if run.reference and response in known and axis in known:
            axes.plot(
                along * known[axis], times * known[response], "o", color="black",
                fillstyle="none", label=in_legend(run.reference.label),
            )  # fmt: skip
    for limit in {run.limits[response] for run in runs if response in run.limits}:
        said = f"limit {limit.words}"
        for end in filter(math.isfinite, limit.permitted):
            mark_level(axes, times * end, said)
            said = ""
    axes.set_ylabel(scale.label(response) if scale else response)
    axes.margins(x=0.02)
    if len(axes.get_legend_handles_labels()[1]) > 1:
        axes.legend(loc="best")
