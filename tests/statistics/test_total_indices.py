"""Sobol' indices of runs made for them: known answers, SALib, OpenTURNS."""

from __future__ import annotations

import numpy as np
import openturns as ot
import pytest
from SALib.analyze import sobol as salib

from tests.studies.coverage.index_problems import INDEX_PROBLEMS, design
from tolstat.statistics.sensitivity.contributions import contributions
from tolstat.statistics.sensitivity.sobol_indices import sobol_indices


def names_of(name):
    return [f"x{i}" for i in range(len(INDEX_PROBLEMS[name].first))]


@pytest.mark.parametrize("name", ["linear stack", "Ishigami", "Sobol' G"])
def test_known_indices(name):
    problem, factors = INDEX_PROBLEMS[name], names_of(name)
    groups = design(problem, np.random.default_rng(4), 20_000)
    found = sobol_indices(groups, factors)
    for i, factor in enumerate(factors):
        for known, each in zip(
            (problem.first[i], problem.total[i]), found[factor], strict=True
        ):
            half = (each.upper - each.lower) / 2
            assert half < 0.04
            # 2.1 standard errors wide: three of them
            assert abs(each.value - known) < 1.5 * half + 1e-12


def test_the_numbers_match_salib():
    problem, factors = INDEX_PROBLEMS["Ishigami"], names_of("Ishigami")
    groups = design(problem, np.random.default_rng(5), 2000)
    found = sobol_indices(groups, factors)
    # SALib wants A, A with one of B, B
    Y = np.column_stack([groups[:, :1], groups[:, 2:], groups[:, 1:2]]).ravel()
    bounds = [[-np.pi, np.pi]] * 3
    known = salib.analyze(
        {"num_vars": 3, "names": factors, "bounds": bounds}, Y,
        calc_second_order=False, num_resamples=200, seed=1,
    )  # fmt: skip
    total = [found[factor].total.value for factor in factors]
    assert total == pytest.approx(known["ST"], rel=1e-9)
    first = [found[factor].first.value for factor in factors]
    assert first == pytest.approx(known["S1"], abs=2e-3)  # they centre otherwise
    widths = [(f.first.upper - f.first.lower) / 2 for f in found.values()]
    assert widths == pytest.approx(known["S1_conf"], rel=0.5)


def test_the_index_of_known_data_matches_openturns():
    problem, factors = INDEX_PROBLEMS["Sobol' G"], names_of("Sobol' G")
    X = problem.deviations(np.random.default_rng(6).random((3000, len(factors))))
    y = problem.response(X)
    found = contributions(dict(zip(factors, X.T, strict=True)), {"y": y})["y"]
    algorithm = ot.RankSobolSensitivityAlgorithm(
        ot.Sample(X), ot.Sample.BuildFromPoint(y)
    )
    known = np.array(algorithm.getFirstOrderIndices())
    ours = [each.value for each in found.first_order.values()]
    # theirs cuts what is below zero
    assert np.maximum(ours, 0) == pytest.approx(np.maximum(known, 0), abs=2e-3)


def test_indices_that_are_not_estimable_have_a_reason():
    few = sobol_indices(np.random.default_rng(0).normal(size=(499, 4)), ["a", "b"])
    assert few["a"].first.reason == "needs 500 groups of 4 trials, 2000 in all"
    flat = sobol_indices(np.ones((600, 4)), ["a", "b"])
    assert "does not spread" in flat["b"].total.reason
    rare = design(INDEX_PROBLEMS["rare jam"], np.random.default_rng(1), 1000)
    found = sobol_indices(rare, ["rod_1", "rod_2", "gear"])
    assert not found["rod_1"].total.sure and found["rod_1"].total.value > 0.5
    assert "few trials dominate" in found["rod_1"].total.reason
