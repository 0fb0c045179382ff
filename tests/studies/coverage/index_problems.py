"""Responses of several contributors whose Sobol' indices are known."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.integrate import trapezoid
from scipy.special import ndtri
from scipy.stats import norm, qmc

from tests.studies.coverage.problems import SIZES
from tolstat.statistics.point_mass import clipped
from tolstat.statistics.sensitivity.contributions import contributions
from tolstat.statistics.sensitivity.group_surface import GroupSurface, like_normal
from tolstat.statistics.sensitivity.sobol_indices import sobol_indices


class IndexProblem(NamedTuple):
    """How unit samples become deviations, these a response; the known indices."""

    deviations: object
    response: object
    first: np.ndarray
    total: np.ndarray
    independent: bool = True


def _ishigami():
    """T. Ishigami, T. Homma (1990), a = 7, b = 0.1."""
    a, b = 7.0, 0.1

    def response(x):
        x1, x2, x3 = np.moveaxis(x, -1, 0)
        return np.sin(x1) + a * np.sin(x2) ** 2 + b * x3**4 * np.sin(x1)

    V1, V2 = (1 + b * np.pi**4 / 5) ** 2 / 2, a**2 / 8
    V13 = 8 * b**2 * np.pi**8 / 225
    V = V1 + V2 + V13
    first = np.array([V1, V2, 0]) / V
    total = np.array([V1 + V13, V2, V13]) / V
    return IndexProblem(lambda u: np.pi * (2 * u - 1), response, first, total)


def _sobol_g():
    """A. Saltelli, I. M. Sobol' (1995), a = 0, 1, 4.5, 9, 99, 99."""
    a = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0])

    def response(x):
        return np.prod((np.abs(4 * x - 2) + a) / (1 + a), axis=-1)

    V = 1 / (3 * (1 + a) ** 2)
    whole = np.prod(1 + V) - 1
    return IndexProblem(
        lambda u: u, response, V / whole, V * np.prod(1 + V) / (1 + V) / whole
    )


WEIGHTS = np.array([3.0, 2.0, 1.0, 0.5])


def _linear():
    """A dimension chain of normal parts."""
    first = WEIGHTS**2 / np.sum(WEIGHTS**2)
    return IndexProblem(ndtri, lambda x: x @ WEIGHTS, first, first)


GAP = 2.9  # sigmas: one machine in 25 jams


def _rare_jam():
    """Two rods that fight each other once they differ by more than the gap."""
    x = np.linspace(-9, 9, 20_001)
    density = norm.pdf(x)

    def mean_excess(a):
        return norm.pdf(a) + a * norm.cdf(a)

    def average(y):
        return trapezoid(y * density, x)

    given = mean_excess(x - GAP) + mean_excess(-x - GAP)
    difference = np.sqrt(2) * x
    excess = np.maximum(np.abs(difference) - GAP, 0)
    V = average(excess**2) - average(excess) ** 2
    V1 = average(given**2) - average(given) ** 2
    first = np.array([V1, V1, 0]) / V
    total = np.array([1 - first[0], 1 - first[0], 0])

    def response(x):
        return np.maximum(np.abs(x[..., 0] - x[..., 1]) - GAP, 0)

    return IndexProblem(ndtri, response, first, total)


OTHER = 0.1  # of a part that hardly matters


def _one_decides():
    """A part that pushes but does not pull, and hardly anything beside it."""
    V = np.array([1 / 2 - 1 / (2 * np.pi), OTHER**2])
    first = V / V.sum()

    def response(x):
        return np.maximum(x[..., 0], 0) + OTHER * x[..., 1]

    return IndexProblem(ndtri, response, first, first)


ALIKE = {"two of a batch": 0.6, "two nearly equal": 0.95}  # correlation of two parts


def _of_a_batch(alike):
    """The same chain, of which two parts hang together."""
    r = np.eye(4)
    r[0, 1] = r[1, 0] = alike
    mixed = np.linalg.cholesky(r).T
    V = WEIGHTS @ r @ WEIGHTS
    first = (r @ WEIGHTS) ** 2 / V
    return IndexProblem(
        lambda u: ndtri(u) @ mixed,
        lambda x: x @ WEIGHTS,
        first,
        np.full(4, np.nan),
        independent=False,
    )


CURVED = 0.05  # of the square beside the linear term: 99.3 % are linear


def _nearly_linear():
    """A stack with a curve in one part and an interaction of two others."""
    a, c = WEIGHTS, CURVED * np.linalg.norm(WEIGHTS)

    def response(x):
        return x @ a + c * (x[..., 3] ** 2 + x[..., 0] * x[..., 1])

    V = a**2 + c**2 * np.array([0, 0, 0, 2])
    total = V + c**2 * np.array([1, 1, 0, 0])
    whole = V.sum() + c**2
    return IndexProblem(ndtri, response, V / whole, total / whole)


THIRD = 1.5  # sigmas of a third part in the way of two rods


def _rare_jam_of_three():
    """Two rods that fight each other, and a third part in the same gap."""
    gap = GAP * np.sqrt((2 + THIRD**2) / 2)
    z = np.linspace(-9, 9, 20_001)

    def share_of(known, rest):
        """Share that is owed to what has this variance, the rest having that."""
        s = np.sqrt(rest)
        a = np.sqrt(known) * z

        def mean_excess(a):
            return s * norm.pdf(a / s) + a * norm.cdf(a / s)

        given = mean_excess(a - gap) + mean_excess(-a - gap)
        return moments_of(given)[1]

    def moments_of(y):
        mean = trapezoid(y * norm.pdf(z), z)
        return mean, trapezoid(y**2 * norm.pdf(z), z) - mean**2

    V = moments_of(np.maximum(np.abs(np.sqrt(2 + THIRD**2) * z) - gap, 0))[1]
    alone = [share_of(1, 1 + THIRD**2)] * 2 + [share_of(THIRD**2, 2)]
    others = [share_of(1 + THIRD**2, 1)] * 2 + [share_of(2, THIRD**2)]

    def response(x):
        apart = x[..., 0] - x[..., 1] + THIRD * x[..., 2]
        return np.maximum(np.abs(apart) - gap, 0)

    return IndexProblem(ndtri, response, np.array(alone) / V, 1 - np.array(others) / V)


RARE, JUMP = 0.002, 20.0  # share of the machines that another part throws far off


def _rare_cause():
    """A plain part, and another that matters in 2 of 1000 machines alone."""
    end = norm.isf(RARE)
    jump = RARE * (1 - RARE) * JUMP**2
    first = np.array([1, jump]) / (1 + jump)

    def response(x):
        return x[..., 0] + JUMP * (x[..., 1] > end)

    return IndexProblem(ndtri, response, first, first)


def _product_and_exponential():
    """The product of two parts and the exponential of a third."""
    V = np.array([0.0, 0.0, (np.e - 1) * np.e])
    total = V + np.array([1, 1, 0])

    def response(x):
        return x[..., 0] * x[..., 1] + np.exp(x[..., 2])

    return IndexProblem(ndtri, response, V / (V.sum() + 1), total / (V.sum() + 1))


FAST = 30.0  # radians of a sine


def _fast_sine():
    """A sine of five periods, and two plain parts."""
    mean = (1 - np.cos(FAST)) / FAST
    V = np.array([0.5 - np.sin(2 * FAST) / (4 * FAST) - mean**2, 0.25 / 12, 0.09 / 12])

    def response(x):
        return np.sin(FAST * x[..., 0]) + 0.5 * x[..., 1] + 0.3 * x[..., 2]

    return IndexProblem(lambda u: u, response, V / V.sum(), V / V.sum())


INDEX_PROBLEMS = {
    "2 in 1000 of another cause": _rare_cause(),
    "rare jam": _rare_jam(),
    "rare jam of three": _rare_jam_of_three(),
    "linear stack": _linear(),
    "nearly linear": _nearly_linear(),
    **{name: _of_a_batch(alike) for name, alike in ALIKE.items()},
    "product and exponential": _product_and_exponential(),
    "fast sine": _fast_sine(),
    "one decides": _one_decides(),
    "Ishigami": _ishigami(),
    "Sobol' G": _sobol_g(),
}


# closed indices of the first two contributors: with what they do to each other
TWO = {
    "linear stack": float(INDEX_PROBLEMS["linear stack"].first[:2].sum()),
    **{
        name: 1
        - (WEIGHTS[2:] @ WEIGHTS[2:])
        / (WEIGHTS @ WEIGHTS + 2 * alike * WEIGHTS[0] * WEIGHTS[1])
        for name, alike in ALIKE.items()
    },
    "Ishigami": float(INDEX_PROBLEMS["Ishigami"].first[:2].sum()),
    "rare jam": 1.0,
    "rare jam of three": 1 - float(INDEX_PROBLEMS["rare jam of three"].total[2]),
    "product and exponential": 1 / (1 + (np.e - 1) * np.e),
}
POINTS = 18  # powers of two, for what has no closed form


@cache
def whole(name):
    """Return first and total indices, and the closed one of the first two."""
    problem = INDEX_PROBLEMS[name]
    return problem.first, problem.total, TWO.get(name)


@cache
def central(name):
    """Return the same of the response clipped to its central 99 %.

    By pick and freeze with Sobol' points. A normal response that depends on correlated
    parts is two normal numbers for each part, whose correlation is its index.
    """
    first, total, two = whole(name)
    if not INDEX_PROBLEMS[name].independent:
        u = ndtri(qmc.Sobol(2, rng=75).random_base2(POINTS))
        end = norm.ppf(0.995)

        def of(r):
            other = r * u[:, 0] + np.sqrt(1 - r**2) * u[:, 1]
            y, z = u[:, 0].clip(-end, end), other.clip(-end, end)
            return np.mean(y * z) / y.var()

        return np.array([of(r) for r in first]), total, of(two)
    problem, k = INDEX_PROBLEMS[name], len(first)
    u = qmc.Sobol(2 * k, rng=75).random_base2(POINTS)
    A, B = u[:, :k], u[:, k:]
    y, z = (problem.response(problem.deviations(each)) for each in (A, B))
    ends = np.quantile(np.append(y, z), [0.005, 0.995])
    y, z = y.clip(*ends), z.clip(*ends)
    mean, V = (y + z).mean() / 2, (y.var() + z.var()) / 2

    def with_from_A(columns):
        mixed = B.copy()
        mixed[:, columns] = A[:, columns]
        return problem.response(problem.deviations(mixed)).clip(*ends)

    every = [with_from_A([i]) for i in range(k)]
    first = [np.mean((y - mean) * (of - z)) / V for of in every]
    total = [np.mean((z - of) ** 2) / 2 / V for of in every]
    two = np.mean((y - mean) * (with_from_A([0, 1]) - z)) / V
    return np.array(first), np.array(total), two


def design(problem, rng, n):
    """Return the responses of Saltelli's design, and the surface of its groups.

    float64[n, 2 + factor].
    """
    k = len(problem.first)
    unit = np.stack([rng.random((n, k)) for _ in "AB"], axis=1)
    A, B = (problem.deviations(unit[:, i]) for i in range(2))
    x = np.repeat(A[:, None, :], k + 2, axis=1)
    x[:, 1] = B
    for i in range(k):
        x[:, 2 + i, i] = B[:, i]
    normal = [like_normal(x[:, 0, i], unit[:, 0, i]) for i in range(k)]
    return problem.response(x), GroupSurface(unit, np.array(normal))


def intervals(name, rng, n):
    """Yield problem, statistic, estimate, truth and whether it is exact, of a study."""
    for each, found, truth in _intervals(name, rng, n):
        yield name, each, found, truth, False


def _intervals(name, rng, n):
    problem = INDEX_PROBLEMS[name]
    k = len(problem.first)
    names = [f"x{i + 1}" for i in range(k)]
    x = problem.deviations(rng.random((n, k)))
    y = problem.response(x)
    hand = contributions(
        dict(zip(names, x.T, strict=True)),
        {"y": y},
        {"all": names, "two": names[:2]},
        independent=problem.independent,
    )["y"]
    alone, _, two = (central if hand.clipped else whole)(name)
    for i, each in enumerate(names):
        yield f"first order of {each}, at hand", hand.first_order[each], alone[i]
    if problem.independent:
        made_of, surface = design(problem, rng, n)
        made = dict(zip(names, sobol_indices(made_of, surface), strict=True))
        light = clipped(made_of, made_of[:, :2]).light
        firsts, totals, _ = (whole if light else central)(name)
        for i, each in enumerate(names):
            yield f"first order of {each}, saltelli", made[each].first, firsts[i]
            yield f"total of {each}, saltelli", made[each].total, totals[i]
    yield "first orders together", hand.groups["all"], alone.sum()
    yield "all together", hand.together["all"], 1.0
    if name in TWO:
        yield "x1 and x2 together", hand.together["two"], two
    yield "unexplained", hand.unexplained, 1 - alone.sum()
    if name == "linear stack" or not problem.independent:
        ranks = of_ranks(np.sqrt(problem.first))
        parts = np.eye(k)
        parts[0, 1] = parts[1, 0] = 0 if problem.independent else of_ranks(ALIKE[name])
        coefficients = np.linalg.solve(parts, ranks)
        for each, truth in zip(names, coefficients, strict=True):
            yield f"rank regression on {each}", hand.rank_regression[each], truth
        yield "rank regression explains", hand.explained, coefficients @ ranks


def of_ranks(correlation):
    """Return Spearman's rank correlation of normal variables of a correlation."""
    return 6 / np.pi * np.arcsin(correlation / 2)


SEEN = 10_000  # trials from which a cause of 2 in 1000 is no rarer one than those seen
STUDIES = {50: 100, 200: 1000, 1000: 400, 10_000: 40}
JOBS = [
    (name, n, intervals, STUDIES[n])
    for name in INDEX_PROBLEMS
    for n in SIZES
    if n >= SEEN or name != "2 in 1000 of another cause"
]
