"""Permitted shifts of nominals, against closed forms."""

from __future__ import annotations

import csv
import io
import math
import tomllib

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ndtr

import tolstat
from tests.answers.allocate.linear_stack import (
    LIMIT,
    OFFERED,
    PRICES,
    SLOPES,
    Linear,
    closed_form,
    listed,
    pool_of,
    reciprocal,
)
from tolstat.answers.allocate import search as searches
from tolstat.answers.allocate.fresh_runs import FreshRuns
from tolstat.answers.allocate.linear_schemes import linear_choices
from tolstat.answers.allocate.search import Search
from tolstat.deviations.spread import halved, resized, spread_of
from tolstat.errors import StudyError
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.model.checked import simulate
from tolstat.render.screen import as_text
from tolstat.study.study import load


@pytest.fixture(autouse=True)
def less_to_be_searched(monkeypatch):
    monkeypatch.setattr(searches, "CURVE", np.array([]))
    monkeypatch.setattr(searches, "BISECTIONS", 1)  # of the best at the drawing's cost


def off_centre(by, **shift):
    """The stack with its limit this far, mm, to one side, and shifts of one link."""
    given = reciprocal()
    given["limits"]["gap"]["limit"] = f"{by - 0.2:.6g}..{by + 0.2:.6g} mm"
    given["deviations"]["link_1"]["cost"] |= shift
    return given


def cost_off_centre(by):
    """Least cost where the mean stays this far, m, from the middle of the limit."""
    c = np.array([*PRICES.values()]) * 0.1e-3
    T = (c / SLOPES**2) ** (1 / 3)
    one = math.sqrt(np.sum((SLOPES * T / 3) ** 2))

    def above(times):
        low, high = (-LIMIT - by) / (times * one), (by - LIMIT) / (times * one)
        return ndtr(low) + ndtr(high) - 0.02

    return float(np.sum(c / T)) / brentq(above, 1e-3 * LIMIT / one, LIMIT / one)


def test_a_free_shift_comes_first_and_the_tolerances_are_lagranges():
    found = tolstat.allocate(off_centre(0.2, shift="+-0.4 mm"), model=Linear())
    cost, _ = closed_form()
    assert found.met and cost < found.cost < 1.02 * cost
    words = found.proof.tolerances["shift of link_1"]
    assert float(words.removesuffix(" mm")) == pytest.approx(0.2, abs=0.02)
    # root sum square may shift as well
    assert found.schemes["root_sum_square"].cost == pytest.approx(cost, rel=0.01)
    # what names it: the study, the table, the document
    link = tomllib.loads(found.study_file())["deviations"]["link_1"]
    assert link["nominal_shift"] == words and link["tolerance"].startswith("+-")
    rows = [*csv.DictReader(io.StringIO(found.csv()))]
    assert {row["scheme"]: row for row in rows}["found"]["shift of link_1"] == words
    entry = found.entries[1]
    assert (entry.name, entry.specified, entry.found) == (
        "shift of link_1", "0 mm", words,
    )  # fmt: skip
    # and from there nothing is gained
    again = load(tomllib.loads(found.study_file()), model=Linear())
    assert again.deviating.priced[1].text(float("nan")) == words


def test_a_uniform_part_is_shifted(monkeypatch):
    """Of the sum of two equal ones 2 % are beyond 2 - sqrt(8 * 0.01) tolerances."""
    monkeypatch.setattr(searches, "MOST_PROVED", 1)  # longer runs find the rest
    cost = {"law": "reciprocal", "at": "+-0.1 mm", "price": 10}
    one = {"nominal": "10 mm", "distribution": "uniform", "tolerance": "+-0.1 mm"}
    given = {
        "model": "dimension_chain", "seed": 3, "trials": 1000,
        "settings": {"gap": "A + B"},
        "links": {
            "A": {**one, "cost": cost},
            "B": {**one, "cost": {**cost, "shift": "0..0.5 mm"}},
        },
        "limits": {"gap": {"limit": "20.2..20.4 mm", "yield": "98 %"}},
    }  # fmt: skip
    found = tolstat.allocate(given)
    least = 2 * 10 * 0.1 * (2 - math.sqrt(0.08)) / 0.1
    assert found.met and least < found.cost < 1.02 * least
    assert tomllib.loads(found.study)["links"]["B"]["nominal_shift"] == "0.3 mm"


@pytest.mark.parametrize("price", [200.0, 1000.0])
def test_a_shift_is_worth_its_price_in_part_or_not(price):
    """Prices are of 1 mm: at 200 a shift by 0.044 mm of 0.1 mm pays, at 1000 none."""
    given = off_centre(0.1, shift="0..0.4 mm", shift_price=0.4 * price)
    found = tolstat.allocate(given, model=Linear())
    best = minimize_scalar(
        lambda by: cost_off_centre((0.1 - by) * 1e-3) + price * by, (0, 0.1),
        bounds=(0, 0.1), method="bounded",
    )  # fmt: skip
    assert found.met and best.fun < found.cost < 1.02 * best.fun
    shift = float(found.proof.tolerances["shift of link_1"].removesuffix(" mm"))
    assert shift == pytest.approx(best.x, abs=0.01)
    assert (shift > 0.03) == (price < 300)


def test_a_shift_alone_is_chosen_and_beside_a_list(monkeypatch):
    monkeypatch.setattr(searches, "MOST_PROVED", 1)  # the first proof has the cost
    given = off_centre(0.2)
    given["deviations"] = dict.fromkeys(PRICES, "+-0.05 mm")
    given["deviations"]["link_2"] = {"tolerance": "+-0.05 mm"}
    given["deviations"]["link_2"]["cost"] = {"shift": "+-0.3 mm"}
    found = tolstat.allocate(given, model=Linear())
    assert found.met and found.cost == 0
    shift = float(found.proof.tolerances["shift of link_2"].removesuffix(" mm"))
    assert shift == pytest.approx(-0.1, abs=0.01)  # to the middle
    beside = listed()
    beside["limits"] = given["limits"]
    coarser = dict([*OFFERED.items()][:2])  # six combinations, not 27
    beside["deviations"]["link_1"]["cost"] = coarser
    beside["deviations"]["link_2"]["cost"] = {**OFFERED, "shift": "-0.3..0 mm"}
    beside["deviations"]["link_3"] = "+-0.2 mm"
    found = tolstat.allocate(beside, trials=2500, model=Linear())
    assert found.met and found.cost == 6  # as of the centred ones


def lead(found):
    return as_text(found.document().blocks[0].parts).replace("\N{NO-BREAK SPACE}", " ")


def test_a_shift_that_is_too_small_is_at_its_end_and_said():
    given = off_centre(0.2, shift="+-0.005 mm")
    found = tolstat.allocate(given, trials=2500, model=Linear())
    assert not found.met
    assert found.proof.tolerances["shift of link_1"] == "0.005 mm"
    assert "Permit a shift of link_1 by about 0.2" in lead(found)
    assert '`shift = "+-0.' in lead(found)


@pytest.mark.parametrize(
    ("limit", "words", "permit"),
    [
        ("<= -0.4 mm", "outside the limit; no permitted", "link_2 by about 0.23"),
        ("0.01..0.41 mm", "outside the limit", "link_2 by about -0.1"),
        ("<= 0.01 mm", "inside, but too near an end of", "link_2 by about 0.02"),
        ("-0.01..0.01 mm", "", ""),  # the spread is too wide
    ],
)  # fmt: skip
def test_a_mean_off_its_limit_is_the_cause(limit, words, permit):
    given = reciprocal()
    given["limits"]["gap"]["limit"] = limit
    found = tolstat.allocate(given, trials=2500, model=Linear())
    assert not found.met and words in lead(found) and permit in lead(found)
    assert ("Permit a shift" in lead(found)) == bool(permit)
    assert ("Widen a limit" in lead(found)) != bool(permit)


def test_the_pool_covers_the_permitted_shifts():
    given = off_centre(0.2, shift="+-0.4 mm")
    study = load(given, model=Linear())
    assert len(study.deviating.priced) == 4
    pool = pool_of(study, 20_000)  # its loosest parts lie all over, others at 0
    for shift in (0.0, 0.1e-3, 0.3e-3):
        T = np.array([0.2e-3, 0.1e-3, 0.2e-3])
        choice = (math.log(T[0]), shift, math.log(T[1]), math.log(T[2]))
        sigma = math.sqrt(np.sum((SLOPES * T / 3) ** 2))
        truth = ndtr(-shift / sigma) + ndtr((shift - 2 * LIMIT) / sigma)
        assert pool.upper_ends(choice, 0.5)[0] == pytest.approx(truth, rel=0.15)
    # far from all that is sampled without a shift: all are out of limit
    pool = pool_of(load(off_centre(0.2, shift="+-3 mm"), model=Linear()), 20_000)
    assert 0.75 < pool.upper_ends((choice[0], 2.5e-3, *choice[2:]), 0.5)[0] < 1.6


def test_the_search_begins_at_the_shift_of_linear_analysis():
    study = load(off_centre(0.2, shift="+-0.4 mm"), model=Linear())
    with Workers(1) as crew:
        search = Search(FreshRuns(study, crew, 500, lambda progress: None))
        assert search.tightest[1] == 0
        linear_choices(search)
    assert search.tightest[1] == pytest.approx(0.2e-3, abs=8e-6)


def test_a_shifted_nominal_moves_all_parts_and_its_tolerance():
    given = {"model": "linear", "trials": 50, "seed": 1, "limits": {"gap": "0..1 mm"}}
    entry = {"tolerance": "0..0.2 mm", "distribution": "uniform"}
    other = {**entry, "nominal_shift": "-0.3 mm", "cost": {"IT9": 1, "0..0.2 mm": 1}}
    before = load({**given, "deviations": {"link_1": entry}}, model=Linear())
    with pytest.raises(StudyError, match="IT9"):
        load({**given, "deviations": {"link_1": other}}, model=Linear())
    del other["cost"]["IT9"]
    after = load({**given, "deviations": {"link_1": other}}, model=Linear())
    moved = after.deviations() - before.deviations()
    assert moved[:, 0] == pytest.approx(-0.3e-3, rel=1e-12)
    own = after.deviating.distributions["link_1"]
    assert spread_of(own)[:2] == pytest.approx((-0.3e-3, -0.1e-3))
    # an amplitude narrows to its zero, which the nominal shift moves; any other zone
    # about its middle: a zone that stood still at an end would move the mean
    for sized, zone in ((False, (-0.3e-3, -0.2e-3)), (True, (-0.25e-3, -0.15e-3))):
        half = resized(own, 0.05e-3, sized=sized).tolerance
        assert half == pytest.approx(zone)
        median = halved(own, sized=sized).deviations(np.array([0.5]))
        assert median == pytest.approx(sum(zone) / 2)
    law = {"law": "reciprocal", "at": "+-0.1 mm", "price": 1}
    costly = {**given, "deviations": {"link_1": {**other, "cost": law}}}
    (priced,) = load(costly, model=Linear()).deviating.priced
    assert priced.text(math.log(0.05e-3)) == "0..0.1 mm"  # beside the shift
    with pytest.raises(StudyError, match="nominal_shift moves a tolerance"):
        constant = {
            "distribution": "constant",
            "value": "1 mm",
            "nominal_shift": "1 mm",
        }
        load({**given, "deviations": {"link_1": constant}}, model=Linear())


def test_the_proof_is_what_a_run_of_the_file_shows(tmp_path, monkeypatch):
    monkeypatch.setattr(searches, "MOST_PROVED", 1)  # any proof will do
    monkeypatch.setattr(searches, "MOST_STRETCHED", 0)
    given = off_centre(0.2, shift="+-0.4 mm") | {"sampling": "sobol"}
    found = tolstat.allocate(given, model=Linear())
    path = tmp_path / "shifted.toml"
    path.write_text(found.study_file())
    study = load(path, model=Linear())
    gap = simulate(Linear(), study.deviations(), study.settings).responses[:, 0]
    share = found.proof.fraction_out_of_limit["gap"].value
    assert np.mean((gap < 0) | (gap > 0.4e-3)) == pytest.approx(share, rel=1e-12)
    report = tolstat.report(tolstat.run(path, model=Linear(), workers=1))
    judged = report.responses["gap"].limited.yields
    assert judged.verdict == found.verdicts["gap"]
    assert judged.fraction_out_of_limit == found.proof.fraction_out_of_limit["gap"]
