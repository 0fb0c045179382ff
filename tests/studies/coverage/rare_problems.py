"""Machines beyond a limit whose share is known and small, sought in stages."""

from __future__ import annotations

from functools import cache, partial
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.stats import chi2, norm, truncnorm, weibull_min

from tests.studies.coverage.rare_collections import COLLECTED
from tolstat.deviations.dependence import Batch, Dependence
from tolstat.deviations.distributions import (
    Lognormal,
    Normal,
    Tolerance,
    TruncatedNormal,
    Uniform,
    Weibull,
)
from tolstat.deviations.draw import draw_in_stages
from tolstat.statistics.intervals.weighted_estimates import rare_share


class RareProblem(NamedTuple):
    """Distributions, how far within its limit a machine is, and the share beyond."""

    distributions: dict
    margin: object
    share: float
    dependence: Dependence = Dependence()


UNIT = Tolerance(-3.0, 3.0)  # of a part of sigma 1


def _normal(parts):
    return {f"x{i + 1}": Normal(UNIT) for i in range(parts)}


def _linear(parts, share):
    """A sum of parts, each counting for more than the one before."""
    weights = np.arange(1.0, parts + 1)
    end = np.linalg.norm(weights) * norm.isf(share)
    return RareProblem(_normal(parts), lambda x: end - x @ weights, share)


def _four_branches(b):
    """The series system of two parts and four branches, of Waarts and of Breitung."""
    root = np.sqrt(2)

    def margin(x):
        along, across = (x[:, 0] + x[:, 1]) / root, (x[:, 0] - x[:, 1]) / root
        curved = b + 0.2 * across**2 - np.abs(along)
        return np.minimum(curved, b + 0.5 - np.abs(across))

    # in the turned coordinates the branches are given by one of them alone
    def share(y):
        return norm.pdf(y) * 2 * norm.sf(b + 0.2 * y**2)

    curved = 2 * quad(share, 0, b + 0.5, epsabs=0, epsrel=1e-10)[0]
    return RareProblem(_normal(2), margin, curved + 2 * norm.sf(b + 0.5))


def _misleading():
    """Breitung's: the response falls first where hardly any machine is beyond."""

    def margin(x):
        u, v = x.T
        one = np.where(u > 3.5, 4 - u, 0.85 - 0.1 * u)
        other = np.where(v > 2, 0.5 - 0.1 * v, 2.3 - v)
        return np.minimum(one, other)

    # beyond are u > 4 or v > 5
    one, other = norm.sf(4), norm.sf(5)
    return RareProblem(_normal(2), margin, one + other - one * other)


def _jam(parts, share):
    """Two rods that fight each other once they differ; until then nothing happens."""
    gap = np.sqrt(2) * norm.isf(share / 2)

    def margin(x):
        apart = np.abs(x[:, 0] - x[:, 1])
        return np.where(apart > gap, gap - apart, 1.0)

    return RareProblem(_normal(parts), margin, share)


def _at_once(share):
    """Three of six parts that must be far out together."""
    end = norm.isf(share ** (1 / 3))
    return RareProblem(_normal(6), lambda x: end - x[:, :3].min(axis=1), share)


def _skewed(share):
    """Products of lognormal parts: the sum of their logarithms is normal."""
    part = Lognormal(Tolerance(0.0, 3.0), 1.0)
    sigma = np.log(part.deviations(np.array([norm.cdf(1)]))[0])
    end = 2 * sigma * norm.isf(share)
    names = {f"x{i + 1}": part for i in range(4)}
    return RareProblem(names, lambda x: end - np.log(x).sum(axis=1), share)


def _corner(share):
    """The sum of four amplitudes: a corner of a cube."""
    end = 4 - (24 * share) ** (1 / 4)
    names = {f"x{i + 1}": Uniform(Tolerance(0.0, 1.0)) for i in range(4)}
    return RareProblem(names, lambda x: end - x.sum(axis=1), share)


def _correlated(share):
    """The sum of two parts that go with each other, and of two of one batch."""
    rank, common = 0.6, 0.5
    sigma = np.sqrt(2 + 4 * np.sin(np.pi * rank / 6) + 2 + 2 * common)
    batches = {name: Batch("x", common) for name in ("x_3", "x_4")}
    names = {f"x_{i + 1}": Normal(UNIT) for i in range(4)}
    end = sigma * norm.isf(share)
    return RareProblem(
        names,
        lambda x: end - x.sum(axis=1),
        share,
        Dependence(batches, {("x_1", "x_2"): rank}),
    )


def _failing(share):
    """Machines that fail where they are beyond: no response leads there."""
    end = norm.isf(share)

    def margin(x):
        return np.where(x[:, 0] > end, -np.inf, x[:, 1] + 10)

    return RareProblem(_normal(3), margin, share)


def _common(share):
    """Four parts that have nine tenths of their variance from one batch: their sum."""
    common = 0.9
    batches = {f"x_{i + 1}": Batch("x", common) for i in range(4)}
    names = {name: Normal(UNIT) for name in batches}
    end = np.sqrt(4 + 12 * common) * norm.isf(share)
    return RareProblem(names, lambda x: end - x.sum(axis=1), share, Dependence(batches))


def _apart(share):
    """Two parts of one batch, which cancels: only their difference counts."""
    common = 0.9
    batches = {f"x_{i + 1}": Batch("x", common) for i in range(2)}
    names = {name: Normal(UNIT) for name in batches}
    end = np.sqrt(2 - 2 * common) * norm.isf(share / 2)
    return RareProblem(
        names, lambda x: end - np.abs(x[:, 0] - x[:, 1]), share, Dependence(batches)
    )


def _eccentric(share):
    """A Weibull part, exponential at its end, and a normal one as wide."""
    part = Weibull(Tolerance(0.0, 3.0), 1.5)
    scale = part.deviations(np.array([-np.expm1(-1)]))[0]  # 1 - 1/e lie below it
    known = weibull_min(1.5, scale=scale)

    def beyond(end):
        def at(y):
            return norm.pdf(y) * known.sf(end - y)

        return sum(
            quad(at, a, a + 2, epsabs=0, epsrel=1e-10)[0] for a in range(-9, 9, 2)
        )

    end = brentq(lambda end: np.log(beyond(end) / share), 1, 30, xtol=1e-10)
    names = {"x1": part, "x2": Normal(UNIT)}
    return RareProblem(names, lambda x: end - x.sum(axis=1), share)


def _two_regions(parts, share):
    """Ten are beyond at one end for each that is at the other, of another part."""
    one, other = norm.isf(share * 10 / 11), norm.isf(share / 11)

    def margin(x):
        return np.minimum(one - x[:, 0], other + x[:, 1])

    p, q = norm.sf(one), norm.sf(other)
    return RareProblem(_normal(parts), margin, p + q - p * q)


def _kinds(parts, share):
    """Beyond is whatever part is at its end: as many kinds, all alike."""
    end = norm.isf(-np.expm1(np.log1p(-share) / parts))
    return RareProblem(_normal(parts), lambda x: end - x.max(axis=1), share)


def _ends(parts, share):
    """Beyond is whatever part is at either end: twice as many kinds, all alike."""
    end = norm.isf(-np.expm1(np.log1p(-share) / parts) / 2)
    return RareProblem(_normal(parts), lambda x: end - np.abs(x).max(axis=1), share)


def _corner_beside(parts, corner, share, of_corner):
    """One part at its end, or several others at once, far from any such end."""
    end = norm.isf(share * (1 - of_corner))
    at = norm.isf((share * of_corner) ** (1 / corner))

    def margin(x):
        together = x[:, 1 : 1 + corner].min(axis=1)
        return np.minimum(end - x[:, 0], at - together)

    p, q = share * (1 - of_corner), share * of_corner
    return RareProblem(_normal(parts), margin, p + q - p * q)


def _hidden(parts, share):
    """Two regions of which the smaller does not show before it is reached."""
    one, other = norm.isf(share * 10 / 11), norm.isf(share / 11)

    def margin(x):
        return np.where(x[:, 1] < -other, -1.0, one - x[:, 0])

    p, q = norm.sf(one), norm.sf(other)
    return RareProblem(_normal(parts), margin, p + q - p * q)


def _sphere(parts, share):
    """All that is far from the middle: no direction is the likeliest."""
    end = chi2.isf(share, parts)
    return RareProblem(_normal(parts), lambda x: end - (x**2).sum(axis=1), share)


def _bent(b, bend):
    """A limit that bends towards the middle, or away from it, far from its summit."""

    def margin(x):
        return b + bend * x[:, 1] ** 2 - x[:, 0]

    def at(y):
        return norm.pdf(y) * norm.sf(b + bend * y**2)

    share = 2 * sum(quad(at, a, a + 1, epsabs=0, epsrel=1e-10)[0] for a in range(9))
    return RareProblem(_normal(3), margin, share)


def _two_of_ten(share):
    """Ten parts, of which two are felt."""
    end = np.sqrt(5) * norm.isf(share)
    return RareProblem(_normal(10), lambda x: end - x[:, 0] - 2 * x[:, 1], share)


def _bounded(end):
    """A part that inspection ends at two sigmas, and one within one: 3 is the end."""
    part = TruncatedNormal(Tolerance(-2.0, 2.0), cp=2 / 3, outside="screened")
    names = {"x1": part, "x2": Uniform(Tolerance(-1.0, 1.0))}
    known = truncnorm(-2, 2)

    def at(y):
        return known.sf(end - y) / 2

    share = quad(at, min(end - 2, 1.0), 1, epsabs=0, epsrel=1e-10)[0]
    return RareProblem(names, lambda x: end - x.sum(axis=1), share)


MAKE = {
    "linear of 2, 1e-6": lambda: _linear(2, 1e-6),
    "linear of 5, 1e-6": lambda: _linear(5, 1e-6),
    "linear of 10, 1e-6": lambda: _linear(10, 1e-6),
    "linear of 20, 1e-6": lambda: _linear(20, 1e-6),
    "linear of 10, 1e-7": lambda: _linear(10, 1e-7),
    "linear of 5, 1e-4": lambda: _linear(5, 1e-4),
    "linear of 5, 1e-3": lambda: _linear(5, 1e-3),
    "two of ten, 1e-6": lambda: _two_of_ten(1e-6),
    "four branches": lambda: _four_branches(4.5),
    "four branches, 1e-6": lambda: _four_branches(4.805),
    "four branches, 1e-7": lambda: _four_branches(5.242),
    "two regions, 1e-6": lambda: _two_regions(2, 1e-6),
    "two regions of ten parts, 1e-6": lambda: _two_regions(10, 1e-6),
    "five kinds alike, 1.7e-5": lambda: _kinds(5, 1.7e-5),
    "eight kinds alike, 1e-6": lambda: _kinds(8, 1e-6),
    "ten kinds alike, 1e-6": lambda: _ends(5, 1e-6),
    "corner of four beside, 7e-5": lambda: _corner_beside(5, 4, 7.4e-5, 0.57),
    "corner of four of ten beside, 7e-5": lambda: _corner_beside(10, 4, 7.4e-5, 0.57),
    "corner of four beside, 1e-6": lambda: _corner_beside(5, 4, 1e-6, 0.5),
    "small corner of three beside, 1e-6": lambda: _corner_beside(10, 3, 1e-6, 0.1),
    "corner of six beside, 1e-5": lambda: _corner_beside(10, 6, 1e-5, 0.5),
    "hidden region, 1e-6": lambda: _hidden(2, 1e-6),
    "hidden region of five parts, 1e-6": lambda: _hidden(5, 1e-6),
    "bent away, 1e-6": lambda: _bent(4.5, 0.5),
    "bent around, 1e-6": lambda: _bent(6.0, -0.2),
    "ring, 1e-6": lambda: _sphere(2, 1e-6),
    "sphere of five, 1e-6": lambda: _sphere(5, 1e-6),
    "misleading": _misleading,
    "rods jam, 1e-4": lambda: _jam(2, 1e-4),
    "rods of ten parts jam, 1e-6": lambda: _jam(10, 1e-6),
    "three at once, 1e-6": lambda: _at_once(1e-6),
    "lognormal, 1e-6": lambda: _skewed(1e-6),
    "Weibull, 1e-6": lambda: _eccentric(1e-6),
    "corner, 1e-6": lambda: _corner(1e-6),
    "near the end": lambda: _bounded(2.99),
    "past the end": lambda: _bounded(3.01),
    "correlated, 1e-6": lambda: _correlated(1e-6),
    "common part, 1e-6": lambda: _common(1e-6),
    "common part cancels, 1e-6": lambda: _apart(1e-6),
    "failing, 1e-5": lambda: _failing(1e-5),
}


def _collected(make):
    parts, margin, share = make()
    return RareProblem(_normal(parts), margin, share)


MAKE |= {name: partial(_collected, make) for name, make in COLLECTED.items()}
RARE_PROBLEMS = {name: cache(make) for name, make in MAKE.items()}


def sought(problem, seed, trials):
    """Return the margins and weights of the last stage of a study."""
    course = draw_in_stages(
        list(problem.distributions),
        problem.distributions,
        sampling="rare",
        seed=seed,
        trials=trials,
        dependence=problem.dependence,
    )
    stage, x = next(course)
    while True:
        margins, weights = problem.margin(x), stage.weight
        try:
            stage, x = course.send(margins)
        except StopIteration:
            return margins, weights


def intervals(name, rng, n):
    """Yield problem, statistic, estimate, truth and whether it is exact, of a study."""
    problem = RARE_PROBLEMS[name]()
    margins, weights = sought(problem, int(rng.integers(2**63)), n)
    yield (
        name,
        "share beyond, rare",
        rare_share(margins < 0, weights),
        problem.share,
        False,
    )


SIZE, STUDIES = 20_000, 200
JOBS = [(name, SIZE, intervals, STUDIES) for name in MAKE]
JOBS += [
    ("four branches", 5000, intervals, STUDIES),
    ("twenty exponential, too large, 1e-5", 5000, intervals, STUDIES),
    ("two regions of ten parts, 1e-6", 8000, intervals, STUDIES),
]
