"""A linear stack, whose cheapest tolerances are a closed form, and its searches."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtri

from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.answers.allocate.fresh_runs import FreshRuns, out_of_each_limit
from tolstat.answers.allocate.reweighted_pool import Pool, with_choice
from tolstat.answers.allocate.search import Search
from tolstat.execution.stages import Trials
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


OFFERED = {"+-0.2 mm": 1, "+-0.1 mm": 3, "+-0.05 mm": 9}


def listed(least_cost="98 %"):
    study = reciprocal()
    for line in study["deviations"].values():
        line["tolerance"], line["cost"] = "+-0.1 mm", OFFERED
    study["limits"]["gap"]["yield"] = least_cost
    return study


class Two(Linear):
    """Two responses, one of them named as nothing else should be."""

    def describe(self, settings):
        links, (gap,) = super().describe(settings)
        return Description(links, (gap, Response("any", "m", "a", "any gap")))

    def evaluate(self, deviations, settings):
        return Outcome(deviations @ np.array([SLOPES, [1.0, 0.0, 0.0]]).T)


class Idle(Linear):
    """Its third link moves nothing."""

    def evaluate(self, deviations, settings):
        return Outcome((deviations * [1.0, -2.0, 0.0]).sum(axis=1)[:, None])


def pool_of(study, trials):
    """Machines with the loosest tolerances, and with those halfway and tightest."""
    pool = Pool(study)
    for seed, share in enumerate((1.0, 0.5, 0.0)):
        priced = study.deviating.priced
        choice = tuple(e.ends[0] + share * (e.ends[1] - e.ends[0]) for e in priced)
        run = drawn_with(study, choice, seed, trials)
        pool.add(choice, seed, out_of_each_limit(study.limits, run))
    return pool


def drawn_with(study, choice, seed, trials):
    drawn = with_choice(study, choice, seed, trials)
    run = Trials.planned(study.description, drawn.deviations())
    run.take([(0, simulate(study.model, run.deviations, study.settings))])
    return run


def searching(given, model=None, trials=2500):
    """A search that has its wide run."""
    study = load(given, model=model or Linear())
    search = Search(FreshRuns(study, Here(), trials, lambda progress: None))
    search.run_wide()
    return search


class Here:
    """Evaluates what it is asked for, and counts."""

    def __init__(self):
        self.machines = 0

    def stopping(self):
        return False

    def call(self, function, *arguments):
        return function(*arguments)

    def blocks(self, model, cases, deviations, late=None):
        self.latest = deviations
        for case in cases:
            rows = slice(case.first, case.stop)
            self.machines += case.stop - case.first
            yield [(case.first, simulate(model, deviations[rows], case.settings))]
