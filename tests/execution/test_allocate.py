"""Tolerances allocated: against closed forms, and against what a fresh run shows."""

from __future__ import annotations

import gc
import itertools
import math
import re
import tomllib
import tracemalloc

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri
from scipy.stats import binom, chi2, multivariate_normal, norm

import tolstat
from tests.reporting.test_pictures import nothing_overlaps
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.answers.allocate import allocate_tolerances as allocating
from tolstat.answers.allocate import trade_off as beside
from tolstat.answers.allocate.active_limits import active, lines_of
from tolstat.answers.allocate.allocation import Point, Scheme, trade_off
from tolstat.answers.allocate.fresh_runs import GROWTH, FreshRuns
from tolstat.answers.allocate.linear_schemes import LinearSchemes
from tolstat.answers.allocate.reweighted_pool import Pool, beyond_each, with_choice
from tolstat.answers.allocate.search import Searching, _aimed
from tolstat.answers.allocate.trade_off import for_the_cost_drawn
from tolstat.deviations.density_ratio import correlations
from tolstat.deviations.dependence import Batch, Dependence
from tolstat.errors import StudyError
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Workers
from tolstat.model.checked import simulate
from tolstat.model.view import Mark
from tolstat.render.view_picture import draw_view
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.anytime_valid import anytime_valid
from tolstat.study import memory_needed as size
from tolstat.study.cost_entry import tolerance_words
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
    found = tolstat.allocate(reciprocal(), model=Linear())
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
    # of a run by which nothing was chosen; the one that was met stands beside
    seeds = {each.seed for each in found.schemes.values()}
    assert len(seeds) == 1 and found.proof.seed not in seeds
    assert found.proof.beyond["gap"].upper < 0.02 and found.again
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


def test_the_strictest_limit_says_how_many_machines(monkeypatch):
    monkeypatch.setattr(allocating, "_around", lambda search, *_: search.runs.trials)
    given = reciprocal(trials=10)
    given["limits"]["any"] = {"limit": "-9..9 mm", "yield": "99.5 %"}
    assert tolstat.allocate(given, model=Two()) == 50 / 0.005


def test_what_weights_cannot_show_a_run_may():
    """Nothing beyond in a short wide run, and no interval narrow enough."""
    given = listed() | {"limits": {"gap": {"limit": "-1..1 mm", "yield": "98 %"}}}
    found = tolstat.allocate(given, trials=120, model=Linear())
    assert found.met and found.cost < 3 * OFFERED["+-0.05 mm"]


@pytest.mark.parametrize("sampling", ["rare", "sobol"])
def test_machines_are_random_whatever_the_study_draws(sampling):
    given = {"sampling": sampling, "trials": 8192}
    only = {"link_1": listed()["deviations"]["link_1"]}
    given["deviations"] = only | {"link_2": "+-0.08 mm", "link_3": "+-0.1 mm"}
    found = tolstat.allocate(listed() | given, trials=2000, model=Linear())
    random = tolstat.allocate(
        listed() | given | {"sampling": "random"}, trials=2000, model=Linear()
    )
    assert found.met and found.cost == random.cost
    assert found.schemes == random.schemes
    assert random.again and not found.again
    assert "tolstat run" not in random.text + found.text  # neither is in a file


def test_that_nothing_is_better_for_the_cost_drawn_is_said():
    given = listed()
    del given["deviations"]["link_2"], given["deviations"]["link_3"]
    found = tolstat.allocate(given, model=Linear())
    drawn, equal = found.schemes["as drawn"], found.schemes["at the cost drawn"]
    assert equal == drawn and any("the cost as drawn" in note for note in found.notes)


@pytest.fixture
def shares_known(monkeypatch):
    """The share beyond is a closed form, and not what a pool says."""

    def known(choice):
        sigma = np.linalg.norm(SLOPES * np.exp(choice) / 3)
        return np.full(2, 2 * float(ndtr(-LIMIT / sigma)))

    monkeypatch.setattr(Pool, "most", lambda pool, choice, *_, **__: known(choice))
    return known


def test_for_the_cost_drawn_nearly_all_of_it_is_spent(shares_known):
    search = searching(reciprocal(), trials=100)
    spent = for_the_cost_drawn(search, [])
    drawn = search.runs.cost(search.drawn)
    assert 0.98 * drawn < search.runs.cost(spent) <= drawn
    # Lagrange, of that cost
    _, T = closed_form()
    c = np.array([*PRICES.values()]) * 0.1e-3
    assert np.exp(spent) == pytest.approx(T * np.sum(c / T) / drawn, rel=0.06)


def test_for_the_cost_drawn_it_is_sought_between_its_neighbours(
    shares_known, monkeypatch
):
    """Of the dearer points of the curve from the nearest one on: five halvings."""
    search = searching(reciprocal(), trials=100)
    drawn = search.runs.cost(search.drawn)
    cost, T = closed_form()
    points = []
    for own in (0.9 * drawn, 0.95 * drawn, 1.05 * drawn, 3.0 * drawn):
        choice = tuple(np.log(T * cost / own))
        points.append(Point(own, float(shares_known(choice)[0]), choice))
    spent = for_the_cost_drawn(search, points)
    # three digits of a tolerance are half a hundredth at most
    assert 0.99 * drawn < search.runs.cost(spent) <= drawn
    # where weights show no way it is the best of the curve that costs no more
    monkeypatch.setattr(Searching, "cheapest_for", lambda *asked: None)
    best = for_the_cost_drawn(search, points)
    assert best == search.runs.as_written(points[1].choice)
    worse = [points[0]._replace(beyond=0.5)]
    assert for_the_cost_drawn(search, worse) == search.drawn


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
    with Workers(1) as crew:
        linear = LinearSchemes(study, crew)
    own = SLOPES * T / 3
    share = 2 * float(ndtr(-LIMIT / math.sqrt(own @ correlation @ own)))
    assert linear.root_sum_square(tuple(np.log(T))) == pytest.approx(
        math.log(share / 0.02), rel=1e-9
    )
    worst = np.abs(SLOPES) @ T / LIMIT - 1
    assert linear.worst_case(tuple(np.log(T))) == pytest.approx([worst, worst])


@pytest.mark.parametrize("nearest", [0.0, 0.1])
def test_a_machine_off_its_limit_as_drawn_has_no_worst_case(nearest):
    """At an end nothing may scatter at all, and beyond it nothing helps."""
    limits = {"gap": f"{nearest}..0.9 mm", "any": f"-0.9..{-nearest} mm"}
    T = np.array([1, 2, 3]) * 4e-5
    with Workers(1) as crew:
        study = load(reciprocal(limits=limits), model=Two())
        found = LinearSchemes(study, crew).worst_case(tuple(np.log(T)))
    gap = np.abs(SLOPES) @ T / 0.9e-3 - 1
    assert found == pytest.approx([np.inf, gap, T[0] / 0.9e-3 - 1, np.inf])


def test_linear_schemes_know_what_is_always_so_and_what_lies_to_one_side():
    given = reciprocal()
    given["deviations"]["link_2"] = {"distribution": "constant", "value": "0.05 mm"}
    one_sided = given["deviations"]["link_3"]
    one_sided["tolerance"], one_sided["distribution"] = "0..0.2 mm", "uniform"
    T1, T3 = 0.04e-3, 0.06e-3
    with Workers(1) as crew:
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
    with Workers(1) as crew:
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
        run = drawn_with(study, choice, seed, trials)
        pool.add(choice, seed, beyond_each(study.limits, run))
    return pool


def drawn_with(study, choice, seed, trials):
    drawn = with_choice(study, choice, seed, trials)
    run = Trials.planned(study.description, drawn.deviations())
    run.take([(0, simulate(study.model, run.deviations, study.settings))])
    return run


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
    assert pool.most(choice, 0.5)[0] == pytest.approx(truth, rel=0.2)
    assert truth < pool.most(choice)[0] < (1.6 if correlated else 1.3) * truth


def test_without_weights_the_upper_end_is_that_of_a_count():
    study = load(reciprocal(), model=Linear())
    choice = tuple(each.as_drawn for each in study.deviating.priced)
    run, pool = drawn_with(study, choice, 7, 3000), Pool(study)
    pool.add(choice, 7, beyond_each(study.limits, run))
    count = int(np.sum(np.abs(run.response("gap")) > LIMIT))
    for miss in (0.025, 0.5):
        upper = chi2.ppf(1 - miss, 2 * (count + 1)) / 2 / 3000  # of Poisson's law
        assert pool.most(choice, miss) == pytest.approx([upper, upper])


def test_where_none_is_beyond_the_next_may_be_one_of_the_usual_weight():
    """Of those beyond no limit one in 29 is kept, and counts 29 times."""
    given = reciprocal(limits={"gap": "-9..9 mm", "any": "-0.1..0.1 mm"})
    study = load(given, model=Two())
    loosest = tuple(each.ends[1] for each in study.deviating.priced)
    run, pool = drawn_with(study, loosest, 7, 30_000), Pool(study)
    pool.add(loosest, 7, beyond_each(study.limits, run))
    T = np.array([0.3e-3, 0.2e-3, 0.35e-3])
    old = norm.pdf(run.deviations, scale=0.4e-3 / 3)
    weights = (norm.pdf(run.deviations, scale=T / 3) / old).prod(axis=1) / 30_000
    usual = np.sum(weights**2) / np.sum(weights)
    none = -math.log(0.025) * usual
    assert pool.most(tuple(np.log(T)))[0] == pytest.approx(none, rel=0.03)


def test_what_is_apart_is_what_closed_forms_say():
    study = load(reciprocal(), model=Linear())
    pool = pool_of(study, 20_000)
    sets = np.array([[0.15, 0.06, 0.3], [0.1, 0.06, 0.3]]) * 1e-3
    share, other = 2 * ndtr(-LIMIT / np.linalg.norm(SLOPES * sets / 3, axis=1))
    more, error = pool.apart(*(tuple(np.log(T)) for T in sets))
    assert abs(more[0] - (share - other)) < 3 * error[0] < share - other


class Chain(Model):
    """Six parts in one sum."""

    name = "chain"
    title = "sum of parts"

    def describe(self, settings):
        names = ("nut", "rod_1", "rod_2", "pin_1", "pin_2", "cap")
        parts = tuple(Contributor(name, "m", name, "a part") for name in names)
        return Description(parts, (Response("gap", "m", "g", "the sum"),))

    def evaluate(self, deviations, settings):
        return Outcome(deviations.sum(axis=1)[:, None])


@pytest.mark.parametrize("order", ["nut rod pin cap", "nut pin rod cap"])
def test_lines_in_a_chain_are_weighted_as_one(order):
    """Neighbours hang together, so all four do; the rod may join two that are there."""
    lines = order.split()
    cost = {"law": "reciprocal", "at": "+-0.1 mm", "price": 1, "loosest": "+-0.1 mm"}
    given = {
        "model": "chain", "trials": 8, "seed": 1,
        "deviations": {n: {"tolerance": "+-0.08 mm", "cost": cost} for n in lines},
        "correlation": {
            "nut": {"rod_1": 0.6}, "rod_2": {"pin_1": -0.5}, "pin_2": {"cap": 0.4}
        },
        "limits": {"gap": {"limit": "-0.1..0.1 mm", "yield": "98 %"}},
    }  # fmt: skip
    study = load(given, model=Chain())
    loosest = tuple(each.ends[1] for each in study.deviating.priced)
    run, pool = drawn_with(study, loosest, 7, 300), Pool(study)
    pool.add(loosest, 7, beyond_each(study.limits, run))
    chosen = dict(zip(lines, [0.09e-3, 0.07e-3, 0.08e-3, 0.06e-3], strict=True))
    parts = [each.name for each in study.description.contributors]
    T = np.array([chosen[name.split("_")[0]] for name in parts])
    R = np.eye(6)
    for i, j, rank in ((0, 1, 0.6), (2, 3, -0.5), (4, 5, 0.4)):
        R[i, j] = R[j, i] = 2 * math.sin(math.pi * rank / 6)
    new, old = (
        multivariate_normal(cov=R * np.outer(sigma, sigma)).pdf(run.deviations)
        for sigma in (T / 3, np.full(6, 0.1e-3 / 3))
    )
    beyond = np.abs(run.response("gap")) > 0.1e-3
    more, _ = pool.apart(tuple(math.log(chosen[n]) for n in lines), loosest)
    assert more[0] == pytest.approx(np.mean((new / old - 1) * beyond), rel=1e-9)


def searching(given, model=None, trials=2500):
    """A search that has its wide run."""
    study = load(given, model=model or Linear())
    search = Searching(FreshRuns(study, Here(), trials, lambda progress: None))
    search.draw_wide()
    return search


class Here:
    """Evaluates what it is asked for, and counts."""

    def __init__(self):
        self.machines = 0

    def stopping(self):
        return False

    def blocks(self, model, cases, deviations):
        self.latest = deviations
        for case in cases:
            rows = slice(case.first, case.stop)
            self.machines += case.stop - case.first
            yield [(case.first, simulate(model, deviations[rows], case.settings))]


def test_as_drawn_is_what_the_study_draws():
    given = reciprocal()
    given["deviations"]["link_1"]["tolerance"] = "0.1..0.18009 mm"
    given["deviations"]["link_3"]["tolerance"] = "+-0.12349 mm"
    search = searching(given)
    scheme = search.runs.of(search.drawn, 8).scheme
    study = load(given | {"trials": 2500}, model=Linear(), seed=8)
    assert np.array_equal(search.runs.workers.latest, study.deviations())
    assert search.runs.as_written(search.drawn) == search.drawn
    assert scheme.tolerances["link_1"] == "0.1..0.18009 mm"


def test_machines_of_the_pool_are_those_that_were_judged():
    """They are drawn again; a run that grew is drawn as long as it is."""
    search = searching(reciprocal(), trials=500)
    near = search.runs.as_written(tuple(np.log(0.9 * closed_form()[1])))
    proof = search.stretched([near], search.proved(), 16_000)
    assert len(proof.status) > 2000
    for _, _, deviations, beyond, _ in search.pool._drawn:
        gap = np.transpose([*deviations.values()]) @ SLOPES
        assert np.array_equal(np.abs(gap) > LIMIT, beyond[0])


def test_a_line_as_drawn_stays_as_it_is_written():
    law = {"law": "reciprocal", "at": "+-0.02 mm", "price": 2}
    graded = {"iso1328": 7, "module": "12 mm", "cost": law}
    given = {"model": "stand", "trials": 8, "seed": 1}
    study = load({**given, "deviations": {"runout_7": graded}})
    runs = FreshRuns(study, Here(), 8, lambda progress: None)
    (drawn,) = study.deviating.priced
    choice = (drawn.as_drawn,)
    assert tomllib.loads(runs.text(choice)) == tomllib.loads(study.text)
    assert runs.as_written(choice) == choice
    assert tolerance_words(drawn, drawn.as_drawn) == "iso1328 = 7"
    other = tomllib.loads(runs.text((drawn.as_drawn - 0.1,)))
    assert other["deviations"]["runout_7"] == {"tolerance": "0..33 um", "cost": law}


def test_at_its_loosest_is_as_it_can_be_written():
    given = reciprocal()
    for line in given["deviations"].values():
        line["cost"]["loosest"] = "+-0.41239 mm"
    search = searching(given, Idle())
    assert search.loosest == pytest.approx([math.log(0.412e-3)] * 3)
    tight = search.tightest
    for end in (search.loosest[2], search.priced[2].ends[1]):
        proof = search.runs.of((*tight[:2], end), 5)
        (*_, last) = lines_of(search, proof)
        assert last.at_loosest and last.free
    assert active(search, search.loosest) == ()


def test_what_was_run_once_is_remembered_and_counted():
    search = searching(reciprocal())
    runs, drawn = search.runs, search.drawn
    wide = runs.workers.machines
    assert wide == search.drawn_wide == 2500
    first = runs.of(drawn, 8)
    assert runs.of(drawn, 8).scheme == first.scheme and runs.made == (2500,)
    assert runs.of(drawn, 9).scheme.beyond != first.scheme.beyond
    # a choice whose verdict takes longer goes on from there
    near = runs.as_written(tuple(np.log(0.97 * closed_form()[1])))
    short = runs.of(near, 8)
    assert short.yields["gap"].verdict == "undecided"
    longer = runs.of(near, 8, most=10_000)
    assert runs.made == (2500, 2500, len(longer.status))
    assert 2500 < runs.made[2] <= 10_000
    assert np.array_equal(longer.beyond[:, :2500], short.beyond)
    assert runs.of(near, 8) == longer
    # not in steps of a quarter: as many as are said to decide
    assert len(longer.status) >= min(short.yields["gap"].needed, 10_000)
    assert short.yields["gap"].needed > GROWTH * 2500
    assert runs.workers.machines - wide == sum(runs.made)


def test_of_machines_that_were_run_little_is_kept():
    """Six runs, and in memory less than a tenth of what one of them answered."""

    class Many(Linear):
        def describe(self, settings):
            links, _ = super().describe(settings)
            names = ["gap", *(f"gap_{i}" for i in range(39))]
            return Description(links, tuple(Response(n, "m", n, "a") for n in names))

        def evaluate(self, deviations, settings):
            (gap,) = super().evaluate(deviations, settings).responses.T
            return Outcome(np.repeat(gap[:, None], 40, axis=1))

    search = searching(reciprocal(), Many(), trials=20_000)
    tracemalloc.start()
    for seed in range(10, 16):
        proof = search.runs.of(search.tightest, seed)
        search.pool.add(search.tightest, seed, proof.beyond)
    gc.collect()
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    latest = search.runs.workers.latest.nbytes  # what evaluates here remembers it
    assert search.pool.trials == 7 * 20_000
    assert kept - latest < 0.1 * 20_000 * 40 * 8


def test_what_a_run_does_not_show_is_made_tighter_until_one_does(monkeypatch):
    """Weights that promise a seventh less than is so: only fresh runs tell."""

    def promised(pool, choice, miss=0.0, **exact):
        sigma = np.linalg.norm(SLOPES * np.exp(choice) / 3)
        return np.full(2, 0.86 * 2 * float(ndtr(-LIMIT / sigma)))

    monkeypatch.setattr(Pool, "most", promised)
    search = searching(reciprocal(), trials=40_000)
    proof = search.proved()
    assert proof is not None and "searched again" in search.notes[0]
    tried = [float(note.split()[2].rstrip(",")) for note in search.notes]
    # each for a twentieth less beyond than the one before
    cost, _ = closed_form()
    expected = [
        cost * ndtri(0.01 * 0.95**i / 0.86) / ndtri(0.01) for i in range(len(tried) + 1)
    ]
    assert [*tried, proof.scheme.cost] == pytest.approx(expected, rel=1e-2)
    assert 3 <= len(tried) < 6 and cost < proof.scheme.cost < 1.03 * cost


def test_of_a_list_what_was_tried_in_vain_is_not_tried_again(monkeypatch):
    """A step tighter is none where the next one offered is far off."""
    given = listed()
    del given["deviations"]["link_2"], given["deviations"]["link_3"]
    share = 0.02 / 0.85  # of the middle one: promised is less than permitted
    end = -float(ndtri(share / 2)) * 0.1e-3 / 3
    given["limits"]["gap"]["limit"] = f"{-1e3 * end}..{1e3 * end} mm"
    halves = (0.2e-3, 0.1e-3, 0.05e-3)

    def promised(pool, choice, miss=0.0, **exact):
        return np.full(2, 0.8 * 2 * float(ndtr(-end / (halves[int(choice[0])] / 3))))

    monkeypatch.setattr(Pool, "most", promised)
    search = searching(given, trials=20_000)
    proof = search.proved()
    assert proof is not None and proof.choice == (2.0,)
    assert len(search.runs.made) == 2 and len(search.notes) == 1


class Idle(Linear):
    """Its third link moves nothing."""

    def evaluate(self, deviations, settings):
        return Outcome((deviations * [1.0, -2.0, 0.0]).sum(axis=1)[:, None])


@pytest.mark.parametrize("seed", range(4))
def test_what_costs_no_yield_is_told_from_what_does(seed):
    search = searching(reciprocal(seed=seed), Idle())
    search.seed = seed + 100
    choice = search.runs.as_written(
        (math.log(0.2e-3), math.log(0.07e-3), math.log(0.4e-3))
    )
    proof = search.runs.of(choice, seed)
    search.pool.add(choice, seed, proof.beyond)
    lines = lines_of(search, proof)
    assert [line.at_loosest for line in lines] == [False, False, True]
    assert [line.free for line in lines] == [False, False, True]
    tight = search.runs.of(search.tightest, seed)
    assert [line.free for line in lines_of(search, tight)][2]
    # where the third one matters it is not: a run at its other end tells
    search = searching(reciprocal(seed=seed))
    loose = search.runs.of(choice, seed)
    assert [line.free for line in lines_of(search, loose)] == [False] * 3


def test_none_of_few_machines_is_no_proof_that_a_width_costs_nothing():
    """Of 200 none changes sides, of 800 none: it may be one of 200."""
    choice = (math.log(0.05e-3), math.log(0.05e-3), math.log(0.4e-3))
    search = searching(reciprocal(), Idle(), trials=200)
    proof = search.runs.of(choice, 5)
    assert not lines_of(search, proof)[2].free
    assert len(search.runs.of(choice, 5).status) == 800
    # where as many may prove it as by default, it is proved
    search = searching(reciprocal(), Idle(), trials=2500)
    assert lines_of(search, search.runs.of(choice, 5))[2].free


@pytest.mark.parametrize(
    ("halves", "line"), [((0.1e-3, 0.08e-3, 0.4e-3), 2), ((0.1e-3, 0.03e-3, 0.2e-3), 1)]
)
def test_what_weights_show_to_cost_yield_needs_no_run(halves, line, monkeypatch):
    """Of a line at its loosest, and of one at its tightest."""
    search = searching(reciprocal(), trials=20_000)
    choice = search.runs.as_written(tuple(np.log(halves)))
    proof = search.runs.of(choice, 5)
    known = search.runs.made
    assert not lines_of(search, proof)[line].free and search.runs.made == known
    # and where they cannot tell, one at its other end
    nothing = np.zeros(1), np.ones(1)
    monkeypatch.setattr(Pool, "apart", lambda *choices: nothing)
    assert not lines_of(search, proof)[line].free
    assert len(search.runs.made) == len(known) + 1


def test_what_moves_few_machines_is_found_by_the_same_draws():
    """A twentieth of what is permitted: weights cannot tell, a run can."""

    class Nearly(Linear):
        def evaluate(self, deviations, settings):
            return Outcome((deviations * [1.0, -2.0, 0.1]).sum(axis=1)[:, None])

    search = searching(reciprocal(), Nearly(), trials=20_000)
    choice = search.runs.as_written(
        (math.log(0.2e-3), math.log(0.072e-3), math.log(0.4e-3))
    )
    search.pool.add(choice, 5, search.runs.of(choice, 5).beyond)
    free = lines_of(search, search.runs.of(choice, 5))[2].free
    slopes, ends = np.array([1.0, -2.0, 0.1]), (0.03e-3, 0.4e-3)
    shares = [
        2 * ndtr(-LIMIT / np.linalg.norm(slopes * [0.2e-3, 0.072e-3, T] / 3))
        for T in ends
    ]
    assert (shares[1] - shares[0]) / 0.02 > 0.04 and not free


class Two(Linear):
    """Two responses, one of them named as nothing else should be."""

    def describe(self, settings):
        links, (gap,) = super().describe(settings)
        return Description(links, (gap, Response("any", "m", "a", "any gap")))

    def evaluate(self, deviations, settings):
        return Outcome(deviations @ np.array([SLOPES, [1.0, 0.0, 0.0]]).T)


def test_a_response_may_be_named_any_and_the_active_limit_is_named():
    given = listed()
    given["limits"]["any"] = {"limit": "-0.9..0.9 mm", "yield": "98 %"}
    found = tolstat.allocate(given, model=Two())
    scheme = found.schemes["found"]
    assert found.met and [*scheme.beyond] == ["gap", "any"]
    assert found.active == ("gap",)
    # what is beyond a limit is beyond that of the gap
    assert scheme.beyond["any"].value == 0 < scheme.beyond_any.value
    assert scheme.beyond_any.value == pytest.approx(scheme.beyond["gap"].value)
    # the other way round: only the first one matters
    given["limits"]["gap"]["limit"] = "-9..9 mm"
    given["limits"]["any"]["limit"] = "-0.1..0.1 mm"
    found = tolstat.allocate(given, model=Two())
    assert found.met and found.active == ("any",)
    assert [line.at_loosest for line in found.lines] == [False, True, True]
    assert [line.free for line in found.lines] == [False, True, True]
    assert found.wide_run == 2500 <= min(found.fresh_runs)


def test_a_limit_binds_also_where_a_tolerance_is_nearly_at_its_loosest():
    given = reciprocal()
    own = given["deviations"]["link_1"]["cost"]
    own["loosest"] = "+-0.0503 mm"
    search = searching(given, trials=20_000)
    # all others tightest, but that the limit holds with no more than this one has
    choice = [math.log(0.05e-3), *search.tightest[1:]]
    excess = search.above(search.permitted)

    def last(x):
        return float(excess((choice[0], x, choice[2]))[0])

    choice[1] = brentq(last, *search.priced[1].ends) - 1e-3
    assert active(search, tuple(choice)) == ("gap",)
    only = tuple([choice[0], *(each.ends[1] for each in search.priced[1:])])
    assert excess(only)[0] > 0
    at = tuple(each.ends[1] for each in search.priced)
    assert active(search, at) == ()  # nothing can be looser


def scheme(cost, share, trials=500, lower=0.0):
    beyond = Estimate(share, lower, 0.01)
    words = {"part": f"+-{1 / cost:.3g} mm"}
    return Scheme(cost, words, {}, {"gap": beyond}, beyond, trials, 1)


def test_the_picture_shows_intervals_and_none_beyond_has_no_dot():
    chart = trade_off(
        [Point(9.0, 0.01, ()), Point(12.0, 0.001, ())],
        {"found": scheme(10.0, 0.004), "worst case": scheme(20.0, 0.0)},
    )
    line, found, worst = chart.curves
    assert np.array_equal(chart.at, [0.001, 0.01]) and [*line.values] == [12.0, 9.0]
    assert not line.points and chart.marks == (Mark("found", 0.004, 10.0),)
    assert found.name == "found" and [*found.at] == [0.0, 0.004, 0.01]
    assert worst.name == "worst case, 20: none of 500 beyond"
    assert [*worst.values] == [20.0, 20.0] and [*worst.at] == [0.0, 0.01]


def test_the_same_tolerances_are_drawn_once_by_their_longest_run():
    chart = trade_off([], {
        "as drawn": scheme(10.0, 0.004), "worst case": scheme(20.0, 0.002),
        "root sum square": scheme(10.0, 0.005, trials=2000),
    })  # fmt: skip
    _, both, _ = chart.curves
    assert both.name == "as drawn = root sum square" and both.at[1] == 0.005


def test_an_interval_far_below_all_else_comes_in_from_the_end_of_the_axis():
    schemes = {"a": scheme(10.0, 4e-3, lower=1e-7), "b": scheme(20.0, 5e-3, lower=2e-3)}
    chart = trade_off([Point(9.0, 0.01, ())], schemes)
    (axes,) = draw_view(chart, "stack").axes
    left, _ = axes.get_xlim()
    assert left == pytest.approx(2000) and chart.curves[1].at[0] == 1e-7


def test_of_lists_the_cheapest_are_dots_at_their_own_shares():
    """A line between them would be of tolerances that nobody can have."""
    listed = reciprocal()
    listed["limits"] = {"gap": {"limit": "-0.15..0.15 mm", "yield": "95 %"}}
    for name in list(listed["deviations"]):
        listed["deviations"][name] = {
            "tolerance": "+-0.1 mm", "cost": {"+-0.1 mm": 1, "+-0.05 mm": 3}
        }  # fmt: skip
    found = tolstat.allocate(listed, model=Linear())
    cheapest = found.curve.curves[0]
    assert cheapest.points and len(set(cheapest.values)) == len(cheapest.values)
    law = tolstat.allocate(reciprocal(), model=Linear())
    assert not law.curve.curves[0].points


@pytest.mark.parametrize(
    ("trials", "memory"), [(None, 1e11), (2000, 1e11), (2000, 1e8)]
)
def test_what_a_proof_takes_is_said_before_anything_runs(trials, memory, monkeypatch):
    """Or refused where no such run can show what is demanded."""
    monkeypatch.setattr(size, "memory", lambda: memory)
    given, told = reciprocal(), []
    given["limits"] = {"gap": {"limit": "<= 1 mm", "ppm": 10}}

    def tell(progress):
        told.append(progress.doubt)
        raise KeyboardInterrupt

    if trials:
        words = "no first proof of 8000 machines.* ask for 120000 trials or more"
        with pytest.raises(StudyError, match=words):
            tolstat.allocate(given, model=Linear(), trials=trials)
        trials = 120_000
    with pytest.raises(KeyboardInterrupt):
        tolstat.allocate(given, model=Linear(), trials=trials, progress=tell)
    assert len(told) == 1 and "gap may have 10 ppm beyond" in told[0]
    assert ("(--trials for fewer, 120000 at least)" in told[0]) == (trials is None)
    # a longer proof, which an answer can do without, has to fit into the memory
    longer = {1e11: f"or {32 * (trials or 5_000_001)} where", 1e8: "480000"}
    assert longer[memory] in told[0] and ("where" in told[0]) == (memory > 1e8)


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


def test_proportions_are_kept_and_scaled_where_weights_do_not_show_the_way(
    monkeypatch,
):
    """The optimum, by trying widths on a grid: 34.41; by weights alone 35.6."""
    monkeypatch.setattr(beside, "CURVE", np.array([0.5, 2.0]))  # less to be searched
    found = tolstat.allocate(uniform())
    assert found.met and 34.41 < found.cost < 1.02 * 34.41
    rows = [found.schemes[name] for name in ("root sum square", "worst case")]
    assert found.cost <= min(each.cost for each in rows)


def test_five_uniform_links_cost_what_the_tail_of_their_sum_says(monkeypatch):
    """Of five from -1 to 1 the sum is above 5 - 2 x with a chance of x^5 / 120.

    By weights alone, all or nothing, 8 % above the optimum; scaled with weights that a
    table has, whose steps are coarse where tolerances may differ sixtyfold, 5 %.
    """
    monkeypatch.setattr(beside, "CURVE", np.array([0.5, 2.0]))  # less to be searched
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
    assert max(found.fresh_runs) <= 640_000


def test_a_longer_run_proves_what_is_cheaper_where_that_is_worth_it():
    search, (cost, _) = searching(reciprocal()), closed_form()
    short = search.proved()
    long = search.stretched([short.choice], short, 80_000)
    assert 1.035 * cost < short.scheme.cost and long.scheme.cost < 1.03 * cost
    assert 10_000 < long.scheme.trials <= 80_000 and long.met
    # the same proportions, but for three digits
    ratios = np.exp(np.subtract(long.choice, short.choice))
    assert np.allclose(ratios, ratios[0], rtol=0.02)
    made = search.runs.made
    assert search.stretched([long.choice], long, 80_000) is long
    assert search.runs.made == made


@pytest.mark.parametrize(("trials", "permitted"), [(10_000, 0.02), (160_000, 0.01)])
def test_what_is_aimed_at_is_shown_as_likely_as_within_a_standard_error(
    trials, permitted
):
    share = _aimed(trials, permitted)
    counts = np.arange(int(permitted * trials))
    shown = [anytime_valid(n, trials).upper <= permitted for n in counts.tolist()]
    assert 0.80 < binom.cdf(counts[shown].max(), trials, share) < 0.88


def test_what_a_run_shows_to_be_worse_than_as_drawn_is_not_for_the_cost_drawn(
    monkeypatch,
):
    monkeypatch.setattr(beside, "for_the_cost_drawn", lambda search, _: search.loosest)
    search = searching(reciprocal(), trials=500)
    proof = beside.at_the_cost_drawn(search, [], 3)
    assert proof.choice == search.drawn and "fewer machines" in search.notes[0]


def test_what_no_run_tells_from_as_drawn_is_not_said_to_be_no_better(monkeypatch):
    monkeypatch.setattr(beside, "for_the_cost_drawn", lambda search, _: search.tightest)
    given = reciprocal()
    given["limits"]["gap"]["limit"] = "-1..1 mm"  # beyond it is none of either
    search = searching(given, trials=500)
    proof = beside.at_the_cost_drawn(search, [], 3)
    assert proof.choice == search.tightest != search.drawn
    (note,) = search.notes
    assert "runs of 500, which do not tell them apart" in note


def test_the_tightest_is_the_answer_where_it_alone_is_proved(monkeypatch):
    monkeypatch.setattr(Searching, "proved", lambda search, best=None: best)
    monkeypatch.setattr(allocating, "linear_answers", lambda search: {})
    given = reciprocal()
    given["limits"]["gap"]["limit"] = "-1..1 mm"
    found = tolstat.allocate(given, trials=2000, model=Linear())
    assert found.met and found.verdicts == {"gap": "met"}
    assert "They meet every limit" in found.text


@pytest.mark.parametrize("trials", [0, -5, 2.5])
def test_a_number_of_trials_is_whole(trials):
    with pytest.raises(StudyError, match="a whole number from 1 on"):
        tolstat.allocate(reciprocal(), trials=trials, model=Linear())


@pytest.mark.parametrize(
    ("alike", "none_beyond"),
    [("12345", "45"), ("12345", "12345"), ("12245", ""), ("11145", "5"),
     ("12211", "2"), ("11111", "1"), ("12345", "")],
)  # fmt: skip
def test_a_legend_covers_no_name_of_an_axis(alike, none_beyond):
    """Whichever tolerances are the same, and have none beyond: columns as they fit."""
    names = "as drawn", "found", "at the cost drawn", "root sum square", "worst case"
    schemes = {}
    for name, which in zip(names, alike, strict=True):
        share = 0.0 if which in none_beyond else 1e-3 * int(which)
        beyond = Estimate(share, share / 2, share + 1e-3)
        schemes[name] = Scheme(
            1234.0, {"a": which}, {"a": 1.0}, {}, beyond, trials=106496, seed=1
        )
    points = [Point(cost, share, ()) for cost, share in ((90, 2e-2), (150, 2e-4))]
    figure = draw_view(trade_off(points, schemes), "cost over ppm")
    nothing_overlaps(figure)
    (axes,) = figure.axes
    assert axes.get_position().width > 0.85
