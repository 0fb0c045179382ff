"""Figures of measured parts: a histogram with the tolerance, and their order."""

import math

import numpy as np

from tolstat.answers.parts.judged_parts import JudgedParts
from tolstat.answers.report.response_figures import line_at
from tolstat.arrays import Array
from tolstat.document import blocks, plot
from tolstat.document.inline import text
from tolstat.model.view import Curve, Level

MOST_BINS = 40
FEWEST_BINS = 8
MOST_LOTS = 20  # that have a mean of their own in the figure
BELL = 200  # points


def figures_of(name: str, part: JudgedParts) -> tuple[blocks.Figure, ...]:
    """Draw the parts; their order where it is not that of their size."""
    order = (_order(name, part),) if part.in_order and len(part.values) > 1 else ()
    return (_histogram(name, part), *order)


def _histogram(name: str, part: JudgedParts) -> blocks.Figure:
    values, times = part.values, part.scale.factor
    edges = edges_of(values, part.tolerance.finite)
    heights = np.histogram(values, edges)[0].astype(float)
    lower, upper = part.tolerance
    outside = (edges[1:] <= lower) | (edges[:-1] >= upper)
    layers: list[plot.Layer] = [
        plot.Histogram(times * edges, np.where(chosen, heights, 0.0), colour)
        for chosen, colour in ((~outside, "first"), (outside, "limit"))
        if chosen.any()
    ]
    mean, sigma = part.capability.mean.value, part.capability.sigma.value
    if sigma > 0 and part.capability.mean.sure:
        layers.append(_bell(values, edges, times))
    for i, end in enumerate(part.tolerance.finite):
        words = "tolerance" if i == 0 else ""
        layers.append(line_at(times * end, words, "limit", "--"))
    if not math.isnan(part.nominal):
        layers.append(line_at(times * part.nominal, "nominal", "ink", "-."))
    layers.append(line_at(times * mean, "mean", "third", ":"))
    return blocks.Figure(
        f"Histogram of {name}: {len(values)} parts, mean {part.scale.words(mean)}",
        plot.Plot((plot.PlotPanel(
            plot.PlotAxis(part.scale.label(name)), plot.PlotAxis("parts per bin"),
            tuple(layers),
        ),)),
        text(f"{name}: {len(values)} parts. Red: outside the tolerance."),
    )  # fmt: skip


def _bell(values: Array, edges: Array, times: float) -> Curve:
    """Return a normal density with mean and sigma of the parts, in parts per bin."""
    mean, sigma = values.mean(), values.std(ddof=1)
    at = np.linspace(mean - 4 * sigma, mean + 4 * sigma, BELL)
    width = float(np.median(np.diff(edges)))
    density = np.exp(-0.5 * ((at - mean) / sigma) ** 2) / (
        sigma * math.sqrt(2 * math.pi)
    )
    return plot.curve(times * at, len(values) * width * density, "second", "normal")


def edges_of(values: Array, ends: list[float]) -> Array:
    """Return the edges of the bars, with one on each end of a tolerance."""
    low, high = float(values.min()), float(values.max())
    if not high > low:
        high = low + (abs(low) or 1.0)
    bins = len(np.histogram_bin_edges(values, "auto")) - 1
    bins = min(max(bins, FEWEST_BINS), MOST_BINS)
    inside = [end for end in ends if low < end < high]
    edges: Array = np.unique([*np.linspace(low, high, bins + 1), *inside])
    return edges


def _order(name: str, part: JudgedParts) -> blocks.Figure:
    """Draw the parts in their order, with the mean of each lot."""
    times, values, lots = part.scale.factor, part.values, np.array(part.lot_of_each)
    numbers = np.arange(1, len(values) + 1, dtype=float)
    layers: list[plot.Layer] = [
        plot.curve(numbers, times * values, look="dots"),
        *(Level(times * end, "") for end in part.tolerance.finite),
    ]
    if 1 < len(part.lots) <= MOST_LOTS:
        for i, (lot, mean) in enumerate(part.lots.items()):
            at = numbers[lots == lot]
            level = np.full(len(at), times * mean.mean)
            words = "mean of the lot" if i == 0 else ""
            layers.append(plot.curve(at, level, "second", words))
    return blocks.Figure(
        f"{name} in the order of the parts",
        plot.Plot((plot.PlotPanel(
            plot.PlotAxis("part"), plot.PlotAxis(part.scale.label(name)), tuple(layers)
        ),)),
        text(f"{name} in the order in which the parts are given."),
    )  # fmt: skip
