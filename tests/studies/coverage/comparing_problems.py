"""Two designs whose differences are known: paired by quality, in part, or not."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.stats import norm

from tests.studies.coverage.problems import SIZES
from tolstat.statistics.intervals.moments import mean_of
from tolstat.statistics.intervals.quantiles import quantiles
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.limits.difference import (
    correlation_of_quantiles,
    correlation_of_shares,
    difference,
    difference_of_ppk,
    exchange,
)
from tolstat.statistics.limits.limit import Limit, ppk_of
from tolstat.statistics.summary import by_share

# response of the first and of the second design over the quality, and the limit
DESIGNS = {
    "narrower": (lambda z: z, lambda z: 0.7 * z + 0.1, 2.6),
    "narrower, skewed": (np.exp, lambda z: np.exp(0.8 * z), np.exp(2.5)),
    "the other way": (lambda z: z, lambda z: -0.9 * z, 2.3),
    "jams less": (
        lambda z: np.maximum(np.abs(z) - 2.0, 0.0),
        lambda z: np.maximum(np.abs(0.9 * z) - 2.0, 0.0),
        0.4,
    ),
}
ALIKE = {"one quality": 1.0, "nearly one": 0.98, "in part": 0.6, "unpaired": 0.0}
SHARES = (0.5, 0.95)
WORDS = {True: "of two designs, paired", False: "of two designs, unpaired"}


@cache
def truths(name):
    """Return what each design is like, by 2e6 machines in even steps of quality."""
    first, second, end = DESIGNS[name]
    z = norm.ppf((np.arange(2_000_000) + 0.5) / 2_000_000)
    found = []
    for y in (first(z), second(z)):
        beyond = float((y > end).mean())
        found.append(
            {
                "mean": y.mean(),
                **{f"quantile {s:g}": np.quantile(y, s) for s in SHARES},
                "share beyond": beyond,
                "Ppk by share": ppk_of(beyond, 1),
                "Ppk by moments": (end - y.mean()) / (3 * y.std()),
            }
        )
    return {each: found[1][each] - found[0][each] for each in found[0]}


def _drawn(problem, rng, n):
    """Draw the machines of a study in both designs."""
    name, alike = problem.split(": ")
    (first, second, end), r = DESIGNS[name], ALIKE[alike]
    z, other = rng.normal(size=(2, n))
    return first(z), second(r * z + np.sqrt(1 - r**2) * other), end


def of_moments(problem, rng, n):
    """Yield what is said of Ppk by moments."""
    name, alike = problem.split(": ")
    first, second, end = _drawn(problem, rng, n)
    limit = Limit(-np.inf, end)
    found = difference_of_ppk(first, second, (limit, limit))
    known = truths(name)["Ppk by moments"]
    yield problem, f"Ppk by moments, {WORDS[alike != 'unpaired']}", found, known, False


def intervals(problem, rng, n):
    """Yield problem, statistic, estimate, truth and whether it is exact, of a study."""
    name, alike = problem.split(": ")
    r, (first, second, end) = ALIKE[alike], _drawn(problem, rng, n)
    good, limit = (first <= end, second <= end), Limit(-np.inf, end)
    shares = [proportion(int((~each).sum()), n) for each in good]
    ppks = [by_share(each, limit) for each in shares]
    a, b = (quantiles(y, SHARES) for y in (first, second))
    together, found = 0.0, {}
    if r:
        together = correlation_of_shares(*good)
        found["share beyond"] = exchange(*good).out_of_limit
    else:
        found["share beyond"] = difference(*shares)
        found["mean"] = difference(mean_of(first), mean_of(second))
    found["Ppk by share"] = difference(*ppks, together)
    for share in SHARES:
        of = a[share], b[share]
        near = correlation_of_quantiles(first, second, of) if r else 0.0
        found[f"quantile {share:g}"] = difference(*of, near)
    words = WORDS[r > 0]
    for each, estimate in found.items():
        exact = each == "share beyond" and r > 0
        yield problem, f"{each}, {words}", estimate, truths(name)[each], exact


PROBLEMS = [f"{name}: {alike}" for name in DESIGNS for alike in ALIKE]
STUDIES = {50: 600, 200: 600, 1000: 600, 10_000: 300}
OF_MOMENTS = {1000: 4000, 10_000: 600}
JOBS = [
    *((name, n, intervals, STUDIES[n]) for name in PROBLEMS for n in SIZES),
    *((name, n, of_moments, OF_MOMENTS[n]) for name in PROBLEMS for n in OF_MOMENTS),
]
