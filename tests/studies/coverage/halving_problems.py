"""Machines beyond a limit whose share is known, as drawn and with tolerances halved."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from tests.studies.coverage.problems import SIZES
from tolstat.deviations.density_ratio import DensityRatio
from tolstat.deviations.dependence import Dependence, joined
from tolstat.deviations.distributions import (
    Lognormal,
    Normal,
    Tolerance,
    Uniform,
    Weibull,
)
from tolstat.deviations.spread import halved
from tolstat.statistics.intervals.weighted_estimates import weighted_share
from tolstat.statistics.intervals.weights import Weights


class HalvingProblem(NamedTuple):
    """Distributions, what lies beyond, and the shares beyond by what is halved."""

    distributions: dict
    dependence: Dependence
    beyond: object
    shares: dict


UNIT = Tolerance(-3.0, 3.0)  # of a part of sigma 1
ONE = ("x1",)


def _normal(weights, beyond, shares, correlation=0.0):
    """Normal parts, of which a weighted sum says what is beyond."""
    names = [f"x{i + 1}" for i in range(len(weights))]
    pairs = {("x1", "x2"): correlation} if correlation else {}

    def sigma(halved):
        s = np.where([n in halved for n in names], 0.5, 1.0) * weights
        return np.sqrt(np.sum(s**2) + 2 * of_scores(correlation) * s[0] * s[1])

    return HalvingProblem(
        dict.fromkeys(names, Normal(UNIT)),
        Dependence({}, pairs),
        lambda x: beyond(sum(w * x[n] for w, n in zip(weights, names, strict=True))),
        {h: shares(sigma(h)) for h in dict.fromkeys((ONE, tuple(names)))},
    )


def of_scores(rank_correlation):
    """Return the correlation of the normal scores."""
    return 2 * np.sin(np.pi * rank_correlation / 6)


def _stack(share):
    """One side of a sum of four parts."""
    weights = (3.0, 2.0, 1.0, 0.5)
    end = np.linalg.norm(weights) * norm.isf(share)
    return _normal(weights, lambda y: y > end, lambda s: norm.sf(end / s))


def _jam(share):
    """Two rods that fight each other once they differ by more than the gap."""
    gap = np.sqrt(2) * norm.isf(share / 2)
    return _normal(
        (1.0, -1.0), lambda y: np.abs(y) > gap, lambda s: 2 * norm.sf(gap / s)
    )


def _too_alike(share):
    """Two parts that must differ: more of them are beyond with tolerances halved."""
    gap = np.sqrt(2) * norm.isf(0.5 - share / 2)
    return _normal(
        (1.0, -1.0), lambda y: np.abs(y) < gap, lambda s: 2 * norm.cdf(gap / s) - 1
    )


TOGETHER = 0.6  # rank correlation


def _correlated(share):
    """Two parts that go with each other."""
    end = np.sqrt(2 + 2 * of_scores(TOGETHER)) * norm.isf(share)
    return _normal((1.0, 1.0), lambda y: y > end, lambda s: norm.sf(end / s), TOGETHER)


def _the_other(share):
    """A part beyond its own limit, another that goes with it halved: no bound."""
    end = norm.isf(share)
    found = _normal((0.0, 1.0), lambda y: y > end, lambda s: share, TOGETHER)
    return found._replace(shares={ONE: share})


def _run_outs(share):
    """The sum of four amplitudes."""
    names = tuple(f"x{i + 1}" for i in range(4))
    end = 4 - (24 * share) ** (1 / 4)  # the corner of a cube, while it is one
    whole, half = np.ones(4000), 2 * np.append(np.ones(2000), np.zeros(2000))

    def share_of(halved):
        density = np.ones(1)
        for name in names:
            density = np.convolve(density, half if name in halved else whole) / 4000
        middles = (np.arange(len(density)) + 2) / 4000
        return density[middles > end].sum()

    return HalvingProblem(
        dict.fromkeys(names, Uniform(Tolerance(0.0, 1.0))),
        Dependence(),
        lambda x: sum(x.values()) > end,
        {h: share_of(h) for h in (ONE, names)},
    )


def _weibull(share):
    """A part of a skewed distribution, beyond a limit of its own."""
    part = Weibull(Tolerance(0.0, 3.0), 2.0)
    end = part.deviations(np.array([1 - share]))
    return HalvingProblem(
        {"x1": part}, Dependence(), lambda x: x["x1"] > end, {ONE: share**4}
    )


MEDIAN = 0.4
APART = np.log(2) / (np.log(3 / MEDIAN) / 3)  # sigmas that halving moves it


def _lognormal(share):
    """A part with a long tail, beyond a limit of its own."""
    part = Lognormal(Tolerance(0.0, 3.0), MEDIAN)
    end = part.deviations(np.array([1 - share]))
    halved = norm.sf(norm.isf(share) + APART)
    return HalvingProblem(
        {"x1": part}, Dependence(), lambda x: x["x1"] > end, {ONE: halved}
    )


def _low_lognormal(share):
    """The same on its other side, where the ratio of densities has no bound."""
    part = Lognormal(Tolerance(0.0, 3.0), MEDIAN)
    end = part.deviations(np.array([share]))
    halved = norm.sf(norm.isf(share) - APART)
    return HalvingProblem(
        {"x1": part}, Dependence(), lambda x: x["x1"] < end, {ONE: halved}
    )


HALVING_PROBLEMS = {
    f"{name}, {100 * share:g} % beyond": make(share)
    for name, make, shares in (
        ("stack", _stack, (0.005, 0.05)),
        ("jam", _jam, (0.005, 0.05)),
        ("too alike", _too_alike, (0.005, 0.05)),
        ("correlated", _correlated, (0.05,)),
        ("the other one", _the_other, (0.005, 0.05)),
        ("run-outs", _run_outs, (0.04,)),
        ("Weibull", _weibull, (0.05,)),
        ("lognormal", _lognormal, (0.05,)),
        ("lognormal, low", _low_lognormal, (0.005, 0.05)),
    )
    for share in shares
}


def intervals(name, rng, n):
    """Yield problem, statistic, estimate, truth and whether it is exact, of a study."""
    problem = HALVING_PROBLEMS[name]
    unit = joined(
        {each: rng.random(n) for each in problem.distributions}, problem.dependence
    )
    x = {k: each.deviations(unit[k]) for k, each in problem.distributions.items()}
    beyond = problem.beyond(x)
    weighting = DensityRatio(x, problem.distributions, problem.dependence)
    for names, share in problem.shares.items():
        new = {each: halved(problem.distributions[each], sized=False) for each in names}
        found = weighted_share(beyond, Weights(weighting.weights(new)))
        yield name, f"beyond with {len(names)} halved", found, share, False


STUDIES = {50: 4000, 200: 4000, 1000: 4000, 10_000: 4000}
JOBS = [(name, n, intervals, STUDIES[n]) for name in HALVING_PROBLEMS for n in SIZES]
