"""The trade-off: tolerances for the drawing's cost, and the picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

import tolstat
from tests.answers.allocate.linear_stack import (
    LIMIT,
    PRICES,
    SLOPES,
    Linear,
    closed_form,
    listed,
    reciprocal,
    searching,
)
from tests.answers.picture_checks import nothing_overlaps
from tolstat.answers.allocate import search as searches
from tolstat.answers.allocate.allocation_document import (
    chart_of,
    equal_cost_words,
    trade_off_chart,
)
from tolstat.answers.allocate.fresh_runs import Scheme
from tolstat.answers.allocate.reweighted_pool import Pool
from tolstat.answers.allocate.search import Point, Search, for_equal_cost
from tolstat.answers.views.view_file import draw_view
from tolstat.model.view import Mark
from tolstat.render.screen import as_text
from tolstat.statistics.estimate import Estimate


def test_no_improvement_at_the_drawings_cost_is_reported():
    given = listed()
    del given["deviations"]["link_2"], given["deviations"]["link_3"]
    found = tolstat.allocate(given, model=Linear())
    drawn, equal = found.schemes["drawing"], found.schemes["equal_cost"]
    assert equal == drawn
    assert "No tolerances were found for" in as_text(equal_cost_words(found.schemes))


@pytest.fixture
def shares_known(monkeypatch):
    """The fraction out of limit is a closed form, and not what a pool says."""

    def known(choice):
        sigma = np.linalg.norm(SLOPES * np.exp(choice) / 3)
        return np.full(2, 2 * float(ndtr(-LIMIT / sigma)))

    monkeypatch.setattr(
        Pool, "upper_ends", lambda pool, choice, *_, **__: known(choice)
    )
    return known


def test_the_choice_at_the_drawings_cost_spends_nearly_all(shares_known):
    search = searching(reciprocal(), trials=100)
    spent = for_equal_cost(search, [])
    drawn = search.runs.cost(search.specified)
    assert 0.98 * drawn < search.runs.cost(spent) <= drawn
    # Lagrange, of that cost
    _, T = closed_form()
    c = np.array([*PRICES.values()]) * 0.1e-3
    assert np.exp(spent) == pytest.approx(T * np.sum(c / T) / drawn, rel=0.06)


def test_the_choice_at_the_drawings_cost_is_found_by_halving(shares_known, monkeypatch):
    """Of the dearer points of the curve from the nearest one on: five halvings."""
    search = searching(reciprocal(), trials=100)
    drawn = search.runs.cost(search.specified)
    cost, T = closed_form()
    points = []
    for own in (0.9 * drawn, 0.95 * drawn, 1.05 * drawn, 3.0 * drawn):
        choice = tuple(np.log(T * cost / own))
        points.append(Point(float(shares_known(choice)[0]), own, choice))
    spent = for_equal_cost(search, points)
    # three digits of a tolerance are half a hundredth at most
    assert 0.99 * drawn < search.runs.cost(spent) <= drawn
    # where weights show no way it is the best of the curve that costs no more
    monkeypatch.setattr(Search, "cheapest_for", lambda *asked: None)
    best = for_equal_cost(search, points)
    assert best == search.runs.as_written(points[1].choice)
    worse = [replace(points[0], fraction_out_of_any_limit=0.5)]
    assert for_equal_cost(search, worse) == search.specified


def test_a_choice_proved_worse_than_the_drawing_is_not_offered(monkeypatch):
    monkeypatch.setattr(searches, "for_equal_cost", lambda search, _: search.loosest)
    search = searching(reciprocal(), trials=500)
    proof = searches.at_equal_cost(search, [], 3)
    assert proof.choice == search.specified


def test_no_significant_difference_is_not_called_no_improvement(monkeypatch):
    monkeypatch.setattr(searches, "for_equal_cost", lambda search, _: search.tightest)
    given = reciprocal()
    given["limits"]["gap"]["limit"] = "-1..1 mm"  # none of either is out of it
    search = searching(given, trials=500)
    proof = searches.at_equal_cost(search, [], 3)
    assert proof.choice == search.tightest != search.specified
    schemes = {"drawing": search.runs.prove(search.specified, 3).scheme}
    said = as_text(equal_cost_words(schemes | {"equal_cost": proof.scheme}))
    assert "0 ppm (0 to 9110) instead of 0 ppm (0 to 9110)" in said


def scheme(cost, share, trials=500, lower=0.0):
    beyond = Estimate(share, lower, 0.01)
    words = {"part": f"+-{1 / cost:.3g} mm"}
    return Scheme(cost, words, {}, {"gap": beyond}, beyond, trials, 1)


def test_the_picture_shows_intervals_and_no_dot_for_zero():
    chart = trade_off_chart(
        [Point(0.001, 12.0, ()), Point(0.01, 9.0, ())],
        {"found": scheme(10.0, 0.004), "worst case": scheme(20.0, 0.0)},
    )
    line, found, worst = chart.curves
    assert np.array_equal(chart.at, [0.001, 0.01]) and [*line.values] == [12.0, 9.0]
    assert not line.points and chart.marks == (Mark("found", 0.004, 10.0),)
    assert found.name == "found" and [*found.at] == [0.0, 0.004, 0.01]
    assert worst.name == "worst case, 20: none of 500 out of limit"
    assert [*worst.values] == [20.0, 20.0] and [*worst.at] == [0.0, 0.01]


def test_equal_tolerances_are_plotted_once_from_the_longest_run():
    chart = trade_off_chart([], {
        "as drawn": scheme(10.0, 0.004), "worst case": scheme(20.0, 0.002),
        "root sum square": scheme(10.0, 0.005, trials=2000),
    })  # fmt: skip
    _, both, _ = chart.curves
    assert both.name == "as drawn = root sum square" and both.at[1] == 0.005


def test_an_interval_below_the_axis_begins_at_its_end():
    schemes = {"a": scheme(10.0, 4e-3, lower=1e-7), "b": scheme(20.0, 5e-3, lower=2e-3)}
    chart = trade_off_chart([Point(0.01, 9.0, ())], schemes)
    (axes,) = draw_view(chart, "stack").axes
    left, _ = axes.get_xlim()
    assert left == pytest.approx(2000) and chart.curves[1].at[0] == 1e-7


def test_list_choices_are_plotted_as_dots():
    """A line between them would be of tolerances that nobody can have."""
    listed = reciprocal()
    listed["limits"] = {"gap": {"limit": "-0.15..0.15 mm", "yield": "95 %"}}
    for name in list(listed["deviations"]):
        listed["deviations"][name] = {
            "tolerance": "+-0.1 mm", "cost": {"+-0.1 mm": 1, "+-0.05 mm": 3}
        }  # fmt: skip
    found = tolstat.allocate(listed, model=Linear())
    cheapest = chart_of(found).curves[0]
    assert cheapest.points and len(set(cheapest.values)) == len(cheapest.values)
    law = tolstat.allocate(reciprocal(), model=Linear())
    assert not chart_of(law).curves[0].points


@pytest.mark.parametrize(
    ("alike", "none_beyond"),
    [("12345", "45"), ("12345", "12345"), ("12245", ""), ("11145", "5"),
     ("12211", "2"), ("11111", "1"), ("12345", "")],
)  # fmt: skip
def test_the_legend_does_not_cover_axis_labels(alike, none_beyond):
    """Whichever tolerances are the same, and have none beyond: columns as they fit."""
    names = "as drawn", "found", "at the cost drawn", "root sum square", "worst case"
    schemes = {}
    for name, which in zip(names, alike, strict=True):
        share = 0.0 if which in none_beyond else 1e-3 * int(which)
        beyond = Estimate(share, share / 2, share + 1e-3)
        schemes[name] = Scheme(
            1234.0, {"a": which}, {"a": 1.0}, {}, beyond, trials=106496, seed=1
        )
    points = [Point(share, cost, ()) for cost, share in ((150, 2e-4), (90, 2e-2))]
    figure = draw_view(trade_off_chart(points, schemes), "cost over ppm")
    nothing_overlaps(figure)
    (axes,) = figure.axes
    assert axes.get_position().width > 0.85
