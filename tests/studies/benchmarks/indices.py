"""Sobol' indices at equal runs: `sampling = "saltelli"` and SALib on seven functions.

    python -m tests.studies.benchmarks.indices         # 200 studies of each function
    python -m tests.studies.benchmarks.indices 10      # a first look

SALib draws its groups from scrambled Sobol' points, as it recommends. Errors are root
mean squares over studies and factors. "held" is the share of intervals that hold the
truth, to the rounding of nine decimals. True indices come from closed forms or from
Gauss quadrature over all factors. Written to indices.csv.
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from SALib.analyze import sobol as salib
from SALib.sample import sobol as salib_sample
from scipy.special import ndtr, ndtri

from tests.studies.coverage.index_problems import INDEX_PROBLEMS
from tolstat.deviations.samplers import Saltelli
from tolstat.statistics.sensitivity.group_surface import GroupSurface
from tolstat.statistics.sensitivity.sobol_indices import sobol_indices

TABLE = Path(__file__).with_name("indices.csv")
GROUPS, STUDIES = 1024, 200
ROUNDING = 1e-9


class Function(NamedTuple):
    """A response of unit samples[..., factor], and nodes that integrate its square."""

    response: object
    nodes: list  # of each factor: how many, or the unit samples of two
    closed: tuple | None = None


def scaled(u, *bounds):
    """Return the factors between their bounds."""
    lower, upper = np.array(bounds).T
    return np.moveaxis(lower + u * (upper - lower), -1, 0)


A = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0])


def sobol_g(u):
    """A. Saltelli, I. M. Sobol' (1995)."""
    return np.prod((np.abs(4 * u - 2) + A) / (1 + A), axis=-1)


def indices_of_g():
    """Return first and total indices."""
    V = 1 / (3 * (1 + A) ** 2)
    variance = np.prod(1 + V) - 1
    return V / variance, V * np.prod(1 + V) / (1 + V) / variance


def ishigami(u):
    """T. Ishigami, T. Homma (1990)."""
    return INDEX_PROBLEMS["Ishigami"].response(np.pi * (2 * u - 1))


def borehole(u):
    """W. V. Harper, S. K. Gupta (1983)."""
    radius = 0.1 + 0.0161812 * ndtri(u[..., 0])
    influence = np.exp(7.71 + 1.0056 * ndtri(u[..., 1]))
    Tu, Hu, Tl, Hl, L, K = scaled(
        u[..., 2:], (63070, 115600), (990, 1110), (63.1, 116), (700, 820),
        (1120, 1680), (9855, 12045),
    )  # fmt: skip
    ratio = np.log(influence / radius)
    resistance = 1 + 2 * L * Tu / (ratio * radius**2 * K) + Tu / Tl
    return 2 * np.pi * Tu * (Hu - Hl) / (ratio * resistance)


def piston(u):
    """R. Kenett, S. Zacks (1998): cycle time."""
    M, S, V0, k, P0, Ta, T0 = scaled(
        u, (30, 60), (0.005, 0.02), (0.002, 0.01), (1000, 5000), (90000, 110000),
        (290, 296), (340, 360),
    )  # fmt: skip
    force = P0 * S + 19.62 * M - k * V0 / S
    V = S / (2 * k) * (np.sqrt(force**2 + 4 * k * P0 * V0 / T0 * Ta) - force)
    return 2 * np.pi * np.sqrt(M / (k + S**2 * P0 * V0 / T0 * Ta / V**2))


def otl_circuit(u):
    """E. N. Ben-Ari, D. M. Steinberg (2007): midpoint voltage."""
    b1, b2, f, c1, c2, beta = scaled(
        u, (50, 150), (25, 70), (0.5, 3), (1.2, 2.5), (0.25, 1.2), (50, 300)
    )
    base, gain = 12 * b2 / (b1 + b2), beta * (c2 + 9)
    return (
        (base + 0.74) * gain + 11.35 * f + 0.74 * f * gain / c1
    ) / (gain + f)  # fmt: skip


def wing_weight(u):
    """A. Forrester, A. Sobester, A. Keane (2008)."""
    Sw, Wfw, aspect, sweep, q, taper, thickness, N, Wdg, Wp = scaled(
        u, (150, 200), (220, 300), (6, 10), (-10, 10), (16, 45), (0.5, 1),
        (0.08, 0.18), (2.5, 6), (1700, 2500), (0.025, 0.08),
    )  # fmt: skip
    c = np.cos(np.deg2rad(sweep))
    return (
        0.036 * Sw**0.758 * Wfw**0.0035 * (aspect / c**2) ** 0.6 * q**0.006
        * taper**0.04 * (100 * thickness / c) ** -0.3 * (N * Wdg) ** 0.49 + Sw * Wp
    )  # fmt: skip


BENT = [2, 4, 6]  # factors of Morris's function that enter by a hyperbola


def morris(u):
    """M. D. Morris (1991), its coefficients for twenty factors without their noise."""
    w = 2 * (u - 0.5)
    w[..., BENT] = 2 * (1.1 * u[..., BENT] / (u[..., BENT] + 0.1) - 0.5)
    i = np.arange(1, 21)
    single = np.where(i <= 10, 20.0, (-1.0) ** i)
    both = (i[:, None] <= 6) & (i <= 6)
    pairs = np.triu(np.where(both, -15.0, (-1.0) ** (i[:, None] + i)), 1)
    five = w[..., :5]
    sums = [np.sum(five**power, axis=-1) for power in (1, 2, 3)]
    # of all products of three of five
    triples = (sums[0] ** 3 - 3 * sums[0] * sums[1] + 2 * sums[2]) / 6
    quadruple = np.prod(w[..., :4], axis=-1)
    return (
        w @ single + np.sum(w @ pairs * w, axis=-1) - 10 * triples + 5 * quadruple
    )  # fmt: skip


def nodes_of_morris():
    """Return two nodes of each factor with its mean and variance: it is multilinear."""
    x, weights = np.polynomial.legendre.leggauss(60)
    u = (x + 1) / 2
    w = 2 * (1.1 * u / (u + 0.1) - 0.5)
    mean = w @ weights / 2
    ends = mean + np.array([-1, 1]) * np.sqrt((w - mean) ** 2 @ weights / 2)
    bent = 0.1 * (ends + 1) / 2 / (1.1 - (ends + 1) / 2)
    return [bent if factor in BENT else 2 for factor in range(20)]


ISHIGAMI = INDEX_PROBLEMS["Ishigami"]
FUNCTIONS = {
    "Ishigami": Function(ishigami, [0] * 3, (ISHIGAMI.first, ISHIGAMI.total)),
    "Sobol' g": Function(sobol_g, [0] * 8, indices_of_g()),
    "borehole": Function(borehole, [-14, -8, 4, 2, 5, 2, 6, 6]),
    "piston": Function(piston, [8, 12, 10, 10, 5, 3, 3]),
    "OTL circuit": Function(otl_circuit, [8, 9, 8, 8, 5, 12]),
    "wing weight": Function(wing_weight, [5, 2, 5, 5, 3, 3, 7, 6, 4, 2]),
    "Morris": Function(morris, nodes_of_morris()),
}


@cache
def truth(name):
    """Return first and total indices: float64[2, factor]."""
    function = FUNCTIONS[name]
    if function.closed:
        return np.array(function.closed)
    rules = [_rule(nodes) for nodes in function.nodes]
    grid = np.stack(np.meshgrid(*(u for u, _ in rules), indexing="ij"), axis=-1)
    y = function.response(grid)
    y = y - y.mean()

    def mean_over(values, axes):
        for axis in sorted(axes, reverse=True):
            values = np.tensordot(values, rules[axis][1], (axis, 0))
        return values

    factors = range(len(rules))
    mean = mean_over(y, factors)
    V = mean_over(y**2, factors) - mean**2
    first, total = [], []
    for i in factors:
        alone = mean_over(y, [j for j in factors if j != i])
        first.append((alone - mean) ** 2 @ rules[i][1] / V)
        others = mean_over(y, [i])
        square = others**2
        for j in reversed([j for j in factors if j != i]):
            square = np.tensordot(square, rules[j][1], (square.ndim - 1, 0))
        total.append(1 - (square - mean**2) / V)
    return np.array([first, total])


def _rule(nodes):
    """Return unit samples and weights of a Gauss rule; below 0: of a normal factor."""
    if np.ndim(nodes):
        return nodes, np.array([0.5, 0.5])
    if nodes < 0:
        z, weights = np.polynomial.hermite_e.hermegauss(-nodes)
        return ndtr(z), weights / weights.sum()
    x, weights = np.polynomial.legendre.leggauss(nodes)
    return (x + 1) / 2, weights / 2


def study(name, seed):
    """Return errors of SALib and of tolstat, and what holds: [2, factor] of each."""
    response, known = FUNCTIONS[name].response, truth(name)
    k = known.shape[1]
    names = [f"x{i}" for i in range(k)]
    problem = {"num_vars": k, "names": names, "bounds": [[0, 1]] * k}
    points = salib_sample.sample(problem, GROUPS, calc_second_order=False, seed=seed)
    theirs = salib.analyze(
        problem, response(points.clip(1e-12, 1 - 1e-12)), calc_second_order=False,
        num_resamples=2, seed=1,
    )  # fmt: skip
    streams = {name: i for i, name in enumerate(names)}
    unit = Saltelli().unit_samples(seed, streams, GROUPS * (k + 2))
    y = response(unit).reshape(GROUPS, -1)
    normal = np.array([np.ndim(n) == 0 and n < 0 for n in FUNCTIONS[name].nodes])
    surface = GroupSurface(Saltelli().pairs(seed, names, GROUPS), normal)
    ours = np.array([[index[:3] for index in x] for x in sobol_indices(y, surface)])
    value, lower, upper = ours.transpose(2, 1, 0)
    held = (lower - ROUNDING <= known) & (known <= upper + ROUNDING)
    return np.array([theirs["S1"], theirs["ST"]]) - known, value - known, held


def main(studies):
    """Measure all functions."""
    rows = []
    for name in FUNCTIONS:
        k = truth(name).shape[1]
        results = [study(name, seed) for seed in range(studies)]
        theirs, ours, held = map(np.array, zip(*results, strict=True))
        row = {"function": name, "factors": k, "runs": GROUPS * (k + 2)}
        row["studies"] = studies
        for i, kind in enumerate(("first", "total")):
            for words, errors in (("SALib", theirs), ("tolstat", ours)):
                error = np.sqrt(np.mean(errors[:, i] ** 2))
                row[f"{words} {kind}"] = float(f"{error:.2g}")
        for i, kind in enumerate(("first", "total")):
            row[f"held {kind}, %"] = round(100 * held[:, i].mean(), 1)
        rows.append(row)
        print(row, file=sys.stderr, flush=True)
    pd.DataFrame(rows).to_csv(TABLE, index=False)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else STUDIES)
