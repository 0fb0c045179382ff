"""Figures of measured parts: a histogram with the tolerance, and their order."""

import math

import numpy as np

from tolstat.answers.parts.judged_parts import JudgedParts
from tolstat.answers.report.response_figures import bars_of, bell_of, figure_of, line_at
from tolstat.document import blocks, plot
from tolstat.model.view import Level

MOST_BINS = 40
FEWEST_BINS = 8
MOST_LOTS = 20  # that have a mean of their own in the figure


def figures_of(name: str, part: JudgedParts) -> tuple[blocks.Figure, ...]:
    """Draw the parts; their order where it is not that of their size."""
    order = (_order(name, part),) if part.in_order and len(part.values) > 1 else ()
    return (_histogram(name, part), *order)


def _histogram(name: str, part: JudgedParts) -> blocks.Figure:
    values, times = part.values, part.scale.factor
    bins = len(np.histogram_bin_edges(values, "auto")) - 1
    bins = min(max(bins, FEWEST_BINS), MOST_BINS)
    layers: list[plot.Layer] = [*bars_of(values, part.tolerance, times, bins)]
    mean, sigma = part.capability.mean.value, part.capability.sigma.value
    if sigma > 0 and part.capability.mean.sure:
        layers.append(bell_of(values, bins, times))
    for i, end in enumerate(part.tolerance.finite):
        words = "tolerance" if i == 0 else ""
        layers.append(line_at(times * end, words, "limit", "--"))
    if not math.isnan(part.nominal):
        layers.append(line_at(times * part.nominal, "nominal", "ink", "-."))
    layers.append(line_at(times * mean, "mean", "third", ":"))
    red = " Red: outside the tolerance." if part.tolerance.finite else ""
    return figure_of(
        f"Histogram of {name}: {len(values)} parts, mean {part.scale.words(mean)}",
        plot.PlotAxis(part.scale.label(name)), plot.PlotAxis("parts per bin"), *layers,
        caption=f"{name}: {len(values)} parts.{red}",
    )  # fmt: skip


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
    return figure_of(
        f"{name} in the order of the parts",
        plot.PlotAxis("part"), plot.PlotAxis(part.scale.label(name)), *layers,
        caption=f"{name} in the order in which the parts are given.",
    )  # fmt: skip
