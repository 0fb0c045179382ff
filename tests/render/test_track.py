"""Intervals against a level, along a logarithmic axis of a page."""

from __future__ import annotations

import math

import pytest

from tests.answers.browser import asked
from tolstat.document.blocks import Document, Range, Ranges
from tolstat.render.page import page
from tolstat.render.track import track_of
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
    found = track_of(made())
    (zero, _), (first, _), *_ = found.ticks
    assert [words for _, words in found.ticks] == [
        "0", "10", "100", "1000", "10000", "100000", "1000000",
    ]  # fmt: skip
    assert zero == 0 and found.ticks[-1][0] == 100
    decade = (100 - first) / 5
    most, none, few = found.rows
    assert most.at == pytest.approx(first + 3 * decade, abs=0.01)
    lower, right = most.ends
    assert lower == most.level == pytest.approx(first + 2 * decade, abs=0.01)
    assert 100 - right == pytest.approx(first + 4 * decade, abs=0.01)
    assert none.at == none.ends[0] == 0 and none.tone == "met"
    assert few.ends is None and few.reason == "needs 9 trials"
    assert found.level == (most.level, "permitted 1000")


def test_a_level_of_each_row_is_named_by_none():
    found = track_of(made(ROWS[0], ROWS[1]._replace(level=0.01)))
    assert found.level is None
    assert found.rows[0].level < found.rows[1].level


def test_what_lies_below_the_axis_is_near_its_beginning():
    rare = Range("rare", Estimate(1e-9, 0.0, 1e-8), 1e-3, "met")
    found = track_of(made(ROWS[0], rare))
    assert len(found.ticks) <= 7
    assert 0 == found.rows[1].ends[0] < found.rows[1].at < found.ticks[1][0]
    endless = Range("endless", Estimate(0.5, 0.1, math.inf), 0.1, "met")
    assert track_of(made(endless)).rows[0].ends[1] == 0


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
        whole = track[1] - track[0]
        row = track_of(made()).rows[i]
        assert left == pytest.approx(track[0] + whole * row.ends[0] / 100, abs=2)
        assert right == pytest.approx(track[1] - whole * row.ends[1] / 100, abs=2)
        assert (a + b) / 2 == pytest.approx(track[0] + whole * row.at / 100, abs=2)
    assert len(bars) == len(dots) == 2 and len(levels) == 3
    assert max(right for _, right, _ in every) <= width
