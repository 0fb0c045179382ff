"""Intervals against a level, along a logarithmic axis of a page."""

from __future__ import annotations

import math

import pytest

from tests.answers.browser import asked
from tolstat.document.blocks import Document, Range, Ranges
from tolstat.render.page import Track, page
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import PPM

ROWS = (
    Range("most", Estimate(0.01, 0.001, 0.1), 0.001, "not met"),
    Range("none", Estimate(0.0, 0.0, 1e-4), 0.001, "met"),
    Range("few", Estimate(0.5, reason="needs 9 trials"), 0.001, "undecided"),
)


def made(*rows):
    return Ranges("shares out of limit", rows or ROWS, PPM, "permitted")


def test_places_are_logarithmic_above_the_first_power_of_ten():
    """From 10 to 1e6 ppm there are five decades; below them the axis reaches 0."""
    found = Track(made())
    assert found.ticks == (0, 10, 100, 1000, 1e4, 1e5, 1e6)
    zero, first, *_, last = (found.percent(x / 1e6) for x in found.ticks)
    assert (zero, last) == (0, 100) and 0 < first < 10
    for value, decades in ((0.001, 2), (0.01, 3), (0.1, 4)):
        at = first + decades * (100 - first) / 5
        assert found.percent(value) == pytest.approx(at, abs=0.01)
    assert found.shared == "permitted 1000"
    assert found.percent(math.inf) == 100 and found.percent(-1.0) == 0


def test_a_level_of_each_row_is_named_by_none():
    found = Track(made(ROWS[0], ROWS[1]._replace(level=0.01)))
    assert found.shared == "" and found.percent(0.001) < found.percent(0.01)


def test_what_lies_below_the_axis_is_near_its_beginning():
    rare = Range("rare", Estimate(1e-9, 0.0, 1e-8), 1e-3, "met")
    found = Track(made(ROWS[0], rare))
    assert len(found.ticks) <= 7
    assert 0 < found.percent(1e-8) < found.percent(found.ticks[1] / 1e6)
    endless = Range("endless", Estimate(0.5, 0.1, math.inf), 0.1, "met")
    assert Track(made(endless)).ticks[-1] == 1e6


def test_a_row_without_an_interval_has_the_reason():
    text = page(Document("", (made(),)))
    assert text.count('class="bar') == 2 and "needs 9 trials" in text


@pytest.mark.parametrize("width", [390, 1100])
@pytest.mark.parametrize("paper", [False, True])
def test_bars_lie_where_the_axis_says(tmp_path, width, paper):
    """In a browser: a bar between its ends, its dot in it, all within the page."""
    path = tmp_path / "ranges.html"
    path.write_text(page(Document("", (made(),))))
    box = (
        "e => { const b = e.getBoundingClientRect(); return [b.left, b.right, b.top] }"
    )
    boxes = "[" + ", ".join(
        f"[...document.querySelectorAll('.ranges {kind}')].map({box})"
        for kind in (".bar", ".dot", ".level", ".track", "hr, .ranges span")
    ) + "]"  # fmt: skip
    bars, dots, levels, tracks, every = asked(path, tmp_path, width, boxes, paper=paper)
    _head, *rows = tracks
    for (left, right, _), (a, b, _), track, i in zip(
        bars, dots, rows, (0, 1), strict=False
    ):
        whole, axis = track[1] - track[0], Track(made())
        value, lower, upper = (axis.percent(x) for x in ROWS[i].found[:3])
        assert left == pytest.approx(track[0] + whole * lower / 100, abs=2)
        assert right == pytest.approx(track[0] + whole * upper / 100, abs=2)
        assert (a + b) / 2 == pytest.approx(track[0] + whole * value / 100, abs=2)
    assert len(bars) == len(dots) == 2 and len(levels) == 3
    assert max(right for _, right, _ in every) <= width
