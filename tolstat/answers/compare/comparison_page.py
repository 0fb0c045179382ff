"""The comparison of designs as a page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray
from scipy.special import ndtri

from tolstat.answers.compare.comparison import (
    COMPARED,
    Comparison,
    Comparisons,
    ResponseCompared,
    SideFindings,
)
from tolstat.answers.compare.comparison_table import LABELS
from tolstat.answers.compare.pairing import UNPAIRED, Pair
from tolstat.answers.report.distribution_pictures import (
    edges_of,
    mark_limit,
    scale_of_probability,
    spread_out,
)
from tolstat.answers.report.template_page import page_of
from tolstat.render.page_picture import (
    INK,
    MOST_POINTS,
    inline,
    legend_above,
    page_figure,
)
from tolstat.render.picture import COLOURS, logarithmic
from tolstat.render.plain import share_words
from tolstat.statistics.summary import QUANTILES

Array = NDArray[np.float64]


def make_comparison_page(pairs: Sequence[Pair], found: Comparisons) -> str:
    """Make the page of a comparison.

    Parameters
    ----------
    pairs : sequence of Pair
        The runs, each beside the first.
    found : Comparisons
        Of `compared_with_first`: every number on the page is one of these.

    Returns
    -------
    str
        HTML.
    """
    each = [
        Shown([] if found.alone else ["comparisons", place], label, one, pair)
        for place, (label, one, pair) in enumerate(
            zip(LABELS[1:], found.comparisons, pairs, strict=False)
        )
    ]
    first, others = each[0].found.first, [one.found.second for one in each]
    return page_of(
        "comparison.html",
        found.alone or found,
        title=" | ".join([first.title, *(side.title for side in others)]),
        each=each,
        designs=_designs(each),
        verdicts=_verdicts(each),
        shares=QUANTILES,
        compared=COMPARED,
        unpaired=UNPAIRED,
        share_words=share_words,
        pictures={
            (one.label, name): _pictures(one, name)
            for one in each
            for name in one.found.interest
        },
    )


class Shown(NamedTuple):
    """A run beside the first: where its findings lie, its letter, what is said."""

    path: list[Any]
    label: str
    found: Comparison
    pair: Pair


def _designs(each: Sequence[Shown]) -> list[tuple[str, SideFindings, list[Any]]]:
    """List letter, findings and path of every run."""
    first = each[0]
    return [
        ("A", first.found.first, [*first.path, "first"]),
        *((one.label, one.found.second, [*one.path, "second"]) for one in each),
    ]


def _verdicts(each: Sequence[Shown]) -> list[tuple[str, str, list[Any]]]:
    """List response, letter and path of everything limited, by response."""
    found = []
    for name in dict.fromkeys(name for one in each for name in one.found.responses):
        having = [one for one in each if name in one.found.responses]
        sides = [("A", "first", having[0])]
        sides += [(one.label, "second", one) for one in having]
        for label, side, one in sides:
            if getattr(one.found.responses[name], side).limited:
                found.append((name, label, [*one.path, "responses", name, side]))
    return found


def _pictures(one: Shown, name: str) -> list[Markup]:
    found = one.found.responses[name]
    drawn = [_distributions(one, name, found)]
    if one.pair.sample is not None:
        drawn += [_differences(one, name, found), _scatter(one, name, found)]
    return drawn


def _distributions(one: Shown, name: str, found: ResponseCompared) -> Markup:
    """Draw both distribution functions on a probability scale."""
    times, labels = found.scale.factor, ("A", one.label)
    with page_figure() as figure:
        axes = figure.subplots()
        least = 0.5
        for values, colour, label in zip(
            one.pair.done(name), COLOURS, labels, strict=False
        ):
            n = len(values)
            share, chosen = (np.arange(1, n + 1) - 0.5) / n, spread_out(n)
            least = min(least, share[0])
            axes.plot(
                times * np.sort(values)[chosen], ndtri(share[chosen]), ".",
                color=colour, markersize=3, label=label,
            )  # fmt: skip
        scale_of_probability(axes, least)
        mark_limit(axes, found.first if found.first.limited else found.second, times)
        axes.set_xlabel(found.scale.label(name))
        legend_above(axes)
        return inline(figure, f"Distributions of {name} in A and in {one.label}")


def _differences(one: Shown, name: str, found: ResponseCompared) -> Markup:
    """Draw how often each difference occurs."""
    first, second = one.pair.done(name)
    scale = found.scale.factor
    with page_figure() as figure:
        axes = figure.subplots()
        differences = scale * (second - first)
        counts, edges = np.histogram(differences, edges_of(differences))
        axes.bar(
            edges[:-1], counts, np.diff(edges), align="edge", color=COLOURS[2],
            linewidth=0,
        )  # fmt: skip
        axes.axvline(0.0, color=INK, linewidth=1, label="no difference")
        logarithmic(axes.yaxis, linthresh=10)
        axes.set_ylim(bottom=0)
        axes.set_xlabel(found.scale.label(f"{one.label} - A of {name}"))
        axes.set_ylabel("machines a bar")
        legend_above(axes)
        return inline(
            figure, f"Histogram of the differences of {name}, {one.label} less A"
        )


def _scatter(one: Shown, name: str, found: ResponseCompared) -> Markup:
    """Draw each machine: B over A."""
    first, second = (found.scale.factor * each for each in one.pair.done(name))
    with page_figure() as figure:
        axes = figure.subplots()
        axes.plot(
            first, second, ".", color=COLOURS[0], markersize=2.5, alpha=0.4,
            markeredgewidth=0, rasterized=len(first) > MOST_POINTS,
        )  # fmt: skip
        ends = [min(first.min(), second.min()), max(first.max(), second.max())]
        axes.plot(ends, ends, color=INK, linewidth=0.8, label="no difference")
        axes.set_xlabel(found.scale.label(f"A: {name}"))
        axes.set_ylabel(found.scale.label(f"{one.label}: {name}"))
        legend_above(axes)
        words = f"{name} of each machine in {one.label} over the same machine in A"
        return inline(figure, words)
