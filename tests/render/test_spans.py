"""Spans of a chart: shaded in light and in dark, a line where both ends are one."""

from __future__ import annotations

import numpy as np

from tolstat.answers.views.view_file import draw_view
from tolstat.document.view_content import plot_of
from tolstat.model.view import Axis, Chart, Curve, Span
from tolstat.render.drawing import as_svg

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
    spans = [layer for layer in panel.layers if isinstance(layer, Span)]
    assert spans == [*SPANS[:2]]
    (axes,) = draw_view(chart(*SPANS), "speeds").axes
    (rule,) = (line for line in axes.lines if line.get_label() == "working speed")
    assert [*rule.get_xdata()] == [5.0, 5.0]
    assert panel.x.label == "speed, rad/s (shaded: free)"


def test_a_shaded_span_has_a_colour_of_the_page():
    shaded, bare = (as_svg(plot_of(chart(*each)), "speeds") for each in (SPANS[:1], ()))
    colour = "fill:var(--grid)"  # another in the dark
    assert shaded.count(colour) == bare.count(colour) + 1
