"""A pool of weighted trials against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import chi2, multivariate_normal, norm

from tests.answers.allocate.linear_stack import (
    LIMIT,
    SLOPES,
    Linear,
    Two,
    drawn_with,
    pool_of,
    reciprocal,
)
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.answers.allocate.fresh_runs import out_of_each_limit
from tolstat.answers.allocate.reweighted_pool import Pool
from tolstat.study.study import load


@pytest.mark.parametrize("correlated", [False, True])
def test_the_pool_agrees_with_runs_of_any_tolerances(correlated):
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
    assert pool.upper_ends(choice, 0.5)[0] == pytest.approx(truth, rel=0.2)
    assert truth < pool.upper_ends(choice)[0] < (1.6 if correlated else 1.3) * truth


def test_without_weights_the_upper_end_is_that_of_a_count():
    study = load(reciprocal(), model=Linear())
    choice = tuple(each.specified_choice for each in study.deviating.priced)
    run, pool = drawn_with(study, choice, 7, 3000), Pool(study)
    pool.add(choice, 7, out_of_each_limit(study.limits, run))
    count = int(np.sum(np.abs(run.response("gap")) > LIMIT))
    for miss in (0.025, 0.5):
        upper = chi2.ppf(1 - miss, 2 * (count + 1)) / 2 / 3000  # of Poisson's law
        assert pool.upper_ends(choice, miss) == pytest.approx([upper, upper])


def test_without_trials_out_of_limit_the_next_has_the_usual_weight():
    """Of those within all limits one in 29 is kept, and counts 29 times."""
    given = reciprocal(limits={"gap": "-9..9 mm", "any": "-0.1..0.1 mm"})
    study = load(given, model=Two())
    loosest = tuple(each.ends[1] for each in study.deviating.priced)
    run, pool = drawn_with(study, loosest, 7, 30_000), Pool(study)
    pool.add(loosest, 7, out_of_each_limit(study.limits, run))
    T = np.array([0.3e-3, 0.2e-3, 0.35e-3])
    old = norm.pdf(run.deviations, scale=0.4e-3 / 3)
    weights = (norm.pdf(run.deviations, scale=T / 3) / old).prod(axis=1) / 30_000
    usual = np.sum(weights**2) / np.sum(weights)
    none = -math.log(0.025) * usual
    assert pool.upper_ends(tuple(np.log(T)))[0] == pytest.approx(none, rel=0.03)


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
def test_correlated_entries_are_weighted_together(order):
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
    pool.add(loosest, 7, out_of_each_limit(study.limits, run))
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
    # few enough to keep all of them
    chosen_logs = tuple(math.log(chosen[n]) for n in lines)
    weights = pool.weights(chosen_logs, exact=False)
    more = np.mean((weights - 1) * pool._out[0])
    assert more == pytest.approx(np.mean((new / old - 1) * beyond), rel=1e-9)
