"""The comparison of two designs as a page."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray
from scipy.special import ndtri

from tolstat.report.comparison import SIDES, Pair
from tolstat.report.distribution_pictures import (
    BINS,
    mark_limit,
    scale_of_probability,
    spread_out,
)
from tolstat.report.numbers import limit_in_words
from tolstat.report.page import SHARES, Numbers, environment, style
from tolstat.report.page_picture import (
    INK,
    MOST_POINTS,
    inline,
    legend_above,
    page_figure,
)
from tolstat.report.picture import COLOURS, axis_label, factor
from tolstat.report.plain import Found

Array = NDArray[np.float64]
LABELS = ("A", "B")


def make_comparison_page(pair: Pair, found: Found) -> str:
    """Make the page of a comparison.

    Parameters
    ----------
    pair : Pair
        Two runs of the same machines.
    found : dict
        Of `compared`: every number on the page is one of these.

    Returns
    -------
    str
        HTML.
    """
    numbers = Numbers(found)
    responses = found["responses"]
    limited = [
        (name, side)
        for name, each in responses.items()
        for side in SIDES
        if each[side]["limit"]
    ]
    runs = dict(zip(SIDES, (pair.first.run, pair.second.run), strict=True))
    template = environment().get_template("comparison.html")
    page: str = template.render(
        title=f"{found['first']['title']} | {found['second']['title']}",
        style=style(),
        f=found,
        at=numbers.at,
        show=numbers.show,
        estimate_line=numbers.estimate_line,
        limited=limited,
        limit_words=lambda name, side: limit_in_words(
            runs[side].limits[name], responses[name]["unit"]
        ),
        shares=SHARES,
        done_key="done_in_both",
        sides=dict(zip(SIDES, LABELS, strict=True)),
        pictures={
            name: [
                _distributions(pair, name, responses[name]),
                _differences(pair, name, responses[name]),
                _scatter(pair, name, responses[name]),
            ]
            for name in found["interest"]
        },
    )
    return page


def _both(pair: Pair, name: str) -> list[Array]:
    done = pair.sample.done
    return [drawn.values(name)[done] for drawn in (pair.first, pair.second)]


def _distributions(pair: Pair, name: str, found: Found) -> Markup:
    """Draw both distribution functions on a probability scale."""
    unit, n = found["unit"], int(pair.sample.done.sum())
    share = (np.arange(1, n + 1) - 0.5) / n
    with page_figure() as figure:
        axes = figure.subplots()
        chosen = spread_out(n)
        for values, colour, label in zip(
            _both(pair, name), COLOURS, LABELS, strict=False
        ):
            axes.plot(
                factor(unit) * np.sort(values)[chosen], ndtri(share[chosen]), ".",
                color=colour, markersize=3, label=label,
            )  # fmt: skip
        scale_of_probability(axes, share[0])
        limited = found["first"] if found["first"]["limit"] else found["second"]
        mark_limit(axes, limited, factor(unit))
        axes.set_xlabel(axis_label(name, unit))
        legend_above(axes)
        return inline(figure, f"Distributions of {name} in A and in B")


def _differences(pair: Pair, name: str, found: Found) -> Markup:
    """Draw how often each difference occurs."""
    first, second = _both(pair, name)
    scale = factor(found["unit"])
    with page_figure() as figure:
        axes = figure.subplots()
        counts, edges = np.histogram(scale * (second - first), BINS)
        axes.bar(
            edges[:-1], counts, np.diff(edges), align="edge", color=COLOURS[2],
            linewidth=0,
        )  # fmt: skip
        axes.axvline(0.0, color=INK, linewidth=1, label="no difference")
        axes.set_yscale("symlog", linthresh=10)
        axes.set_ylim(bottom=0)
        axes.set_xlabel(axis_label(f"B - A of {name}", found["unit"]))
        axes.set_ylabel("machines a bar")
        legend_above(axes)
        return inline(figure, f"Histogram of the differences of {name}, B less A")


def _scatter(pair: Pair, name: str, found: Found) -> Markup:
    """Draw each machine: B over A."""
    first, second = (factor(found["unit"]) * each for each in _both(pair, name))
    with page_figure() as figure:
        axes = figure.subplots()
        axes.plot(
            first, second, ".", color=COLOURS[0], markersize=2.5, alpha=0.4,
            markeredgewidth=0, rasterized=len(first) > MOST_POINTS,
        )  # fmt: skip
        ends = [min(first.min(), second.min()), max(first.max(), second.max())]
        axes.plot(ends, ends, color=INK, linewidth=0.8, label="no difference")
        axes.set_xlabel(axis_label(f"A: {name}", found["unit"]))
        axes.set_ylabel(axis_label(f"B: {name}", found["unit"]))
        legend_above(axes)
        return inline(figure, f"{name} of each machine in B over the same machine in A")
