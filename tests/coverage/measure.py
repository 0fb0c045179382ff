"""How often intervals cover what they claim: written to tests/coverage/table.csv.

    python -m tests.coverage.measure          # 1.5 hours of processor time

Exact intervals may miss too seldom, but not too often; approximate ones are offered
only where they cover at least 93 % on every problem. "offered" is the share of studies
that got an interval, "covered" the share of these that hold the truth, "missed" the
share of all studies that print an interval without it.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import ndtr, ndtri

from tests.coverage.index_problems import INDEX_PROBLEMS
from tests.coverage.index_problems import intervals as of_indices
from tests.coverage.problems import PROBLEMS, SIZES
from tolstat.deviations.samplers.latin import REPLICATES, Latin
from tolstat.deviations.samplers.sobol import Sobol
from tolstat.statistics.capability import by_moments, by_percentiles
from tolstat.statistics.moments import mean_of, sigma_of
from tolstat.statistics.precision import FIRST, Precision, next_stage
from tolstat.statistics.proportions import proportion
from tolstat.statistics.quantiles import quantile
from tolstat.statistics.sample import Sample
from tolstat.statistics.statistic import (
    Statistic,
    mean,
    quantile_at,
    sigma,
    yields,
)
from tolstat.statistics.tails import upper_tail
from tolstat.status import Status

TABLE = Path(__file__).with_name("table.csv")
STUDIES = 4000
EVERY = sorted([*PROBLEMS, *INDEX_PROBLEMS])
ALL = "all"
TIMES = (1, 10, 100)  # how far beyond the trials tails are extrapolated
WITHIN = 0.05  # precision asked of the stopping rule
STOPPED = f"quantile 0.95 until +-{WITHIN:.0%}"
LIMIT = 0.995  # the limit stands where this share of the machines is within


@cache
def far(name, size):
    """Return the values that one machine in N, 10 N and 100 N exceeds."""
    return {times: PROBLEMS[name].quantile(1 - 1 / (times * size)) for times in TIMES}


@cache
def statistics(name):
    """Name each interval, how to compute it, and its true value."""
    problem = PROBLEMS[name]
    end = problem.quantile(LIMIT)
    middle, far = problem.quantile(0.5), problem.quantile(0.99865)
    found = {
        f"quantile {share:g}": (
            lambda x, share=share: quantile(x, share), problem.quantile(share), True,
        )
        for share in (0.00135, 0.05, 0.5, 0.95, 0.99, 0.99865)
    }  # fmt: skip
    found["share beyond"] = (
        lambda x: proportion(int((x > end).sum()), len(x)),
        float(1 - problem.cdf(end)), True,
    )  # fmt: skip
    found["mean"] = (mean_of, problem.mean, False)
    found["sigma"] = (sigma_of, problem.sigma, False)
    found["Ppk by percentiles"] = (
        lambda x: by_percentiles(x, (-np.inf, end)).ppk,
        float((end - middle) / (far - middle)), True,
    )  # fmt: skip
    found["Ppk by moments"] = (
        lambda x: by_moments(x, (-np.inf, end)).ppk,
        float((end - problem.mean) / (3 * problem.sigma)), False,
    )  # fmt: skip
    return found


def intervals(name, rng, size):
    """Yield problem, statistic, estimate, truth and whether it is exact, of a study."""
    if name in INDEX_PROBLEMS:
        for each, found, truth in of_indices(name, rng, size):
            yield name, each, found, truth, False
        return
    problem = PROBLEMS[name]
    x = problem.draw(rng, size)
    for each, (interval, truth, exact) in statistics(name).items():
        yield name, each, interval(x), truth, exact
    tail = upper_tail(x)
    for times, truth in far(name, size).items():
        found = tail.exceeded_by(1 / (times * size))
        yield name, f"tail, 1 in {times} N", found, truth, False


def stopped(name, rng, size):
    """Yield the interval with which a stopping rule ends."""
    problem = PROBLEMS[name]
    rule = Precision(Statistic("y", "quantile", 0.95), WITHIN, True)
    x = np.empty(0)
    while size:
        x = np.concatenate([x, problem.draw(rng, size - len(x))])
        sample = Sample(np.full(len(x), Status.DONE))
        size = next_stage([rule], {"y": x}, sample, {})
    yield name, STOPPED, quantile(x, 0.95), problem.quantile(0.95), False


def replicated(_, rng, size):
    """Yield intervals of Latin hypercube and Sobol' trials, for all problems."""
    streams = {"a": 0, "b": 1, "c": 2}
    sample = Sample(np.full(size, Status.DONE), REPLICATES)
    for sampler in (Latin(), Sobol()):
        u = sampler.unit_samples(int(rng.integers(2**62)), streams, size)
        u = ndtr(ndtri(u).sum(axis=1) / np.sqrt(3))
        for name, problem in PROBLEMS.items():
            y = problem.inverse(u)
            of_all = statistics(name)
            for each, found in _of_replicates(y, sample, name).items():
                words = f"{each}, {type(sampler).__name__.lower()}"
                yield name, words, found, of_all[each][1], False


def _of_replicates(y, sample, name):
    """Estimate what has an interval from replicates."""
    found = {"mean": mean(y, sample), "sigma": sigma(y, sample)}
    for share in (0.05, 0.5, 0.95, 0.99):
        found[f"quantile {share:g}"] = quantile_at(y, sample, share)
    limit = (-np.inf, PROBLEMS[name].quantile(LIMIT))
    found["share beyond"] = yields(y, sample, limit).beyond
    return found


def measure(name, size, studies, seed=75, of=intervals):
    """Return one row for each interval on one problem, or on all, at one size."""
    rng = np.random.default_rng([seed, size, [*EVERY, ALL].index(name)])
    counts, exact = {}, {}
    for _ in range(studies):
        for problem, each, found, truth, exactly in of(name, rng, size):
            exact[each] = exactly
            count = counts.setdefault((problem, each), [0, 0])
            if np.isnan(found.lower) or np.isnan(found.upper):
                continue
            count[0] += 1
            count[1] += found.lower <= truth <= found.upper
    return [
        {
            "problem": problem,
            "trials": size,
            "statistic": each,
            "exact": exact[each],
            "studies": studies,
            "offered": round(offered / studies, 4),
            "covered": round(covered / offered, 4) if offered else np.nan,
            "missed": round((offered - covered) / studies, 4),
        }
        for (problem, each), (offered, covered) in counts.items()
    ]


def main():
    """Measure everything and write the table."""
    jobs = [(name, size, intervals) for name in EVERY for size in SIZES]
    jobs += [(name, FIRST, stopped) for name in PROBLEMS]
    jobs += [(ALL, size, replicated) for size in SIZES[1:]]
    rows = []
    with ProcessPoolExecutor() as workers:
        found = [workers.submit(measure, *job[:2], STUDIES, of=job[2]) for job in jobs]
        for (name, size, _), each in zip(jobs, found, strict=True):
            rows += each.result()
            print(f"{name}, {size} trials", file=sys.stderr, flush=True)
    pd.DataFrame(rows).to_csv(TABLE, index=False)


if __name__ == "__main__":
    main()
