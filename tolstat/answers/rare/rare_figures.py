"""Figures of a rare run: its tail, and the most probable failure point."""

import numpy as np

from tolstat.answers.rare.rare_answer import FailurePoint, RareSummary
from tolstat.answers.report.response_figures import figure_of, limit_marks
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.document import blocks, plot
from tolstat.document.inline import Name
from tolstat.document.sentences import say, text
from tolstat.units.scale import PPM

HEIGHT = 1.9  # inches
ROW, AXIS = 0.19, 0.65  # inches: height of a bar, and of what is below all
MOST_BARS = 8
LEAST_DRAWN = 2  # trials of a curve
DECADES = 1e-6  # of the fraction out of limit that are sampled at most


def rare_pictures(summary: RareSummary) -> blocks.Columns:
    """Return how many units lie beyond each value, and the likeliest failure."""
    points = summary.failure_points
    return blocks.Columns(
        blocks.shown(_tail(summary)),
        blocks.shown(_failure_point(summary, points[0]) if points else None),
    )


def _tail(summary: RareSummary) -> blocks.Figure | None:
    """Draw the fraction beyond each value, at the end with most units out of limit.

    None where a trial failed, as it has no value, or where hardly one is out of limit.
    """
    sampled, name, scale = (
        drawn_trials(summary.stored_run), summary.response, summary.scale
    )  # fmt: skip
    assert sampled and sampled.sample.weights
    if sampled.sample.failed:
        return None
    values, weights = (
        sampled.values(name),
        sampled.sample.weights.values / len(sampled.trials),
    )
    lower, upper = summary.limit.permitted
    below, above = values < lower, values > upper
    out, side = max(
        (above, 1.0), (below, -1.0), key=lambda x: float(weights[x[0]].sum())
    )
    if np.count_nonzero(out) < LEAST_DRAWN:
        return None
    outwards = np.argsort(side * values[out])
    beyond = np.cumsum(weights[out][outwards][::-1])[::-1]
    seen = beyond > DECADES * beyond[0]
    at = scale.factor * values[out][outwards][seen]
    direction = "above" if side > 0 else "below"
    return figure_of(
        f"Fraction of {name} {direction} each value: {PPM.number(beyond[0])} ppm "
        f"{direction} the limit",
        plot.PlotAxis(scale.label(name)),
        plot.PlotAxis(f"{direction} it, ppm", "log", factor=1e6),
        plot.curve(at, beyond[seen]), *limit_marks(summary.responses[name], scale),
        caption=say(
            f"{{}}: fraction {direction} each value; last stage, weighted.",
            Name(name),
        ), height=HEIGHT,
    )  # fmt: skip


def _failure_point(summary: RareSummary, point: FailurePoint) -> blocks.Figure:
    """Draw how far out each part lies in the most probable failure."""
    names = sorted(point.scores, key=lambda name: -abs(point.scores[name]))[:MOST_BARS]
    scales = summary.stored_run.scales
    words = tuple(f"{scales[name].words(point.deviations[name])}" for name in names)
    bars = plot.Bars(
        tuple(names), np.array([point.scores[name] for name in names]), words=words
    )
    axis = plot.PlotAxis("normal score")
    panel = plot.PlotPanel(axis, plot.PlotAxis(""), (bars,))
    listing = ", ".join(f"{n} {w}" for n, w in zip(names, words, strict=True))
    return blocks.Figure(
        f"Most probable failure point, trial {point.trial}: {listing}",
        plot.Plot((panel,), height=ROW * len(names) + AXIS),
        text(
            f"Most probable failure point, trial {point.trial}: how far out each part "
            "lies, as sigmas of a normal part. On the right its deviation."
        ),
    )  # fmt: skip
