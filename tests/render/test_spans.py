"""Spans of a chart: shaded in light and in dark, a line where both ends are one."""

from __future__ import annotations

import numpy as np

from tolstat.document.plot import Rule, Shade
from tolstat.model.view import Axis, Chart, Curve, Span
from tolstat.render.figures import as_svg
from tolstat.render.shown_view import plot_of

AT = np.linspace(0.0, 10.0, 5)
CURVES = (Curve("f", "Hz", "f", "", AT),)
SPANS = (
    Span(2.0, 3.0, "free"),
    Span(5.0, 5.0, "working speed"),
    Span(11.0, 11.0, "out of sight"),
)


def chart(*spans):
    return Chart(Axis("speed", "rad/s", "rad/s"), AT, CURVES, spans=spans)


def test_a_span_of_one_value_is_a_line_with_its_words():
    (panel,) = plot_of(chart(*SPANS)).panels
    rules = [each for each in panel.layers if isinstance(each, Rule)]
    assert [(each.at, each.upright, each.label) for each in rules] == [
        (5.0, True, "working speed")
    ]
    (shade,) = (each for each in panel.layers if isinstance(each, Shade))
    assert (shade.lower, shade.upper) == (2.0, 3.0)
    assert panel.x.label == "speed, rad/s (shaded: free)"


def test_a_shaded_span_has_a_colour_of_the_page():
    shaded, bare = (as_svg(chart(*each), "speeds") for each in (SPANS[:1], ()))
    colour = "fill: var(--grid)"  # another in the dark
    assert shaded.count(colour) == bare.count(colour) + 1
