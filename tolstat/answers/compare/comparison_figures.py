"""Figures of a response in two designs: distributions, differences, trial by trial."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from tolstat.answers.report.response_figures import (
    PROBABILITY,
    STRAIGHT,
    edges_of,
    figure_of,
    limit_rules,
    line_at,
    points_of,
)
from tolstat.document.blocks import Figure
from tolstat.document.plot import Histogram, PlotAxis, curve

if TYPE_CHECKING:
    from tolstat.answers.compare.comparison import Comparison, Difference


def figures_of(found: Comparison, one: Difference, name: str) -> Iterator[Figure]:
    """Draw a response in focus."""
    yield _distributions(found, one, name)
    if one.pairing.paired:
        yield _differences(found, one, name)
        yield _scatter(found, one, name)


def _distributions(found: Comparison, one: Difference, name: str) -> Figure:
    """Draw both distribution functions on a probability scale."""
    scale, (first, second) = found.responses[name].scale, one.pairing.done(name)
    a, b = (design.responses[name] for design in found.of(one))
    whose = f"All trials done: {len(first)} of A, {len(second)} of {one.design}."
    if one.pairing.paired:
        failed = f"{one.pairing.failed} failed in either"
        whose = f"The {len(first)} that are done in both; {failed}."
    return figure_of(
        f"Distributions of {name} in A and in {one.design}",
        PlotAxis(scale.label(name)),
        PROBABILITY,
        points_of(first, scale.factor, "first", "A"),
        points_of(second, scale.factor, "second", one.design),
        *limit_rules(a if a.limited else b, scale),
        said=f"Fraction below. {STRAIGHT} {whose}",
    )


def _differences(found: Comparison, one: Difference, name: str) -> Figure:
    """Draw how often each difference occurs."""
    scale, (first, second) = found.responses[name].scale, one.pairing.done(name)
    less = scale.factor * (second - first)
    counts, edges = np.histogram(less, edges_of(less))
    return figure_of(
        f"Histogram of the differences of {name}, {one.design} less A",
        PlotAxis(scale.label(f"{one.design} - A of {name}")),
        PlotAxis("trials per bin", "symlog", (0.0, 1.5 * float(counts.max()))),
        Histogram(edges, counts.astype(float), "third"),
        line_at(0.0, "no difference", "ink", "-"),
        said="Differences trial by trial, of those that are done in both.",
    )


def _scatter(found: Comparison, one: Difference, name: str) -> Figure:
    """Draw each trial: a design over the first."""
    scale = found.responses[name].scale
    first, second = (scale.factor * each for each in one.pairing.done(name))
    ends = np.array([min(first.min(), second.min()), max(first.max(), second.max())])
    return figure_of(
        f"{name} of each trial in {one.design} over the same trial in A",
        PlotAxis(scale.label(f"A: {name}")),
        PlotAxis(scale.label(f"{one.design}: {name}")),
        curve(first, second, look="faint"),
        curve(ends, ends, "ink", "no difference"),
        said=f"Each trial that is done in both: in {one.design} over A.",
    )
