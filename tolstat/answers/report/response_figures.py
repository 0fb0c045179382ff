"""Figures of a response: histogram, distribution, contributions, scatter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from tolstat.answers.report.first_page import CENTRAL
from tolstat.answers.sampled_trials import Drawn, drawn_trials
from tolstat.arrays import Array
from tolstat.document import blocks, plot
from tolstat.document.inline import text
from tolstat.model.view import Curve, Level, Span
from tolstat.statistics.summary import Summary
from tolstat.units.scale import Scale

if TYPE_CHECKING:
    from tolstat.answers.report.report_answer import Report, ReportedResponse

BINS = 60
MARKED = (0.5, 0.95, 0.99865)  # quantiles above a histogram
MOST_BARS = 10
MOST_DRAWN = 600  # points of a distribution function
SCATTERED = 3  # contributors that a response is drawn over
OPEN = (-math.inf, math.inf)
PROBABILITY = plot.PlotAxis("% of the trials below", "normal")
STRAIGHT = "A normal distribution is a straight line."


def figures_of(found: Report, name: str) -> tuple[blocks.Figure, ...]:
    """Draw a response in focus."""
    drawn, each = drawn_trials(found.stored_run), found.responses[name]
    assert drawn is not None  # there is no report otherwise
    figures = (
        _histogram(drawn, name, each), _distribution(drawn, name, each),
        _contributions(each), _scatter(drawn, name, each),
    )  # fmt: skip
    return tuple(figure for figure in figures if figure)


def _histogram(drawn: Drawn, name: str, each: ReportedResponse) -> blocks.Figure:
    """Draw how often each value occurs; out of limit in another colour."""
    values, times, scale = drawn.done(name), each.scale.factor, each.scale
    if each.point_mass:
        values = each.point_mass.without(values)
    layers: list[plot.Layer] = []
    if len(values):
        # an edge on each end of the limit, so that no bar lies on both sides
        inside = [end for end in ends_of(each) if values.min() < end < values.max()]
        edges = np.unique([*edges_of(values), *inside])
        heights = np.histogram(values, edges)[0] / np.diff(edges)
        heights *= (edges[-1] - edges[0]) / BINS
        lower, upper = each.limited.limit.permitted if each.limited else OPEN
        out = (edges[1:] <= lower) | (edges[:-1] >= upper)
        layers += [
            plot.Histogram(times * edges, np.where(chosen, heights, 0.0), colour)
            for chosen, colour in ((~out, "first"), (out, "limit"))
            if chosen.any()
        ]
    if not math.isnan(each.nominal):
        label = f"nominal {scale.number(each.nominal)}"
        layers.append(line_at(times * each.nominal, label, "ink", "-."))
    if not math.isnan(each.mean.value):
        label = f"mean {scale.interval(*each.mean[:3])[0]}"
        layers.append(line_at(times * each.mean.value, label, "third", ":"))
    layers += limit_rules(each, scale)
    if sure := [each.quantiles[q] for q in MARKED if each.quantiles[q].sure]:
        at, below, above = times * np.array([q[:3] for q in sure]).T
        layers.append(plot.Intervals(below, above, at, name="50, 95, 99.865 %"))
    mass = ", without those that share one value" if each.point_mass else ""
    return figure_of(
        f"Histogram of {name}: {_said(each)}",
        plot.PlotAxis(scale.label(name)), plot.PlotAxis("trials per bin"), *layers,
        said=f"{name}: {len(values)} trials{mass}. Red: out of limit. Orange: "
        "quantiles with 95 % intervals.",
    )  # fmt: skip


def figure_of(
    alt: str, x: plot.PlotAxis, y: plot.PlotAxis, *layers: plot.Layer, said: str
) -> blocks.Figure:
    """Return a figure of one panel."""
    return blocks.Figure(alt, plot.Plot((plot.PlotPanel(x, y, layers),)), text(said))


def _distribution(drawn: Drawn, name: str, each: ReportedResponse) -> blocks.Figure:
    """Draw the fraction below each value, on a probability scale."""
    values, times = np.sort(drawn.done(name)), each.scale.factor
    shown = [values[0], values[-1], *ends_of(each)]
    margin = 0.05 * (max(shown) - min(shown)) or 1.0
    ends = times * (min(shown) - margin), times * (max(shown) + margin)
    return figure_of(
        f"Distribution of {name} on a probability scale: {_said(each)}",
        plot.PlotAxis(each.scale.label(name), ends=ends), PROBABILITY,
        points_of(values, times), *limit_rules(each, each.scale),
        said=f"Fraction below, of {len(values)} trials done. {STRAIGHT}",
    )  # fmt: skip


def _contributions(each: ReportedResponse) -> blocks.Figure | None:
    """Draw the variance contributions, the largest first.

    None where few trials dominate the variance: bars would show noise. No bar is
    negative; intervals may be.
    """
    if (found := each.contributions) is None or found.dominated_by_few:
        return None
    shares = {n: x for n, x in found.first_order.items() if not math.isnan(x.value)}
    if not shares:
        return None
    leading = sorted(shares, key=lambda name: -shares[name].value)[:MOST_BARS]
    value, *ends = 100 * np.array([shares[name][:3] for name in leading]).T
    sure = all(shares[name].sure for name in leading)
    bars = plot.Bars(
        tuple(leading), np.maximum(value, 0.0), np.array(ends) if sure else None
    )
    axis = plot.PlotAxis(f"% of the variance{CENTRAL * found.clipped}")
    words = ", ".join(f"{n} {100 * shares[n].value:.0f} %" for n in leading[:3])
    panel = plot.PlotPanel(axis, plot.PlotAxis(""), (bars,))
    return blocks.Figure(
        f"Contributions, the largest first: {words}",
        plot.Plot((panel,), height=0.26 * len(leading) + 1.1),
        text("Variance contribution of each contributor alone, with 95 % intervals "
             "where one can be trusted."),
    )  # fmt: skip


def _scatter(drawn: Drawn, name: str, each: ReportedResponse) -> blocks.Figure | None:
    """Draw the response over its three leading contributors; None without any.

    Where few trials dominate its variance, over what differs significantly among
    out-of-limit trials.
    """
    leading, which = each.leading, "matter most"
    if each.contributions and each.contributions.dominated_by_few:
        leading = each.causes.significant if each.causes else []
        which = "differ most among out-of-limit trials"
    if not (leading := leading[:SCATTERED]):
        return None
    times, scales = each.scale.factor, drawn.run.scales
    response = times * drawn.done(name)
    rules = [Level(times * end, "") for end in ends_of(each)]
    panels = []
    for part in leading:
        at, axis = scales[part].factor * drawn.done(part), scales[part].label(part)
        curve, label = plot.curve(at, response, look="faint"), each.scale.label(name)
        x, y = plot.PlotAxis(axis), plot.PlotAxis(label)
        panels.append(plot.PlotPanel(x, y, (curve, *rules)))
    return blocks.Figure(
        f"{name} over its leading contributors: {', '.join(leading)}",
        plot.Plot(tuple(panels), side_by_side=True, width=7.05, height=2.4),
        text(f"Each of the {len(response)} trials done over the contributors that "
             f"{which}."),
        wide=True,
    )  # fmt: skip


def points_of(
    values: Array, times: float, colour: str = "first", label: str = ""
) -> Curve:
    """Return points of a distribution function: all in the tails, few in the middle."""
    n = len(values)
    share = (np.arange(1, n + 1) - 0.5) / n
    chosen = np.arange(n)
    if n > MOST_DRAWN:
        tail = np.unique(np.geomspace(1, n // 2, MOST_DRAWN // 2).astype(np.int64))
        chosen = np.unique(np.concatenate([tail - 1, n - tail]))
    shown = times * np.sort(values)[chosen]
    return plot.curve(shown, share[chosen], colour, label, "dots")


def ends_of(found: Summary) -> list[float]:
    """Return the ends of the limit that there are."""
    return found.limited.limit.finite if found.limited else []


def limit_rules(found: Summary, scale: Scale) -> list[Span]:
    """Mark the ends of the limit, with its words in the legend."""
    words = f"limit {found.limited.limit.words}" if found.limited else ""
    return [
        line_at(scale.factor * end, words if i == 0 else "", "limit", "--")
        for i, end in enumerate(ends_of(found))
    ]


def line_at(value: float, words: str, colour: str, dash: str) -> Span:
    """Return an upright line across a panel."""
    return Span(value, value, words, colour, dash)


def edges_of(values: Array) -> Array:
    """Return the edges of the bars of a histogram; fewer where values hardly differ."""
    low, high = float(values.min()), float(values.max())
    if not high > low:
        high = low + (abs(low) or 1.0)
    edges: Array = np.unique(np.linspace(low, high, BINS + 1))
    return edges


def _said(each: ReportedResponse) -> str:
    """Say the most important numbers, for those who do not see the picture."""
    numbers = {
        "nominal": each.nominal, "median": each.quantiles[0.5].value,
        "95 %": each.quantiles[0.95].value, "largest": each.largest,
    }  # fmt: skip
    words = [f"{n} {each.scale.words(x)}" for n, x in numbers.items() if x == x]
    if each.limited:
        words.append(f"limit {each.limited.limit.words}")
    return ", ".join(words)
