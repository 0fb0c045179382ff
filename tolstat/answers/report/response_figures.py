"""Figures of a response: histogram, distribution, contributions, scatter."""

import math
from collections.abc import Sequence

import numpy as np

from tolstat.answers.report.first_page import CENTRAL
from tolstat.answers.report.full_report import Report, report_of
from tolstat.answers.report.response_summary import ReportedResponse
from tolstat.answers.sampled_trials import Drawn, drawn_trials
from tolstat.arrays import Array
from tolstat.document import blocks, plot
from tolstat.document.inline import Said
from tolstat.document.sentences import text
from tolstat.model.view import Curve, Level, Span
from tolstat.statistics.limits.limit import within
from tolstat.statistics.summary import Limited, Summary
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

BINS = 60
MARKED = (0.5, 0.95, 0.99865)  # quantiles above a histogram
MOST_BARS = 10
MOST_DRAWN = 600  # points of a distribution function
SCATTERED = 3  # contributors that a response is drawn over
OPEN = (-math.inf, math.inf)
BELL = 200  # points
QUANTILES_MARKED = " Orange: 50, 95, 99.865 % with 95 % intervals."
NORMAL = " Dashed: normal fit."
PROBABILITY = plot.PlotAxis("% of the trials below", "normal")
STRAIGHT = "A normal distribution is a straight line."


def figures_of(report: Report, name: str) -> tuple[blocks.Figure, ...]:
    """Draw a response in focus."""
    drawn, response = drawn_trials(report.stored_run), report.responses[name]
    assert drawn is not None  # there is no report otherwise
    figures = (
        histogram(drawn, name, response), _distribution(drawn, name, response),
        pareto(response), _scatter(drawn, name, response),
    )  # fmt: skip
    return tuple(figure for figure in figures if figure)


def histogram_of(run: Run, name: str = "") -> blocks.Figure:
    """Draw how often each value of a response occurs; without a name the first one."""
    report = report_of(run, [name] if name else [])
    drawn, chosen = drawn_trials(run), report.focus[0]
    assert drawn is not None
    return histogram(drawn, chosen, report.responses[chosen])


def histogram(
    drawn: Drawn,
    name: str,
    response: ReportedResponse,
    height: float = 2.5,
    marked: Sequence[float] = MARKED,
) -> blocks.Figure:
    """Draw how often each value occurs; out of limit in another colour.

    With both limits, nominal, mean, a normal distribution, and marked quantiles.
    """
    values, times, scale = drawn.done(name), response.scale.factor, response.scale
    if response.point_mass:
        values = response.point_mass.without(values)
    layers: list[plot.Layer] = []
    if len(values):
        permitted = response.limited.limit.permitted if response.limited else OPEN
        layers += bars_of(values, permitted, times)
    # equal values have no bell: their sigma is that of rounding
    normal = not response.point_mass and response.sigma.value > 0
    normal = normal and bool(np.ptp(values) > 0)
    if normal:
        layers.append(bell_of(values, BINS, times))
    marks = {f"nominal {scale.number(response.nominal)}": (response.nominal, "-.")}
    mean = f"mean {scale.interval(*response.mean[:3])[0]}"
    marks[mean] = response.mean.value, ":"
    layers += [
        plot.Mark(times * value, words, "ink", dash)
        for words, (value, dash) in marks.items()
        if not math.isnan(value)
    ]
    layers += limit_marks(response, scale)
    if sure := [response.quantiles[q] for q in marked if response.quantiles[q].sure]:
        value, below, above = times * np.array([q[:3] for q in sure]).T
        layers.append(plot.Intervals(below, above, value))
    mass = ", without those that share one value" if response.point_mass else ""
    return figure_of(
        f"Histogram of {name}: {_most_important(response)}",
        plot.PlotAxis(scale.label(name)), plot.PlotAxis("trials per bin"), *layers,
        caption=f"{name}: {len(values)} trials{mass}. Red: out of limit."
        f"{NORMAL * normal}{QUANTILES_MARKED * bool(sure)}",
        height=height,
    )  # fmt: skip


def limit_marks(summary: Summary, scale: Scale) -> list[plot.Mark]:
    """Mark the ends of the limit, LSL and USL."""
    if summary.limited is None:
        return []
    ends = zip(("LSL", "USL"), summary.limited.limit.permitted, strict=True)
    return [
        plot.Mark(scale.factor * end, f"{name} {scale.number(end)}", "limit")
        for name, end in ends
        if math.isfinite(end)
    ]


def bell_of(values: Array, bins: int, times: float) -> Curve:
    """Return a normal density with mean and sigma of values, in values per bin."""
    mean, sigma = values.mean(), values.std(ddof=1)
    at = np.linspace(mean - 4 * sigma, mean + 4 * sigma, BELL)
    width = float(np.ptp(edges_of(values, bins))) / bins
    density = np.exp(-0.5 * ((at - mean) / sigma) ** 2) / (
        sigma * math.sqrt(2 * math.pi)
    )
    heights = len(values) * width * density
    return plot.curve(times * at, heights, "second", look="dashed")


def bars_of(
    values: Array, permitted: tuple[float, float], times: float, bins: int = BINS
) -> list[plot.Histogram]:
    """Return how many values lie in bins of equal width; others in another colour."""
    # an edge on each end of the limit, so that no bar lies on both sides
    inside = [end for end in permitted if values.min() < end < values.max()]
    edges = np.unique([*edges_of(values, bins, permitted), *inside])
    heights = np.histogram(values, edges)[0] / np.diff(edges)
    heights *= (edges[-1] - edges[0]) / bins
    lower, upper = permitted
    middles = (edges[1:] + edges[:-1]) / 2
    out = (middles < lower) | (middles > upper)
    return [
        plot.Histogram(times * edges, np.where(chosen, heights, 0.0), colour)
        for chosen, colour in ((~out, "first"), (out, "limit"))
        if chosen.any()
    ]


def figure_of(
    alt: str,
    x: plot.PlotAxis,
    y: plot.PlotAxis,
    *layers: plot.Layer,
    caption: Said,
    height: float = 2.5,
) -> blocks.Figure:
    """Return a figure of one panel."""
    panel = plot.PlotPanel(x, y, layers)
    return blocks.Figure(alt, plot.Plot((panel,), height=height), text(caption))


def _distribution(drawn: Drawn, name: str, response: ReportedResponse) -> blocks.Figure:
    """Draw the fraction below each value, on a probability scale."""
    values, times = np.sort(drawn.done(name)), response.scale.factor
    seen = [values[0], values[-1], *ends_of(response)]
    margin = 0.05 * (max(seen) - min(seen)) or 1.0
    ends = times * (min(seen) - margin), times * (max(seen) + margin)
    return figure_of(
        f"Distribution of {name} on a probability scale: {_most_important(response)}",
        plot.PlotAxis(response.scale.label(name), ends=ends), PROBABILITY,
        points_of(values, times), *limit_rules(response, response.scale),
        caption=f"Fraction below, of {len(values)} trials done. {STRAIGHT}",
    )  # fmt: skip


def pareto(response: ReportedResponse, most: int = MOST_BARS) -> blocks.Figure | None:
    """Draw the variance contributions, the largest first, and their sum.

    None where few trials dominate the variance: bars would show noise. No bar is
    negative; intervals may be.
    """
    contributions = response.contributions
    if contributions is None or contributions.dominated_by_few:
        return None
    first_order = contributions.first_order
    shares = {n: x for n, x in first_order.items() if not math.isnan(x.value)}
    if not shares:
        return None
    leading = sorted(shares, key=lambda name: -shares[name].value)[:most]
    value, *ends = 100 * np.array([shares[name][:3] for name in leading]).T
    certain = all(shares[name].sure for name in leading)
    sums = np.cumsum(np.maximum(value, 0.0))
    words = (
        f"{one:.1f} %, sum {total:.1f} %"
        for one, total in zip(value, sums, strict=True)
    )
    bars = plot.Bars(
        tuple(leading), np.maximum(value, 0.0), np.array(ends) if certain else None,
        words=tuple(words),
    )  # fmt: skip
    line = plot.curve(sums, np.arange(len(sums), dtype=float), "second", look="dotted")
    axis = plot.PlotAxis(f"% of the variance{CENTRAL * contributions.clipped}")
    largest = ", ".join(f"{n} {100 * shares[n].value:.0f} %" for n in leading[:3])
    panel = plot.PlotPanel(axis, plot.PlotAxis(""), (bars, line))
    return blocks.Figure(
        f"Contributions, the largest first: {largest}",
        plot.Plot((panel,), height=0.19 * len(leading) + 0.65),
        text("Variance contributions, each alone; line: their sum."),
    )  # fmt: skip


def _scatter(
    drawn: Drawn, name: str, response: ReportedResponse
) -> blocks.Figure | None:
    """Draw the response over its three leading contributors; None without any.

    Where few trials dominate its variance, over what differs significantly among
    out-of-limit trials.
    """
    leading, which = response.leading, "matter most"
    if response.contributions and response.contributions.dominated_by_few:
        leading = response.causes.significant if response.causes else []
        which = "differ most among out-of-limit trials"
    if not (leading := leading[:SCATTERED]):
        return None
    times, scales = response.scale.factor, drawn.run.scales
    values = times * drawn.done(name)
    rules = [Level(times * end, "") for end in ends_of(response)]
    panels = []
    for part in leading:
        x, axis = scales[part].factor * drawn.done(part), scales[part].label(part)
        layers: tuple[plot.Layer, ...] = (plot.curve(x, values, look="faint"), *rules)
        label = response.scale.label(name)
        panels.append(plot.PlotPanel(plot.PlotAxis(axis), plot.PlotAxis(label), layers))
    return blocks.Figure(
        f"{name} over its leading contributors: {', '.join(leading)}",
        plot.Plot(tuple(panels), side_by_side=True, width=7.05, height=2.4),
        text(f"Each of the {len(values)} trials done over the contributors that "
             f"{which}."),
        wide=True,
    )  # fmt: skip


def paired_figure(
    name: str,
    scale: Scale,
    labels: tuple[str, str],
    values: tuple[Array, Array],
    limits: Sequence[Limited | None],
) -> blocks.Figure:
    """Draw a response of each trial in one design over the same trial in another.

    Trials that are out of limit in one of the two alone have another colour.
    """
    x, y = (scale.factor * side for side in values)
    ends = np.array([min(x.min(), y.min()), max(x.max(), y.max())])
    changed = np.zeros(len(x), dtype=np.bool_)
    words = ""
    if (before := limits[0]) and (after := limits[1]):
        good = within(values[0], before.limit.permitted)
        better = ~good & within(values[1], after.limit.permitted)
        worse = good & ~within(values[1], after.limit.permitted)
        changed = better | worse
        words = (
            f" Red: {np.count_nonzero(better)} out of limit in {labels[0]} alone, "
            f"{np.count_nonzero(worse)} in {labels[1]} alone."
        )
    layers = [
        plot.curve(x[~changed], y[~changed], look="faint"),
        plot.curve(x[changed], y[changed], "limit", look="dots"),
        plot.curve(ends, ends, "ink", "no difference"),
    ]
    return figure_of(
        f"{name} of each trial in {labels[1]} over the same trial in {labels[0]}",
        plot.PlotAxis(scale.label(f"{labels[0]}: {name}")),
        plot.PlotAxis(scale.label(f"{labels[1]}: {name}")), *layers,
        caption=f"Each trial that is done in both: in {labels[1]} over "
        f"{labels[0]}.{words}",
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
    points = times * np.sort(values)[chosen]
    return plot.curve(points, share[chosen], colour, label, "dots")


def ends_of(summary: Summary) -> list[float]:
    """Return the ends of the limit that there are."""
    return summary.limited.limit.finite if summary.limited else []


def limit_rules(summary: Summary, scale: Scale) -> list[Span]:
    """Mark the ends of the limit, with its words in the legend."""
    words = f"limit {summary.limited.limit.words}" if summary.limited else ""
    return [
        line_at(scale.factor * end, words if i == 0 else "", "limit", "--")
        for i, end in enumerate(ends_of(summary))
    ]


def line_at(value: float, words: str, colour: str, dash: str) -> Span:
    """Return an upright line across a panel."""
    return Span(value, value, words, colour, dash)


def edges_of(
    values: Array, bins: int = BINS, permitted: tuple[float, float] = OPEN
) -> Array:
    """Return the edges of the bars of a histogram; fewer where values hardly differ.

    Equal values lie in the middle of a bar, narrow beside what is permitted.
    """
    low, high = float(values.min()), float(values.max())
    if not high > low:
        far = [abs(end - low) for end in permitted if math.isfinite(end)]
        wide = 2 * (max(far, default=0.0) or abs(low) or 1.0) / bins
        low -= wide * (bins // 2 + 0.5)
        high = low + wide * bins
    edges: Array = np.unique(np.linspace(low, high, bins + 1))
    return edges


def _most_important(response: ReportedResponse) -> str:
    """Say the most important numbers, for those who do not see the picture."""
    numbers = {
        "nominal": response.nominal, "median": response.quantiles[0.5].value,
        "95 %": response.quantiles[0.95].value, "largest": response.largest,
    }  # fmt: skip
    words = [f"{n} {response.scale.words(x)}" for n, x in numbers.items() if x == x]
    if response.limited:
        words.append(f"limit {response.limited.limit.words}")
    return ", ".join(words)
