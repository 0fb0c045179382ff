"""Rare failures beside OpenTURNS, at no more evaluations.

    python -m tests.studies.benchmarks.rare

For each problem: evaluations, root-mean-square error over the share, and how often the
interval at 95 % holds it, of some studies. FORM has no interval.
"""

from __future__ import annotations

import numpy as np
import openturns as ot
from scipy.stats import norm

from tests.studies.coverage.rare_problems import RARE_PROBLEMS, SIZE, sought
from tolstat.statistics.intervals.weighted_estimates import rare_share

STUDIES = 10
PROBLEMS = (
    "linear of 10, 1e-6",
    "four branches, 1e-6",
    "two regions of ten parts, 1e-6",
    "hundred equal, 1e-6",
    "thirty kinds, 1e-6",
    "quadratic of a hundred, 1e-6",
)


def event(problem):
    """Return a problem's event, and the evaluations of each call."""
    d, calls = len(problem.distributions), []

    def margins(x):
        calls.append(len(x))
        return problem.margin(np.array(x))[:, None]

    vector = ot.CompositeRandomVector(
        ot.PythonFunction(d, 1, func_sample=margins), ot.RandomVector(ot.Normal(d))
    )
    return ot.ThresholdEvent(vector, ot.Less(), 0.0), calls


def of_tolstat(problem, seed):
    """Return evaluations, estimate, lower and upper end."""
    found = rare_share((each := sought(problem, seed, SIZE))[0] < 0, each[1])
    return SIZE, found.value, found.lower, found.upper


def of_openturns(make, problem, seed):
    """Return evaluations, estimate, lower and upper end of a simulation."""
    ot.RandomGenerator.SetSeed(seed)
    at, calls = event(problem)
    algorithm = make(at)
    algorithm.run()
    found = algorithm.getResult()
    value = found.getProbabilityEstimate()
    half = norm.isf(0.025) * value * found.getCoefficientOfVariation()
    return sum(calls), value, value - half, value + half


def nais(at):
    """Nonparametric adaptive importance sampling: few steps of many trials."""
    algorithm = ot.NAIS(at, 0.1)
    algorithm.setMaximumOuterSampling(SIZE // 10)
    algorithm.setBlockSize(1)
    return algorithm


def subset(at):
    """Subset sampling: steps to a tenth."""
    algorithm = ot.SubsetSampling(at)
    algorithm.setMaximumOuterSampling(SIZE // 7)
    algorithm.setBlockSize(1)
    return algorithm


def of_form(problem, seed):
    """Return evaluations and estimate of the first-order method."""
    at, calls = event(problem)
    start = np.full(len(problem.distributions), 0.1)
    search = ot.Cobyla()
    search.setMaximumCallsNumber(SIZE)
    search.setCheckStatus(False)
    search.setStartingPoint(start)
    algorithm = ot.FORM(search, at)
    algorithm.run()
    value = algorithm.getResult().getEventProbability()
    return sum(calls), value, np.nan, np.nan


WAYS = {
    "tolstat": (of_tolstat, STUDIES),
    "NAIS": (lambda p, seed: of_openturns(nais, p, seed), STUDIES),
    "SubsetSampling": (lambda p, seed: of_openturns(subset, p, seed), STUDIES),
    "FORM": (of_form, 1),
}


def main():
    """Print the table."""
    print("| problem | method | evaluations | rms error, % | covered | studies |")
    print("|---|---|---|---|---|---|")
    for name in PROBLEMS:
        problem = RARE_PROBLEMS[name]()
        for way, (of, studies) in WAYS.items():
            each = np.array([of(problem, seed) for seed in range(1, studies + 1)])
            calls, values, low, high = each.T
            error = np.sqrt(np.mean((values / problem.share - 1) ** 2))
            held = np.count_nonzero((low <= problem.share) & (problem.share <= high))
            said = held if np.isfinite(low).all() else "no interval"
            print(
                f"| {name} | {way} | {np.median(calls):.0f} | {100 * error:.3g} "
                f"| {said} | {studies} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
