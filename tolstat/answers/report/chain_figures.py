"""Figures of a chain: its links as lengths with a sign, and from nominal to mean."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from tolstat.answers.report.chain_section import NORMAL_SCORE, is_chain
from tolstat.answers.report.full_report import Report
from tolstat.answers.report.response_figures import limit_marks
from tolstat.answers.report.response_summary import ReportedResponse
from tolstat.document import blocks, plot
from tolstat.document.sentences import text
from tolstat.statistics.summary import HIGH, LOW

MOST_LINKS = 8  # that have rows; of more the narrowest are one row
CLOSED = 1e-6  # of a slope from 1: as in a chain of lengths
# ways to judge, with their colours
RANGES = {"worst case": "third", "RSS, 3 sigma": "sixth", "Monte Carlo": "first"}
HEIGHT, AXIS = 0.17, 0.62  # of a row and of the rest, inches


class Link(NamedTuple):
    """A link, or several: by how much it moves the response, SI."""

    name: str
    length: float  # its nominal value with its sign
    mean: float  # by its mean deviation
    lower: float  # by its tolerance
    upper: float


class Chain(NamedTuple):
    """The chain of a response: its links, and what follows from them."""

    name: str
    response: ReportedResponse
    links: tuple[Link, ...]
    fixed: float  # links without a tolerance, with their signs; NaN where not known
    ranges: tuple[tuple[str, float, float], ...]  # three ways to judge, SI


def chain_of(report: Report, name: str) -> Chain | None:
    """Return the chain of a response; None if it is none."""
    run, response = report.stored_run, report.responses[name]
    if not is_chain(run, name) or not response.slopes:
        return None
    links = []
    for part in run.contributors:
        slope, assumed = response.slopes.get(part.name, 0.0), run.assumed
        if not slope or math.isnan(slope) or part.name not in assumed:
            continue
        lower, upper = sorted(slope * end for end in assumed[part.name].tolerance)
        size = math.nan if part.size is None else part.size
        mean = slope * assumed[part.name].mean
        links.append(Link(part.name, slope * size, mean, lower, upper))
    if not links:  # all slopes are zero, as of a distance at its least
        return None
    slopes = (abs(slope) for slope in response.slopes.values() if slope)
    lengths = all(abs(slope - 1) < CLOSED for slope in slopes)
    rest = response.nominal - sum(link.length for link in links)
    worst = {n.worst: n.value for n in run.numbers if n.of == name and n.worst}
    linear, quantiles = response.root_sum_square, response.quantiles
    worst_case, sum_square, trials = RANGES
    ranges = [(worst_case, worst.get("least"), worst.get("largest"))]
    if linear:
        reach = NORMAL_SCORE * linear.sigma
        ranges.append((sum_square, linear.mean - reach, linear.mean + reach))
    if quantiles[LOW].sure and quantiles[HIGH].sure:
        ranges.append((trials, quantiles[LOW].value, quantiles[HIGH].value))
    complete = (
        (words, lower, upper)
        for words, lower, upper in ranges
        if lower is not None and upper is not None and math.isfinite(upper - lower)
    )
    return Chain(
        name, response, tuple(_few(links)), rest if lengths else math.nan,
        tuple(complete),
    )  # fmt: skip


def _few(links: Sequence[Link]) -> Iterator[Link]:
    """Yield the links, those with the narrowest tolerances as one of many."""
    by_width = sorted(links, key=lambda link: link.lower - link.upper)
    wide = by_width if len(links) <= MOST_LINKS else by_width[: MOST_LINKS - 1]
    yield from (link for link in links if link in wide)
    if narrow := by_width[len(wide) :]:
        sums = np.sum([link[1:] for link in narrow], axis=0).tolist()
        yield Link(f"{len(narrow)} others", *sums)


def waterfall(chain: Chain) -> blocks.Figure:
    """Draw how the links lead from the nominal value to the mean.

    And what worst case, root sum square and trials span, against the limit.
    """
    scale, links, ranges = chain.response.scale, chain.links, chain.ranges
    nominal = chain.response.nominal
    ends = nominal + np.cumsum([link.mean for link in links])
    starts = np.concatenate([[nominal], ends[:-1]])
    reach = starts + np.array([[x.lower for x in links], [x.upper for x in links]])
    low, high = np.array([r[1:] for r in ranges]).reshape(-1, 2).T
    none = np.full((2, 1), np.nan)
    times, words = scale.factor, [scale.number(nominal)]
    for link in links:
        half, place = 0.5 * times * (link.upper - link.lower), max(scale.place or 0, 0)
        mean = round(times * link.mean, place) + 0.0  # not -0
        words.append(f"{mean:+.{place}f} ± {half:.{place}f}")
    words += [f"{scale.number(a)} to {scale.number(b)}" for _, a, b in ranges]
    names = ["nominal", *(x.name for x in links), *(x[0] for x in ranges)]
    colours = ["ink", *["fifth"] * len(links), *(RANGES[x[0]] for x in ranges)]
    bars = plot.Bars(
        tuple(names), times * np.concatenate([[nominal], ends, high]),
        times * np.hstack([none, reach, np.tile(none, len(ranges))]),
        starts=times * np.concatenate([[nominal], starts, low]),
        words=tuple(words), colours=tuple(colours), look="steps",
    )  # fmt: skip
    axis = plot.PlotAxis(scale.label(chain.name))
    layers: tuple[plot.Layer, ...] = bars, *limit_marks(chain.response, scale)
    panel = plot.PlotPanel(axis, plot.PlotAxis(""), layers)
    spans = zip(ranges, words[1 + len(links) :], strict=True)
    return blocks.Figure(
        f"Waterfall of {chain.name}: from the nominal value to the mean"
        + "".join(f", {way[0]} {span}" for way, span in spans),
        plot.Plot((panel,), height=HEIGHT * len(names) + AXIS),
        text(
            "Lines: tolerances."
            + " Monte Carlo: 0.135 to 99.865 %." * ("Monte Carlo" in names)
        ),
    )  # fmt: skip


def vectors(chain: Chain) -> blocks.Figure | None:
    """Draw the links as lengths with a sign, one after the other.

    None where the response is no sum of lengths.
    """
    response, scale = chain.response, chain.response.scale
    rows = [(link.name, link.length) for link in chain.links]
    if abs(chain.fixed) > CLOSED * max(abs(length) for _, length in rows):
        rows.append(("fixed links", chain.fixed))
    lengths = np.array([length for _, length in rows])
    if not np.isfinite([chain.fixed, *lengths]).all():
        return None
    ends = np.cumsum(lengths)
    words = [f"{scale.factor * x:+.10g} {scale.mark}" for x in lengths]
    names = (*(name for name, _ in rows), chain.name)
    bars = plot.Bars(
        names, np.append(ends, response.nominal),
        starts=np.concatenate([[0.0], ends[:-1], [0.0]]),
        words=(*words, f"{scale.number(response.nominal)} {scale.mark}"),
        colours=("ink",) * len(rows) + ("first",), look="arrows",
    )  # fmt: skip
    axis = plot.PlotAxis(scale.mark, factor=scale.factor)
    listing = (f"{name} {word}" for name, word in zip(names, words, strict=False))
    return blocks.Figure(
        f"Chain of {chain.name}: {', '.join(listing)}",
        plot.Plot(
            (plot.PlotPanel(axis, plot.PlotAxis(""), (bars,)),),
            height=HEIGHT * len(names) + AXIS,
        ),
        text(f"Chain: {response.sentence}" if response.sentence else "Chain"),
    )  # fmt: skip
