"""Tolerances allocated: against closed forms, and against what a fresh run shows."""

from __future__ import annotations

import itertools
import math
import re
import tomllib

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

import tolstat
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.deviations.dependence import Batch, Dependence
from tolstat.deviations.weighting import correlations
from tolstat.errors import StudyError
from tolstat.execution import beside
from tolstat.execution.elsewhere import crew_of
from tolstat.execution.linear_schemes import LinearSchemes
from tolstat.execution.pool import Pool, with_choice
from tolstat.execution.trials import Trials
from tolstat.model.checked import simulate
from tolstat.study.study import load

SLOPES = np.array([1.0, -2.0, 0.5])


class Linear(Model):
    """A linear stack: what it should cost is a closed form."""

    name = "linear"
    title = "linear stack"

    def describe(self, settings):
        links = (Contributor(f"link_{i}", "m", f"l{i}", "a link") for i in (1, 2, 3))
        return Description(tuple(links), (Response("gap", "m", "g", "the gap"),))

    def evaluate(self, deviations, settings):
        return Outcome((deviations * SLOPES).sum(axis=1)[:, None])


PRICES = {"link_1": 5.0, "link_2": 20.0, "link_3": 2.0}
DRAWN = {"link_1": "+-0.05 mm", "link_2": "+-0.12 mm", "link_3": "+-0.1 mm"}
LIMIT = 0.2e-3  # m, to either side


def reciprocal(**changed):
    study = {"model": "linear", "trials": 1000, "seed": 3}
    study["deviations"] = {
        name: {
            "tolerance": DRAWN[name],
            "cost": {
                "law": "reciprocal", "at": "+-0.1 mm", "price": price,
                "tightest": "+-0.03 mm", "loosest": "+-0.4 mm",
            },
        }
        for name, price in PRICES.items()
    }  # fmt: skip
    study["limits"] = {"gap": {"limit": "-0.2..0.2 mm", "yield": "98 %"}}
    return {**study, **changed}


def closed_form():
    """Lagrange: T_i proportional to (c_i / a_i^2)^(1/3); cost and half widths, m."""
    c = np.array([*PRICES.values()]) * 0.1e-3
    T = (c / SLOPES**2) ** (1 / 3)
    sigma = math.sqrt(np.sum((SLOPES * T / 3) ** 2))
    T *= LIMIT / float(ndtri(0.99)) / sigma
    return float(np.sum(c / T)), T


def test_a_linear_stack_costs_what_lagrange_says(monkeypatch):
    monkeypatch.setattr(beside, "CURVE", np.array([0.5, 2.0]))  # less to be searched
    found = tolstat.allocate(reciprocal(), trials=30_000, model=Linear())
    cost, halves = closed_form()
    assert found.met and cost < found.cost < 1.02 * cost
    assert np.allclose([*found.tolerances.values()], halves, rtol=0.1)
    assert found.active == ("gap",) and found.verdicts == {"gap": "met"}
    # root sum square is the closed form itself, but for three digits
    digits = np.floor(halves * 1e6) / 1e6
    rounded = float(np.sum(0.1e-3 * np.array([*PRICES.values()]) / digits))
    assert found.schemes["root sum square"].cost == pytest.approx(rounded, rel=1e-9)
    # the proof is what a run of the file shows
    proof = found.schemes["found"]
    written, asked = tomllib.loads(found.text), {"trials": proof.trials}
    again = load(written, model=Linear(), seed=proof.seed, **asked)
    drawn = again.deviations()
    gap = simulate(Linear(), drawn, again.settings).responses[:, 0]
    assert np.mean(np.abs(gap) > LIMIT) == pytest.approx(proof.beyond["gap"].value)
    # more for the same money than as drawn
    drawn_share = found.schemes["as drawn"].beyond_any.value
    equal = found.schemes["at the cost drawn"]
    assert equal.cost <= found.schemes["as drawn"].cost
    assert equal.beyond_any.value < 0.8 * drawn_share


ARCSINE = {
    "tolerance": "+-0.1 mm",
    "distribution": "arcsine",
    "cost": {"+-0.1 mm": 1},
}
GRID = {"link_1": ["0 mm"]}
OFFERED = {"+-0.2 mm": 1, "+-0.1 mm": 3, "+-0.05 mm": 9}


def listed(least_cost="98 %"):
    study = reciprocal()
    for line in study["deviations"].values():
        line["tolerance"], line["cost"] = "+-0.1 mm", OFFERED
    study["limits"]["gap"]["yield"] = least_cost
    return study


def test_only_what_is_offered_is_chosen_and_the_cheapest_of_it():
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
    drawn, equal = found.schemes["as drawn"], found.schemes["at the cost drawn"]
    assert equal.cost <= drawn.cost
    assert equal.beyond_any.value <= drawn.beyond_any.value
    assert all(line.found in OFFERED for line in found.lines)


def test_where_nothing_meets_the_limit_that_is_said_with_the_best_there_is():
    found = tolstat.allocate(
        listed("99.99 %") | {"limits": {"gap": "-0.05..0.05 mm"}},
        trials=1000, model=Linear(),
    )  # fmt: skip
    assert not found.met and found.verdicts == {"gap": "not met"}
    assert [line.found for line in found.lines] == ["+-0.05 mm"] * 3
    sigma = math.hypot(*(SLOPES * 0.05e-3 / 3))
    beyond = found.schemes["tightest"].beyond["gap"]
    assert beyond.lower < 2 * ndtr(-0.05e-3 / sigma) < beyond.upper


def test_what_weights_cannot_show_a_run_may():
    """Nothing beyond in a short wide run, and no interval narrow enough."""
    given = listed() | {"limits": {"gap": {"limit": "-1..1 mm", "yield": "98 %"}}}
    found = tolstat.allocate(given, trials=120, model=Linear())
    assert found.met and found.cost < 3 * OFFERED["+-0.05 mm"]


def correlated_by(parts, share):
    """Correlated by this much, as a matrix."""
    R = np.eye(3)
    R[np.ix_(parts, parts)] += share * (1 - np.eye(len(parts)))
    return R


@pytest.mark.parametrize(
    ("change", "correlation"),
    [
        ({}, np.eye(3)),
        ({"correlation": {"link_1": {"link_3": 0.6}}},
         correlated_by([0, 2], 2 * math.sin(math.pi * 0.6 / 6))),
    ],
)  # fmt: skip
def test_linear_schemes_are_closed_forms(change, correlation):
    study, T = load(reciprocal(**change), model=Linear()), np.array([1, 2, 3]) * 4e-5
    with crew_of(1, None) as crew:
        linear = LinearSchemes(study, crew)
    own = SLOPES * T / 3
    share = 2 * float(ndtr(-LIMIT / math.sqrt(own @ correlation @ own)))
    assert linear.root_sum_square(tuple(np.log(T))) == pytest.approx(
        math.log(share / 0.02), rel=1e-9
    )
    worst = np.abs(SLOPES) @ T / LIMIT - 1
    assert linear.worst_case(tuple(np.log(T))) == pytest.approx([worst, worst])


def test_linear_schemes_know_what_is_always_so_and_what_lies_to_one_side():
    given = reciprocal()
    given["deviations"]["link_2"] = {"distribution": "constant", "value": "0.05 mm"}
    one_sided = given["deviations"]["link_3"]
    one_sided["tolerance"], one_sided["distribution"] = "0..0.2 mm", "uniform"
    T1, T3 = 0.04e-3, 0.06e-3
    with crew_of(1, None) as crew:
        linear = LinearSchemes(load(given, model=Linear()), crew)
    choice = (math.log(T1), math.log(T3))
    centre = -2 * 0.05e-3  # of the constant part
    least, most = centre - T1, centre + T1 + 0.5 * 2 * T3
    assert linear.worst_case(choice) == pytest.approx(
        [
            (centre - least) / (LIMIT + centre) - 1,
            (most - centre) / (LIMIT - centre) - 1,
        ]
    )
    mean, sigma = centre + 0.5 * T3, math.hypot(T1 / 3, 0.5 * T3 / math.sqrt(3))
    share = ndtr((-LIMIT - mean) / sigma) + ndtr((mean - LIMIT) / sigma)
    assert linear.root_sum_square(choice) == pytest.approx(math.log(share / 0.02))


def test_slopes_are_of_the_machine_with_its_constant_parts():
    class Lever(Linear):
        def evaluate(self, deviations, settings):
            return Outcome((deviations[:, :1] * deviations[:, 1:2]) / 1e-3)

    given = reciprocal()
    given["deviations"]["link_2"] = {"distribution": "constant", "value": "0.5 mm"}
    with crew_of(1, None) as crew:
        linear = LinearSchemes(load(given, model=Lever()), crew)
    assert linear.slopes["gap"]["link_1"] == pytest.approx(0.5)


def test_parts_of_a_batch_are_correlated_by_its_share():
    names = ["part_1", "part_2", "part_3", "still"]
    for share in (0.4, 1.0):
        batch = Batch("part", share)
        dependence = Dependence({name: batch for name in names[:3:2]})
        expected = np.eye(4)
        expected[:3, :3] = correlated_by([0, 2], share)
        assert np.allclose(correlations(names, dependence), expected)


def pool_of(study, trials):
    """Machines with the loosest tolerances, and with those halfway and tightest."""
    pool = Pool(study)
    for seed, share in enumerate((1.0, 0.5, 0.0)):
        priced = study.deviating.priced
        choice = tuple(e.ends[0] + share * (e.ends[1] - e.ends[0]) for e in priced)
        drawn = with_choice(study, choice, seed, trials)
        run = Trials.planned(study.description, drawn.deviations())
        run.take([(0, simulate(study.model, run.deviations, study.settings))])
        pool.add(choice, run)
    return pool


@pytest.mark.parametrize("correlated", [False, True])
def test_a_pool_is_as_good_as_a_run_of_any_tolerances(correlated):
    given = reciprocal()
    rank = 0.6 if correlated else 0.0
    if correlated:
        given["correlation"] = {"link_1": {"link_2": rank}}
    study = load(given, model=Linear())
    pool = pool_of(study, 20_000)
    choice = tuple(math.log(half) for half in (0.15e-3, 0.06e-3, 0.3e-3))
    sigma = SLOPES * np.exp(choice) / 3
    r = 2 * math.sin(math.pi * rank / 6)
    spread = math.sqrt(np.sum(sigma**2) + 2 * r * sigma[0] * sigma[1])
    truth = 2 * float(ndtr(-LIMIT / spread))
    assert pool.about(choice) == pytest.approx(truth, rel=0.15)
    assert truth < pool.most(choice)[0] < (1.6 if correlated else 1.3) * truth


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"limits": {}}, "no [limits]"),
        ({"deviations": {"link": "+-0.1 mm"}}, "says what it costs"),
        ({"deviations": {"link": ARCSINE}}, "link has a cost, and cannot be weighted"),
        ({"limits": {"gap": {"limit": "<= 1 mm", "ppm": 1e-3}}}, "trials"),
        ({"sampling": "grid", "grid": GRID, "deviations": {}}, "draws nothing"),
    ],
)  # fmt: skip
def test_what_has_nothing_to_be_allocated_is_refused(change, words):
    given = {k: v for k, v in (reciprocal() | change).items() if v or k != "deviations"}
    if "grid" in given:
        given = {k: v for k, v in given.items() if k not in ("trials", "seed")}
    with pytest.raises(StudyError, match=re.escape(words)):
        tolstat.allocate(given, model=Linear())
