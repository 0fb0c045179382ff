"""The comparison of two designs as a page."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray
from scipy.special import ndtri

from tolstat.reporting.comparison import SIDES, Comparison, Pair, ResponseCompared
from tolstat.reporting.distribution_pictures import (
    edges_of,
    mark_limit,
    scale_of_probability,
    spread_out,
)
from tolstat.reporting.page import Numbers, environment, style
from tolstat.reporting.page_picture import (
    INK,
    MOST_POINTS,
    inline,
    legend_above,
    page_figure,
)
from tolstat.reporting.picture import COLOURS, logarithmic
from tolstat.reporting.plain import share_words
from tolstat.statistics.summary import QUANTILES

Array = NDArray[np.float64]
LABELS = ("A", "B")


def make_comparison_page(pair: Pair, found: Comparison) -> str:
    """Make the page of a comparison.

    Parameters
    ----------
    pair : Pair
        Two runs of the same machines.
    found : Comparison
        Of `compared`: every number on the page is one of these.

    Returns
    -------
    str
        HTML.
    """
    numbers = Numbers(found)
    responses = found.responses
    limited = [
        (name, side)
        for name, each in responses.items()
        for side in SIDES
        if getattr(each, side).limited
    ]
    template = environment().get_template("comparison.html")
    page: str = template.render(
        title=f"{found.first.title} | {found.second.title}",
        style=style(),
        f=found,
        at=numbers.at,
        show=numbers.show,
        estimate_line=numbers.estimate_line,
        limited=limited,
        shares=QUANTILES,
        share_words=share_words,
        sides=dict(zip(SIDES, LABELS, strict=True)),
        pictures={
            name: [
                _distributions(pair, name, responses[name]),
                _differences(pair, name, responses[name]),
                _scatter(pair, name, responses[name]),
            ]
            for name in found.interest
        },
    )
    return page


def _both(pair: Pair, name: str) -> list[Array]:
    done = pair.sample.done
    return [drawn.values(name)[done] for drawn in (pair.first, pair.second)]


def _distributions(pair: Pair, name: str, found: ResponseCompared) -> Markup:
    """Draw both distribution functions on a probability scale."""
    times, n = found.scale.factor, int(pair.sample.done.sum())
    share = (np.arange(1, n + 1) - 0.5) / n
    with page_figure() as figure:
        axes = figure.subplots()
        chosen = spread_out(n)
        for values, colour, label in zip(
            _both(pair, name), COLOURS, LABELS, strict=False
        ):
            axes.plot(
                times * np.sort(values)[chosen], ndtri(share[chosen]), ".",
                color=colour, markersize=3, label=label,
            )  # fmt: skip
        scale_of_probability(axes, share[0])
        mark_limit(axes, found.first if found.first.limited else found.second, times)
        axes.set_xlabel(found.scale.label(name))
        legend_above(axes)
        return inline(figure, f"Distributions of {name} in A and in B")


def _differences(pair: Pair, name: str, found: ResponseCompared) -> Markup:
    """Draw how often each difference occurs."""
    first, second = _both(pair, name)
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
        axes.set_xlabel(found.scale.label(f"B - A of {name}"))
        axes.set_ylabel("machines a bar")
        legend_above(axes)
        return inline(figure, f"Histogram of the differences of {name}, B less A")


def _scatter(pair: Pair, name: str, found: ResponseCompared) -> Markup:
    """Draw each machine: B over A."""
    first, second = (found.scale.factor * each for each in _both(pair, name))
    with page_figure() as figure:
        axes = figure.subplots()
        axes.plot(
            first, second, ".", color=COLOURS[0], markersize=2.5, alpha=0.4,
            markeredgewidth=0, rasterized=len(first) > MOST_POINTS,
        )  # fmt: skip
        ends = [min(first.min(), second.min()), max(first.max(), second.max())]
        axes.plot(ends, ends, color=INK, linewidth=0.8, label="no difference")
        axes.set_xlabel(found.scale.label(f"A: {name}"))
        axes.set_ylabel(found.scale.label(f"B: {name}"))
        legend_above(axes)
        return inline(figure, f"{name} of each machine in B over the same machine in A")
