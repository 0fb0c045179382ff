"""Causes that are named: guilty parts with their equals, and no innocent one."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.statistics.failing_parts import parts, worst
from tests.studies.coverage.causes import (
    OUT,
    PROBLEMS,
    STUDIES,
    TABLE,
    found_if_told,
    innocent,
    rates,
)
from tolstat.statistics.sensitivity.named_causes import Effect, named_causes


def of_one(X, beyond, slopes=None, kind="part"):
    known = {n: Effect("same", (slopes or {}).get(n, 0.0), kind) for n in X}
    return named_causes(X, {"y": beyond}, {"y": known})["y"]


def named(found):
    return [each.members for each in found.parts]


PAIR = "|a - 3 b|, the pair"
UNEVEN = "|a + 2 b - c|"  # two of the three are often named without the third
TWINS = ("two equal bearings, a housing", "8 equal parts", "one bad of eight")


@pytest.mark.parametrize(
    "name", [*TWINS, "|a - b|", "a + b", "nothing", "one of four correlated"]
)
def test_planted_causes_are_named_and_nothing_else(name):
    for out in (20, 40):
        found = rates(name, out, studies=15)
        assert found["right"] >= 0.85 and found["wrong"] <= 0.15


def test_the_table_holds_what_the_page_claims():
    table = pd.read_csv(TABLE).set_index(["problem", "out"]).sort_index()
    assert set(table.index) == {(name, m) for name in PROBLEMS for m in OUT}
    assert table["studies"].eq(STUDIES).all()
    wrong, right = table["wrong"], table["right"]
    # 5 % is the error rate of innocent parts; "wrong" counts incomplete names too
    assert wrong.mean() < 0.03 and wrong.drop(UNEVEN).max() <= 0.06
    # incomplete pairs of an uneven sum are the exception
    assert wrong[UNEVEN].max() <= 0.14
    assert (right.xs(40, level="out").drop(PAIR) > 0.92).all()
    assert right[PAIR, 40] > 0.75


def test_innocent_parts_keep_five_percent_where_pairs_are_incomplete():
    assert innocent(UNEVEN, 10, studies=40) <= 0.05


def test_a_tenth_of_the_variance_could_be_found_in_more_studies():
    """The bound on the page: no reason to miss one of four."""
    table = pd.read_csv(TABLE).set_index(["problem", "out"])["right"]
    for out, least in ((10, 0.9), (20, 0.99), (40, 0.99)):
        by_likelihood, by_sign = found_if_told(out)
        assert by_likelihood > least and by_likelihood >= by_sign > table[PAIR, out]


def test_a_twin_is_named_with_the_part_that_is_significant():
    """Equal slope and distribution say what few units do not."""
    X = parts(4096, 20, 8)
    y = X["part_1"] + X["part_2"] + X["part_3"]
    equal = dict.fromkeys(["part_1", "part_2", "part_3"], 2.0)
    assert named(of_one(X, worst(y, 10), equal)) == [tuple(equal)]
    # a slope is no proof: one of them fails by a threshold
    found = of_one(X, X["part_1"] > 2.7, {"part_1": 1.0, "part_2": 1.0})
    assert named(found) == [("part_1",)]


def test_members_of_a_kind_are_named_only_if_guilty():
    X = parts(4096, 8, 3)
    y = 3 * X["part_1"] + 40 * (X["part_2"] > 2.7)
    assert {*sum(named(of_one(X, worst(y, 40))), ())} == {"part_1", "part_2"}


def test_correlated_parts_that_no_unit_tells_apart_are_named_as_such():
    X = parts(4096, 6, 5)
    X["part_2"] = X["part_1"].copy()
    (found,) = of_one(X, worst(X["part_1"], 30)).parts
    assert found.members == ("part_1", "part_2") and found.correlated
    X["part_2"] = X["part_1"] + X["part_3"]
    X.pop("part_3")
    assert named(of_one(X, worst(X["part_1"], 60))) == [("part_1",)]


def test_nothing_is_named_of_few_units_or_of_most():
    X = parts(4096, 6, 5)
    for out in (1, 9, 2100):
        found = of_one(X, worst(X["part_1"], out))
        assert found.parts == found.pairs == [] and len(found.differences) == 6
    assert named(of_one(X, worst(X["part_1"], 10))) == [("part_1",)]
    none = of_one(X, np.zeros(4096, bool))
    assert none.parts == [] and all(e.level == 1 for e in none.differences.values())
