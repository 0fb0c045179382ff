"""Figures of a response in two designs: distributions, differences, trial by trial."""

from collections.abc import Iterator

import numpy as np

from tolstat.answers.compare.comparison import Design
from tolstat.answers.compare.pairing import Pairing
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
from tolstat.units.scale import Scale


def figures_of(
    pairing: Pairing, designs: tuple[Design, Design], name: str, scale: Scale
) -> Iterator[Figure]:
    """Draw a response in focus: its distributions and, if paired, differences."""
    a, b = (design.responses[name] for design in designs)
    label, times = designs[1].label, scale.factor
    first, second = pairing.done(name)
    whose = f"All trials done: {len(first)} of A, {len(second)} of {label}."
    if pairing.paired:
        failed = f"{pairing.failed} failed in either"
        whose = f"The {len(first)} that are done in both; {failed}."
    yield figure_of(
        f"Distributions of {name} in A and in {label}",
        PlotAxis(scale.label(name)),
        PROBABILITY,
        points_of(first, times, "first", "A"),
        points_of(second, times, "second", label),
        *limit_rules(a if a.limited else b, scale),
        caption=f"Fraction below. {STRAIGHT} {whose}",
    )
    if not pairing.paired:
        return
    less = times * (second - first)
    counts, edges = np.histogram(less, edges_of(less))
    yield figure_of(
        f"Histogram of the differences of {name}, {label} less A",
        PlotAxis(scale.label(f"{label} - A of {name}")),
        PlotAxis("trials per bin", "symlog", (0.0, 1.5 * float(counts.max()))),
        Histogram(edges, counts.astype(float), "third"),
        line_at(0.0, "no difference", "ink", "-"),
        caption="Differences trial by trial, of those that are done in both.",
    )
    x, y = times * first, times * second
    ends = np.array([min(x.min(), y.min()), max(x.max(), y.max())])
    yield figure_of(
        f"{name} of each trial in {label} over the same trial in A",
        PlotAxis(scale.label(f"A: {name}")),
        PlotAxis(scale.label(f"{label}: {name}")),
        curve(x, y, look="faint"),
        curve(ends, ends, "ink", "no difference"),
        caption=f"Each trial that is done in both: in {label} over A.",
    )
