"""Responses with known answers once their parts come from other distributions."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.stats import lognorm, norm

from tests.studies.coverage.halving_problems import of_scores
from tolstat.deviations.density_ratio import DensityRatio, check_overlap, overlap_of
from tolstat.deviations.dependence import Batch, Dependence, joined
from tolstat.deviations.distributions import Normal, Tolerance
from tolstat.statistics.intervals.moments import Reach
from tolstat.statistics.intervals.weights import Weights
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import yield_of
from tolstat.statistics.sample import Sample, for_any, quantiles_at
from tolstat.statistics.summary import by_moments, by_percentiles
from tolstat.status import Status


class WeightingProblem(NamedTuple):
    """Sigmas and means of normal parts, drawn and new, and what hangs together."""

    drawn: tuple
    new: tuple
    dependence: Dependence
    correlation: float = 0.0  # of the normal scores of the first two


RANK = 0.6
TOGETHER = Dependence({}, {("x1", "x2"): RANK})
BATCH = Dependence({"x1": Batch("x", 0.5), "x2": Batch("x", 0.5)})
ALIKE = Dependence({"x1": Batch("x", 1.0), "x2": Batch("x", 1.0)})
UNIT = (1.0, 0.0)  # sigma and mean

PROBLEMS = {
    "two halved": WeightingProblem((UNIT,) * 3, ((0.5, 0.0),) * 2, Dependence()),
    "one shifted": WeightingProblem((UNIT,) * 2, ((1.0, 0.7),), Dependence()),
    "two shifted back": WeightingProblem((UNIT,) * 2, ((1.0, -0.5),) * 2, Dependence()),
    "one wider": WeightingProblem((UNIT,) * 2, ((1.2, 0.0),), Dependence()),
    "one far wider": WeightingProblem((UNIT,), ((1.35, 0.0),), Dependence()),
    "narrower, shifted": WeightingProblem((UNIT,) * 2, ((0.7, 0.4),), Dependence()),
    "correlated, one narrower": WeightingProblem(
        (UNIT,) * 2, ((0.7, 0.0),), TOGETHER, of_scores(RANK)
    ),
    "of a batch, both halved": WeightingProblem(
        (UNIT,) * 2, ((0.5, 0.0),) * 2, BATCH, 0.5
    ),
    "all alike, halved": WeightingProblem(
        (UNIT,) * 2, ((0.5, 0.0),) * 2, ALIKE, 1.0
    ),
}  # fmt: skip


def _part(sigma_and_mean):
    s, m = sigma_and_mean
    return Normal(Tolerance(m - 3 * s, m + 3 * s))


@cache
def _made(name, n):
    """Return distributions, new ones, the truth of the sum, and what weights cover."""
    problem = PROBLEMS[name]
    drawn = {f"x{i + 1}": _part(each) for i, each in enumerate(problem.drawn)}
    new = {f"x{i + 1}": _part(each) for i, each in enumerate(problem.new)}
    for each, part in new.items():
        check_overlap(drawn[each], part)
    then = [*problem.new, *problem.drawn[len(problem.new) :]]
    s, m = np.array(then).T
    variance = np.sum(s**2)
    if problem.correlation:
        variance += 2 * problem.correlation * s[0] * s[1]
    known = norm(m.sum(), np.sqrt(variance))
    return drawn, new, known, overlap_of(drawn, problem.dependence, new, n)


SHARES = (0.05, 0.5, 0.95, 0.99)
BEYOND = (0.003, 0.05)
SKEW = 0.3  # of the sum, before it becomes an exponent


def intervals(name, rng, n):
    """Yield problem, statistic, estimate, truth and whether it is exact, of a study."""
    problem = PROBLEMS[name]
    drawn, new, known, cover = _made(name, n)
    if cover.efficiency * n < 150:
        return
    factors = [*drawn, *{batch.name for batch in problem.dependence.batches.values()}]
    unit = joined({each: rng.random(n) for each in factors}, problem.dependence)
    x = {k: each.deviations(unit[k]) for k, each in drawn.items()}
    ratio = DensityRatio(x, drawn, problem.dependence).weights(new)
    weights = Weights(ratio, cover.most, cover.cut)
    sample = Sample(np.full(n, Status.DONE), weights=weights)
    y = sum(x.values())
    m, s = known.mean(), known.std()
    skew = lognorm(SKEW * s, scale=np.exp(SKEW * m))
    for words, values, truth in (("", y, known), (", skew", np.exp(SKEW * y), skew)):
        limit = Limit(-np.inf, truth.isf(BEYOND[0]))
        reach = Reach(limit=limit.permitted)

        def of(words, found, true, end=words):
            return name, f"weighted {words}{end}", found, true, False

        mean, sigma = for_any(values, sample, reach)
        yield of("mean", mean, truth.mean())
        yield of("sigma", sigma, truth.std())
        for share, found in quantiles_at(values, sample, SHARES).items():
            yield of(f"quantile {share}", found, truth.ppf(share))
        ppk = (limit.upper - truth.mean()) / (3 * truth.std())
        yield of("Ppk by moments", by_moments(values, sample, limit).ppk, ppk)
        half, far = truth.ppf(0.5), truth.isf(0.00135)
        ppk = (limit.upper - half) / (far - half)
        yield of("Ppk by percentiles", by_percentiles(values, sample, limit).ppk, ppk)
    for share in BEYOND:
        end = f", {100 * share:g} %"
        found = yield_of(y, sample, (-np.inf, known.isf(share)))
        yield (
            name,
            f"weighted share beyond{end}",
            found.fraction_out_of_limit,
            share,
            False,
        )
        found = yield_of(y, sample, (known.isf(share), np.inf))
        yield name, f"weighted share within{end}", found.within, share, False


STUDIES = {400: 400, 4096: 100}
JOBS = [(name, n, intervals, STUDIES[n]) for name in PROBLEMS for n in STUDIES]
