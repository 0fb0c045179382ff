"""Several closing links in one run: known results, formulas that name others."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

import tolstat
from tests.study.chains import problems_of
from tolstat.machines.dimension_chain.algebras import Slopes, Values
from tolstat.machines.dimension_chain.gaps import formulas_of
from tolstat.study.study import load


def three_links(gaps, **changes):
    """A study of three links of 10 mm, sigma 1 mm each."""
    links = {name: {"nominal": "10 mm", "sigma": "1 mm"} for name in "abc"}
    return {
        "model": "dimension_chain", "trials": 100_000, "seed": 1, "links": links,
        "gaps": gaps, "limits": dict.fromkeys(gaps, ">= -2.5 mm"), **changes,
    }  # fmt: skip


def test_two_gaps_of_one_link_have_their_joint_yield(tmp_path):
    run = tolstat.run(
        three_links({"p": "a - b", "q": "a - c"}), output=tmp_path / "gaps.h5"
    )
    each = stats.norm.cdf(-2.5 / math.sqrt(2))
    covariance = [[2, 1], [1, 2]]
    joint = stats.multivariate_normal.cdf([2.5, 2.5], cov=covariance)
    frame = run.frame()
    for gap in "pq":
        assert np.mean(frame[gap] < -2.5e-3) == pytest.approx(each, rel=0.05)
    assert 1 - joint == pytest.approx(0.06863, abs=1e-4)
    assert np.mean((frame[["p", "q"]] >= -2.5e-3).all(axis=1)) == pytest.approx(
        joint, abs=0.003
    )
    numbers = {number.name: number.value for number in run.numbers}
    for gap in "pq":
        assert numbers[f"rss_sigma_{gap}"] == pytest.approx(math.sqrt(2) * 1e-3)
        assert numbers[f"worst_min_{gap}"] == pytest.approx(-6e-3)
    assert numbers["share_a_p"] == pytest.approx(0.5)
    assert "share_c_p" not in numbers and not run.warnings


def test_a_gap_may_name_others_in_any_order():
    texts = {"half": "play / 2", "play": "inner - c", "inner": "2*(a - b)"}
    formulas = formulas_of(texts, ("a", "b", "c"))
    links = {"a": 3.0, "b": 1.0, "c": 0.5}
    assert [*formulas] == [*texts]
    assert formulas["half"].worked_out(Values(links)) == 1.75
    assert formulas["half"].worked_out(Slopes(links)).by_link.tolist() == [1, -1, -0.5]
    assert formulas["half"].used == ("a", "b", "c")


@pytest.mark.parametrize(
    "gaps, words",
    [
        ({"p": "q - a", "q": "p + b"}, "p needs q needs p; a gap cannot need itself"),
        ({"p": "p - a"}, "p needs p"),
        ({"a": "b - c"}, "a is a link; choose another name for the gap"),
        ({"max": "b - c"}, "max is a word of formulas"),
        ({"p": "a - x"}, "p = 'a - x', character 5, 'x': [links] has no x"),
        ({"p": "q", "q": "a + 3"}, "q = 'a + 3', character 5, '3': a plain number"),
        ({"p": ""}, "p is empty: a formula is expected"),
        ({"p": 3}, "expected a formula of links"),
        ({f"g{i}": f"g{i - 1} + g{i - 1}" for i in range(1, 40)} | {"g0": "a"},
         "is longer than 20000 characters"),
    ],
)  # fmt: skip
def test_wrong_gaps_are_refused(gaps, words):
    assert words in problems_of(three_links(gaps, limits={}))


def test_one_gap_stays_the_short_form():
    both = three_links({"p": "a - b"}, settings={"gap": "a - c"})
    assert "gap is given in [settings] too" in problems_of(both)
    study = {"model": "stand", "trials": 8, "seed": 1, "gaps": {"p": "a"}}
    assert "model 'stand' has no gaps" in problems_of(study)
    short = three_links({}, settings={"gap": "a - b"})
    assert [r.name for r in load(short).description.responses] == ["gap"]


def test_a_link_that_no_gap_names_is_named(tmp_path):
    run = tolstat.run(
        three_links({"p": "a - b"}, trials=16), output=tmp_path / "gaps.h5"
    )
    assert run.warnings[0].startswith("No formula of a gap names the link c: it chang")


def test_a_fit_in_a_formula_is_one_of_its_two_links():
    links = {"pin": "30 H7/g6 mm", "b": "30 mm"}
    wrong = {"model": "dimension_chain", "trials": 8, "seed": 1, "links": links}
    said = problems_of({**wrong, "gaps": {"play": "pin - b"}})
    assert "'pin': pin is a fit; write pin_hole or pin_shaft" in said
    said = problems_of({**wrong, "links": {"pin": "30 H7/g6 (+0.021/0) mm"}})
    assert "limits are those of one part" in said
