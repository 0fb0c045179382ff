"""Figures of a response: histogram, distribution, contributions, convergence."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.report.report_answer import Report, ReportedResponse
from tolstat.answers.sampled_trials import Drawn, drawn_trials
from tolstat.document.blocks import Figure
from tolstat.document.inline import text
from tolstat.document.plot import (
    Bars,
    Fill,
    Layer,
    Line,
    Plot,
    PlotAxis,
    PlotPanel,
    Points,
    Rule,
    Spans,
    Stairs,
)
from tolstat.render.json_schema import share_words
from tolstat.statistics.intervals.convergence import running
from tolstat.statistics.intervals.quantiles import trials_needed
from tolstat.statistics.intervals.statistic import Statistic
from tolstat.statistics.summary import Summary
from tolstat.units.scale import Scale

Array = NDArray[np.float64]

BINS = 60
MARKED = (0.5, 0.95, 0.99865)  # quantiles above a histogram
MOST_BARS = 10
MOST_DRAWN = 600  # points of a distribution function
SCATTERED = 3  # contributors that a response is drawn over
SETTLING = 4  # times the trials a quantile needs, so that there is something to see


def figures_of(found: Report, name: str) -> Iterator[Figure]:
    """Draw a response in focus."""
    drawn = drawn_trials(found.of)
    assert drawn is not None  # there is no report otherwise
    each = found.responses[name]
    yield histogram(drawn, name, each)
    yield distribution(drawn, name, each)
    if bars := contributions(each):
        yield bars
    yield convergence(drawn, name, each)
    if over := scatter(drawn, name, each):
        yield over


def histogram(drawn: Drawn, name: str, each: ReportedResponse) -> Figure:
    """Draw how often each value occurs; out of limit in another colour."""
    values, times = drawn.done(name), each.scale.factor
    mass = each.point_mass
    if mass:
        values = mass.without(values)
    layers: list[Layer] = []
    if len(values):
        low, high = float(values.min()), float(values.max())
        # an edge on each end of the limit, so that no bar lies on both sides
        inside = [end for end in ends_of(each) if low < end < high]
        edges = np.unique([*edges_of(values), *inside])
        counts, _ = np.histogram(values, edges)
        heights = counts / np.diff(edges) * (edges[-1] - edges[0]) / BINS
        lower, upper = limit_of(each)
        out = (edges[1:] <= lower) | (edges[:-1] >= upper)
        layers += [
            Stairs(times * edges, np.where(chosen, heights, 0.0), colour)
            for chosen, colour in ((~out, "first"), (out, "limit"))
            if chosen.any()
        ]
    if not math.isnan(each.nominal):
        label = f"nominal {each.scale.number(each.nominal)}"
        layers.append(Rule(times * each.nominal, True, "ink", label, "-."))
    if not math.isnan(each.mean.value):
        label = f"mean {each.scale.interval(*each.mean[:3])[0]}"
        layers.append(Rule(times * each.mean.value, True, "third", label, ":"))
    layers += limit_rules(each, each.scale)
    sure = [each.quantiles[q] for q in MARKED if each.quantiles[q].sure]
    if sure:
        value, lower_, upper_ = times * np.array([q[:3] for q in sure]).T
        layers.append(Spans(lower_, upper_, value, label="50, 95, 99.865 %"))
    panel = PlotPanel(
        PlotAxis(each.scale.label(name)), PlotAxis("trials per bin"), tuple(layers)
    )
    caption = text(
        f"{name}: {len(values)} trials",
        ", without those that share one value" if mass else None,
        ". Red: out of limit. Orange: quantiles with 95 % intervals.",
    )
    return Figure(f"Histogram of {name}: {_said(each)}", Plot((panel,)), caption)


def distribution(drawn: Drawn, name: str, each: ReportedResponse) -> Figure:
    """Draw the fraction below each value, on a probability scale."""
    values, times = np.sort(drawn.done(name)), each.scale.factor
    points = points_of(values, times)
    shown = [values[0], values[-1], *ends_of(each)]
    margin = 0.05 * (max(shown) - min(shown)) or 1.0
    ends = times * (min(shown) - margin), times * (max(shown) + margin)
    panel = PlotPanel(
        PlotAxis(each.scale.label(name), ends=ends),
        PlotAxis("% of the trials below", "normal"),
        (points, *limit_rules(each, each.scale)),
    )
    caption = text(
        f"Fraction below, of {len(values)} trials done. A normal distribution is a "
        "straight line."
    )
    words = f"Distribution of {name} on a probability scale: {_said(each)}"
    return Figure(words, Plot((panel,)), caption)


def contributions(each: ReportedResponse) -> Figure | None:
    """Draw the variance contributions, the largest first.

    None where few trials dominate the variance: bars would show noise. No bar is
    negative; intervals may be.
    """
    found = each.indices or each.contributions
    if found is None:
        return None
    if each.indices:
        few, first = each.indices.dominated_by_few, each.indices.first
        rows = [
            ("alone (first order)", first),
            ("with others (total)", each.indices.total),
        ]
        said = (
            f"Sobol' indices of {each.indices.groups} groups of trials "
            f"({each.indices.broken} left out: not all of their trials are done)."
        )
    else:
        assert each.contributions
        few, first = each.contributions.dominated_by_few, each.contributions.first_order
        rows = [("alone (first order)", first)]
        said = (
            "Variance contribution of each contributor alone, with 95 % intervals "
            "where one can be trusted."
        )
    known = {
        n: share.value for n, share in first.items() if not math.isnan(share.value)
    }
    if few or not known:
        return None
    leading = tuple(sorted(known, key=lambda name: -known[name])[:MOST_BARS])
    layers = []
    for (label, shares), colour in zip(rows, ("first", "second"), strict=False):
        value = 100 * np.array([max(shares[name].value, 0.0) for name in leading])
        ends = 100 * np.array([shares[name][1:3] for name in leading]).T
        sure = all(shares[name].sure for name in leading)
        layers.append(Bars(leading, value, ends if sure else None, colour, label))
    panel = PlotPanel(PlotAxis("% of the variance"), PlotAxis(""), tuple(layers))
    words = ", ".join(f"{name} {100 * known[name]:.0f} %" for name in leading[:3])
    height = 0.26 * len(leading) * len(rows) + 1.1
    return Figure(
        f"Contributions, the largest first: {words}", Plot((panel,), height=height),
        text(said),
    )  # fmt: skip


def convergence(drawn: Drawn, name: str, each: ReportedResponse) -> Figure:
    """Draw how the outermost quantile that has long had an interval settles."""
    n = len(drawn.trials)
    told = (q for q in (0.99865, 0.99, 0.95) if n >= SETTLING * trials_needed(q))
    share = next(told, 0.5)
    limit = each.limited.limit.permitted if each.limited else None
    label = each.scale.label(share_words(share))
    asked = [(Statistic(name, "quantile", share), each.scale.factor, label)]
    if limit:
        asked.append((Statistic(name, "beyond"), 100.0, "out of limit, %"))
    panels = []
    for statistic, times, words in asked:
        found = running(statistic, drawn.values(name), drawn.sample, limit)
        at = found.trials.astype(float)
        between = Fill(
            at, times * found.lower, times * found.upper, label="95 % interval"
        )
        line = Line(at, times * found.value)
        panels.append(
            PlotPanel(PlotAxis("trials", "log"), PlotAxis(words), (between, line))
        )
    return Figure(
        f"Estimates of {name} with their intervals, as trials are added",
        Plot(tuple(panels)),
        text(f"Estimates as {n} trials were added, failed ones among them."),
    )


def scatter(drawn: Drawn, name: str, each: ReportedResponse) -> Figure | None:
    """Draw the response over its three leading contributors; None without any.

    Where few trials dominate its variance, over what differs significantly among
    out-of-limit trials.
    """
    leading, few = (
        each.leading,
        each.contributions and each.contributions.dominated_by_few,
    )
    if few:
        leading = each.causes.significant if each.causes else []
    if not (leading := leading[:SCATTERED]):
        return None
    response = each.scale.factor * drawn.done(name)
    scales = drawn.run.scales
    rules = [Rule(each.scale.factor * end, False, "limit") for end in ends_of(each)]
    panels = tuple(
        PlotPanel(
            PlotAxis(scales[part].label(part)), PlotAxis(each.scale.label(name)),
            (
                Points(scales[part].factor * drawn.done(part), response, faint=True),
                *rules,
            ),
        )
        for part in leading
    )  # fmt: skip
    which = "differ most among out-of-limit trials" if few else "matter most"
    return Figure(
        f"{name} over its leading contributors: {', '.join(leading)}",
        Plot(panels, side_by_side=True, width=7.05, height=2.4),
        text(
            f"Each of the {len(response)} trials done over the contributors that "
            f"{which}."
        ),
        wide=True,
    )


def points_of(
    values: Array, times: float, colour: str = "first", label: str = ""
) -> Points:
    """Return points of a distribution function: all in the tails, few in the middle."""
    n = len(values)
    share = (np.arange(1, n + 1) - 0.5) / n
    chosen = np.arange(n)
    if n > MOST_DRAWN:
        tail = np.unique(np.geomspace(1, n // 2, MOST_DRAWN // 2).astype(np.int64))
        chosen = np.unique(np.concatenate([tail - 1, n - tail]))
    return Points(times * np.sort(values)[chosen], share[chosen], colour, label)


def limit_of(found: Summary) -> tuple[float, float]:
    """Return the limit of a response; infinite where it is open or there is none."""
    limited = found.limited
    return limited.limit.permitted if limited else (-math.inf, math.inf)


def ends_of(found: Summary) -> list[float]:
    """Return the ends of the limit that there are."""
    return [end for end in limit_of(found) if math.isfinite(end)]


def limit_rules(found: Summary, scale: Scale) -> list[Rule]:
    """Mark the ends of the limit, with its words in the legend."""
    words = f"limit {found.limited.limit.words}" if found.limited else ""
    return [
        Rule(scale.factor * end, True, "limit", words if i == 0 else "")
        for i, end in enumerate(ends_of(found))
    ]


def edges_of(values: Array) -> Array:
    """Return the edges of the bars of a histogram; fewer where values hardly differ."""
    low, high = float(values.min()), float(values.max())
    if not high > low:
        high = low + (abs(low) or 1.0)
    edges: Array = np.unique(np.linspace(low, high, BINS + 1))
    return edges


def _said(each: ReportedResponse) -> str:
    """Say the most important numbers, for those who do not see the picture."""
    words = [
        f"{label} {each.scale.words(value)}"
        for label, value in (
            ("nominal", each.nominal),
            ("median", each.quantiles[0.5].value),
            ("95 %", each.quantiles[0.95].value),
            ("largest", each.largest),
        )
        if not math.isnan(value)
    ]
    if each.limited:
        words.append(f"limit {each.limited.limit.words}")
    return ", ".join(words)
