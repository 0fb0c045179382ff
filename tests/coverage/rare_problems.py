"""Machines beyond a limit whose share is known and small, sought in stages."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad
from scipy.stats import norm

from tolstat.deviations.dependence import Batch, Dependence
from tolstat.deviations.distributions.lognormal import Lognormal
from tolstat.deviations.distributions.normal import Normal
from tolstat.deviations.distributions.uniform import Uniform
from tolstat.deviations.draw import draw_in_stages
from tolstat.deviations.tolerance import Tolerance
from tolstat.statistics.rare import rare_share


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


MAKE = {
    "linear of 2, 1e-6": lambda: _linear(2, 1e-6),
    "linear of 5, 1e-6": lambda: _linear(5, 1e-6),
    "linear of 10, 1e-6": lambda: _linear(10, 1e-6),
    "linear of 20, 1e-6": lambda: _linear(20, 1e-6),
    "linear of 10, 1e-7": lambda: _linear(10, 1e-7),
    "linear of 5, 1e-4": lambda: _linear(5, 1e-4),
    "linear of 5, 1 %": lambda: _linear(5, 0.01),
    "four branches": lambda: _four_branches(4.5),
    "misleading": _misleading,
    "rods jam, 1e-4": lambda: _jam(2, 1e-4),
    "rods of ten parts jam, 1e-6": lambda: _jam(10, 1e-6),
    "three at once, 1e-6": lambda: _at_once(1e-6),
    "lognormal, 1e-6": lambda: _skewed(1e-6),
    "corner, 1e-6": lambda: _corner(1e-6),
    "correlated, 1e-6": lambda: _correlated(1e-6),
    "failing, 1e-5": lambda: _failing(1e-5),
}
RARE_PROBLEMS = {name: cache(make) for name, make in MAKE.items()}


def sought(problem, seed, trials):
    """Return the margins and weights of the last stage of a study."""
    course = draw_in_stages(
        list(problem.distributions),
        problem.distributions,
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


# of the others a few dozen studies each were looked at
JOBS = [
    (name, 20_000, intervals, 400)
    for name in (
        "linear of 2, 1e-6",
        "linear of 5, 1e-6",
        "linear of 10, 1e-6",
        "linear of 20, 1e-6",
        "four branches",
        "misleading",
        "rods jam, 1e-4",
    )
]
JOBS.append(("four branches", 5000, intervals, 400))
