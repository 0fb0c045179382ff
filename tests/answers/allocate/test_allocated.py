"""Allocated tolerances against closed forms and requests."""

from __future__ import annotations

import itertools
import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

import tolstat
from tests.answers.allocate.linear_stack import (
    LIMIT,
    OFFERED,
    PRICES,
    SLOPES,
    Linear,
    Two,
    closed_form,
    listed,
    reciprocal,
)
from tolstat.answers.allocate import allocate_tolerances as allocating
from tolstat.answers.allocate import search as searches
from tolstat.answers.allocate.search import Search
from tolstat.model.checked import simulate
from tolstat.render.screen import as_text
from tolstat.study.study import load


def test_linear_stack_has_the_cost_of_lagranges_solution(monkeypatch):
    monkeypatch.setattr(searches, "CURVE", np.array([0.5, 2.0]))  # less to be searched
    found = tolstat.allocate(reciprocal(), model=Linear())
    cost, halves = closed_form()
    assert found.met and cost < found.cost < 1.02 * cost
    assert np.allclose([*found.half_widths.values()], halves, rtol=0.1)
    assert found.active_limits == ("gap",) and found.verdicts == {"gap": "met"}
    # root sum square is the closed form itself, but for three digits
    digits = np.floor(halves * 1e6) / 1e6
    rounded = float(np.sum(0.1e-3 * np.array([*PRICES.values()]) / digits))
    assert found.schemes["root_sum_square"].cost == pytest.approx(rounded, rel=1e-9)
    # a model that integrates has errors that nothing here audits
    for integrates in (False, True):
        said = str(replace(found, integrates=integrates).document())
        assert ("Integration errors are not audited" in said) is integrates
    # the proof is what a run of the file shows
    proof = found.proof
    again = load(tomllib.loads(found.study_file()), model=Linear())
    assert (again.trials, again.seed) == (proof.trials, proof.seed)
    drawn = again.deviations()
    gap = simulate(Linear(), drawn, again.settings).responses[:, 0]
    assert np.mean(np.abs(gap) > LIMIT) == pytest.approx(
        proof.fraction_out_of_limit["gap"].value
    )
    # of a run by which nothing was chosen; the one that was met stands beside
    seeds = {each.seed for each in found.schemes.values()}
    assert len(seeds) == 1 and proof.seed not in seeds
    assert found.proof.fraction_out_of_limit["gap"].upper < 0.02
    # more for the same money than as drawn
    drawn_share = found.schemes["drawing"].fraction_out_of_any_limit.value
    equal = found.schemes["equal_cost"]
    assert equal.cost <= found.schemes["drawing"].cost
    assert equal.fraction_out_of_any_limit.value < 0.8 * drawn_share


def test_the_cheapest_offered_tolerance_is_chosen():
    found = tolstat.allocate(listed(), trials=4000, model=Linear())
    # normal: which combinations meet the limit, and the cheapest of these
    widths = {words: float(words[2:5].rstrip(" ")) * 1e-3 for words in OFFERED}
    allowed = LIMIT / float(ndtri(0.99))
    best = min(
        sum(OFFERED[w] for w in words)
        for words in itertools.product(OFFERED, repeat=3)
        if math.hypot(*(SLOPES * [widths[w] / 3 for w in words])) < allowed
    )
    assert found.met and found.cost == best
    drawn, equal = found.schemes["drawing"], found.schemes["equal_cost"]
    assert equal.cost <= drawn.cost
    assert (
        equal.fraction_out_of_any_limit.value <= drawn.fraction_out_of_any_limit.value
    )
    assert all(entry.found in OFFERED for entry in found.entries)


def test_an_infeasible_limit_is_reported_with_the_best_choice():
    found = tolstat.allocate(
        listed("99.99 %") | {"limits": {"gap": "-0.05..0.05 mm"}},
        trials=1000, model=Linear(),
    )  # fmt: skip
    assert not found.met and found.verdicts == {"gap": "not met"}
    assert [entry.found for entry in found.entries] == ["+-0.05 mm"] * 3
    sigma = math.hypot(*(SLOPES * 0.05e-3 / 3))
    beyond = found.schemes["tightest"].fraction_out_of_limit["gap"]
    assert beyond.lower < 2 * ndtr(-0.05e-3 / sigma) < beyond.upper


def test_a_fresh_run_may_prove_a_limit_that_weights_do_not():
    """Nothing out of limit in a short wide run, and no interval narrow enough."""
    given = listed() | {"limits": {"gap": {"limit": "-1..1 mm", "yield": "98 %"}}}
    found = tolstat.allocate(given, trials=120, model=Linear())
    assert found.met and found.cost < 3 * OFFERED["+-0.05 mm"]


@pytest.mark.parametrize("sampling", ["rare", "sobol"])
def test_allocation_uses_random_trials_for_any_sampling(sampling):
    given = {"sampling": sampling, "trials": 8192}
    only = {"link_1": listed()["deviations"]["link_1"]}
    given["deviations"] = only | {"link_2": "+-0.08 mm", "link_3": "+-0.1 mm"}
    found = tolstat.allocate(listed() | given, trials=2000, model=Linear())
    random = tolstat.allocate(
        listed() | given | {"sampling": "random"}, trials=2000, model=Linear()
    )
    assert found.met and found.cost == random.cost
    assert found.schemes == random.schemes
    assert (
        "tolstat run" not in random.study_file() + found.study_file()
    )  # neither is in a file


def test_a_response_may_be_named_any_and_active_limits_are_named():
    given = listed()
    given["limits"]["any"] = {"limit": "-0.9..0.9 mm", "yield": "98 %"}
    found = tolstat.allocate(given, model=Two())
    scheme = found.schemes["found"]
    assert found.met and [*scheme.fraction_out_of_limit] == ["gap", "any"]
    assert found.active_limits == ("gap",)
    # what is out of a limit is out of that of the gap
    assert (
        scheme.fraction_out_of_limit["any"].value
        == 0
        < scheme.fraction_out_of_any_limit.value
    )
    assert scheme.fraction_out_of_any_limit.value == pytest.approx(
        scheme.fraction_out_of_limit["gap"].value
    )
    # the other way round: only the first one matters
    given["limits"]["gap"]["limit"] = "-9..9 mm"
    given["limits"]["any"]["limit"] = "-0.1..0.1 mm"
    found = tolstat.allocate(given, model=Two())
    assert found.met and found.active_limits == ("any",)
    assert [entry.at_loosest for entry in found.entries] == [False, True, True]
    # said below the tolerance: a column of its own would stand alone on a narrow screen
    tolerances = found.document().blocks[1]
    assert all(column.head for column in tolerances.columns)
    below = [as_text(cell.below) for cell in tolerances.rows[1]]
    assert below[4] == "at its loosest" and not any(below[:4])
    assert found.wide_trials == 2500 <= min(found.fresh_trials)


def uniform():
    """Two uniform links to one side of zero, whose machines weigh all or nothing."""
    cost = {"law": "reciprocal", "at": "+-0.1 mm", "price": 10}
    shape = {"nominal": "10 mm", "distribution": "uniform", "cost": cost}
    return {
        "model": "dimension_chain", "seed": 5, "trials": 1000,
        "settings": {"gap": "A + B"},
        "links": {
            "A": {**shape, "tolerance": "0.05..0.25 mm"},
            "B": {**shape, "tolerance": "-0.2..-0.05 mm"},
        },
        "limits": {"gap": {"limit": "19.9..20.1 mm", "yield": "98 %"}},
    }  # fmt: skip


def test_tolerances_are_scaled_together_if_weights_are_not_enough(monkeypatch):
    """The optimum about the same middles, where a search stays: 42.67.

    Both of half 0.075 / 1.6 mm: a corner of (2 h - 0.075)^2 / 8 h^2 is 2 %.
    """
    monkeypatch.setattr(searches, "CURVE", np.array([]))  # less to be searched
    monkeypatch.setattr(searches, "BISECTIONS", 1)
    found = tolstat.allocate(uniform())
    assert found.met and 42.66 < found.cost < 1.02 * 42.66
    rows = [found.schemes[name] for name in ("root_sum_square", "worst_case")]
    assert found.cost <= min(each.cost for each in rows)


def test_five_uniform_links_have_the_cost_of_the_closed_form_tail(monkeypatch):
    """Of five from -1 to 1 the sum is above 5 - 2 x with a chance of x^5 / 120.

    By weights alone, all or nothing, 8 % above the optimum; scaled with weights that a
    table has, whose steps are coarse where tolerances may differ sixtyfold, 5 %.
    """
    monkeypatch.setattr(searches, "CURVE", np.array([]))  # less to be searched
    monkeypatch.setattr(searches, "BISECTIONS", 1)
    given = uniform()
    link = given["links"]["A"] | {"tolerance": "+-0.1 mm"}
    link["cost"] = link["cost"] | {"tightest": "+-0.01 mm", "loosest": "+-0.6 mm"}
    given["links"] = dict.fromkeys("ABCDE", link)
    given["settings"]["gap"] = "A + B + C + D + E"
    given["limits"]["gap"]["limit"] = "49.75..50.25 mm"
    found = tolstat.allocate(given)
    T = 0.25 / (5 - 2 * (120 * 0.01) ** 0.2)
    least = 5 * 10 * 0.1 / T
    assert found.met and least < found.cost < 1.02 * least
    assert max(found.fresh_trials) <= 640_000


def test_the_tightest_choice_is_returned_if_only_it_is_proved(monkeypatch):
    monkeypatch.setattr(Search, "proved", lambda search: None)
    monkeypatch.setattr(allocating, "linear_choices", lambda search: ({}, {}))
    given = reciprocal()
    given["limits"]["gap"]["limit"] = "-1..1 mm"
    found = tolstat.allocate(given, trials=2000, model=Linear())
    assert found.met and found.verdicts == {"gap": "met"}
    assert "All limits are met" in found.study_file()
