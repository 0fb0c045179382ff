"""How a response is distributed, drawn."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy.special import ndtri

from tolstat.answers.report.findings import ResponseFindings
from tolstat.answers.sampled_trials import Drawn
from tolstat.render.page_picture import (
    BEYOND,
    INK,
    SECOND,
    WITHIN,
    few_ticks,
    inline,
    legend_above,
    page_figure,
)
from tolstat.render.picture import COLOURS
from tolstat.statistics.summary import Summary
from tolstat.units.scale import Scale

Array = NDArray[np.float64]

BINS = 60
TICKS = (1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.5)
DRAWN_POINTS = 600  # of a distribution function
CURVE_POINTS = 240  # of a fit
MEAN = COLOURS[2]
FITTED = Scale("1", "ppm", 1.0)  # of a million; a tail that is fitted is no finer


def histogram(drawn: Drawn, name: str, found: ResponseFindings) -> Markup:
    """Draw how often each value occurs; beyond the limit in another colour.

    Its limit, mean and quantiles stand in it, and the curve of the named distribution
    that the trials do not speak against.

    Parameters
    ----------
    drawn : Drawn
        The trials.
    name : str
        Of the response.
    found : ResponseFindings
        What is said of it.
    """
    values, scale = drawn.done(name), found.scale.factor
    atom = found.distribution.atom if found.distribution else None
    if atom:
        values = atom.without(values)
    with page_figure() as figure:
        axes = figure.subplots()
        if len(values):
            low, high = float(values.min()), float(values.max())
            edges = edges_of(values)
            # an edge on each end of the limit, so that no bar lies on both sides
            inside = [end for end in ends_of(found) if low < end < high]
            edges = np.unique([*edges, *inside])
            counts, _ = np.histogram(values, edges)
            heights = counts / np.diff(edges) * (edges[-1] - edges[0]) / BINS
            lower, upper = limit_of(found)
            beyond = (edges[1:] <= lower) | (edges[:-1] >= upper)
            for chosen, colour in ((~beyond, WITHIN), (beyond, BEYOND)):
                if chosen.any():
                    axes.stairs(
                        np.where(chosen, heights, 0.0), scale * edges, fill=True,
                        color=colour, linewidth=0,
                    )  # fmt: skip
            _draw_fit(axes, found, scale, edges)
        _mark_middle(axes, found, scale)
        mark_limit(axes, found, scale)
        _mark_quantiles(axes, found, scale)
        axes.set_xlabel(found.scale.label(name))
        axes.set_ylabel("machines a bar")
        few_ticks(axes)
        legend_above(axes)
        return inline(figure, f"Histogram of {name}: {_summary_words(found)}")


def _draw_fit(axes: Axes, found: ResponseFindings, scale: float, edges: Array) -> None:
    """Draw how many machines a bar would have by the fit, if it is not rejected."""
    of = found.distribution
    if of is None or of.shape.rejected:
        return
    at = np.linspace(edges[0], edges[-1], CURVE_POINTS + 1)
    bars = CURVE_POINTS / BINS  # points a bar
    heights = of.rest * np.diff(of.shape.below(at)) * bars
    label = of.shape.name
    if not math.isnan(of.beyond):
        label += f", {FITTED.number(of.beyond)} ppm"
    middle = scale * (at[1:] + at[:-1]) / 2
    axes.plot(middle, heights, color=INK, linewidth=1, label=label)


def _mark_middle(axes: Axes, found: ResponseFindings, scale: float) -> None:
    if not math.isnan(found.nominal):
        label = f"nominal {found.scale.number(found.nominal)}"
        axes.axvline(
            scale * found.nominal, color=INK, linestyle="-.", linewidth=1, label=label
        )
    if not math.isnan(found.mean.value):
        label = f"mean {found.scale.interval(*found.mean[:3])[0]}"
        axes.axvline(
            scale * found.mean.value, color=MEAN, linestyle=":", linewidth=1.4,
            label=label,
        )  # fmt: skip


def limit_of(found: Summary) -> tuple[float, float]:
    """Return the limit of a response; infinite where it is open or there is none."""
    limited = found.limited
    return limited.limit.permitted if limited else (-math.inf, math.inf)


def ends_of(found: Summary) -> list[float]:
    """Return the ends of the limit that there are."""
    return [end for end in limit_of(found) if math.isfinite(end)]


def mark_limit(axes: Axes, found: Summary, scale: float) -> None:
    """Mark the ends of the limit across the picture, with its words in the legend."""
    label = f"limit {found.limited.limit.words}" if found.limited else ""
    for end in ends_of(found):
        axes.axvline(
            scale * end, color=BEYOND, linestyle="--", linewidth=1.2, label=label
        )
        label = "_unnamed"


def _mark_quantiles(axes: Axes, found: ResponseFindings, scale: float) -> None:
    """Mark median, 95 % and 99.865 % with their intervals, above the bars."""
    top = axes.get_ylim()[1]
    label = "50, 95, 99.865 %"
    for share in (0.5, 0.95, 0.99865):
        each = found.quantiles[share]
        if not each.sure:
            continue
        axes.plot(
            [scale * each.lower, scale * each.upper], [1.04 * top] * 2,
            color=SECOND, linewidth=2.5, solid_capstyle="butt",
        )  # fmt: skip
        axes.plot(
            scale * each.value, 1.04 * top, "|", color=SECOND, markersize=9,
            label=label,
        )  # fmt: skip
        label = "_unnamed"
    axes.set_ylim(0, 1.1 * top)


def distribution(drawn: Drawn, name: str, found: ResponseFindings) -> Markup:
    """Draw the share of the machines below each value, on a probability scale.

    Parameters
    ----------
    drawn : Drawn
        The trials.
    name : str
        Of the response.
    found : ResponseFindings
        What is said of it.
    """
    values, scale = np.sort(drawn.done(name)), found.scale.factor
    n = len(values)
    share = (np.arange(1, n + 1) - 0.5) / n
    with page_figure() as figure:
        axes = figure.subplots()
        chosen = spread_out(n)
        axes.plot(
            scale * values[chosen], ndtri(share[chosen]), ".", color=WITHIN,
            markersize=3, label="machines",
        )  # fmt: skip
        least = share[0]
        shown = [values[0], values[-1], *ends_of(found)]
        mark_limit(axes, found, scale)
        margin = 0.05 * (max(shown) - min(shown)) or 1.0
        axes.set_xlim(scale * (min(shown) - margin), scale * (max(shown) + margin))
        scale_of_probability(axes, least)
        axes.set_ylim(ndtri(least / 2), -ndtri(least / 2))
        axes.set_xlabel(found.scale.label(name))
        few_ticks(axes)
        legend_above(axes)
        words = (
            f"Distribution of {name} on a probability scale: {_summary_words(found)}"
        )
        return inline(figure, words)


def edges_of(values: Array) -> Array:
    """Return the edges of the bars of a histogram; fewer where values hardly differ."""
    low, high = float(values.min()), float(values.max())
    if not high > low:
        high = low + (abs(low) or 1.0)
    edges: Array = np.unique(np.linspace(low, high, BINS + 1))
    return edges


def scale_of_probability(axes: Axes, least: float) -> None:
    """Write shares of the machines on an axis of normal scores, down to the least."""
    ticks = [t for t in TICKS if t >= least / 2]
    ticks = sorted({*ticks, *(1 - t for t in ticks)})
    axes.set_yticks(ndtri(ticks), [f"{100 * t:.10g}" for t in ticks])
    axes.set_ylabel("% of the machines below")


def spread_out(n: int) -> NDArray[np.int64]:
    """Choose points of a distribution function: all in the tails, few in the middle."""
    if n <= DRAWN_POINTS:
        return np.arange(n)
    tail = np.unique(np.geomspace(1, n // 2, DRAWN_POINTS // 2).astype(np.int64))
    return np.unique(np.concatenate([tail - 1, n - tail]))


def _summary_words(found: ResponseFindings) -> str:
    """Say the most important numbers, for those who do not see the picture."""
    words = [
        f"{label} {found.scale.words(value)}"
        for label, value in (
            ("nominal", found.nominal),
            ("median", found.quantiles[0.5].value),
            ("95 %", found.quantiles[0.95].value),
            ("largest", found.largest),
        )
        if not math.isnan(value)
    ]
    if found.limited:
        words.append(f"limit {found.limited.limit.words}")
    return ", ".join(words)
