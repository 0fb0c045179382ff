"""Sobol' indices of runs made for them: known answers, SALib, OpenTURNS."""

from __future__ import annotations

import numpy as np
import openturns as ot
import pytest
from SALib.analyze import sobol as salib
from scipy.special import ndtri

from tests.studies.benchmarks.indices import study
from tests.studies.coverage.index_problems import INDEX_PROBLEMS, design
from tolstat.statistics.sensitivity import group_surface
from tolstat.statistics.sensitivity.contributions import contributions
from tolstat.statistics.sensitivity.group_surface import (
    WIDER,
    GroupSurface,
    like_normal,
)
from tolstat.statistics.sensitivity.sobol_indices import sobol_indices


def names_of(name):
    return [f"x{i}" for i in range(len(INDEX_PROBLEMS[name].first))]


@pytest.mark.parametrize("name", ["linear stack", "Ishigami", "Sobol' G", "fast sine"])
def test_known_indices(name):
    problem = INDEX_PROBLEMS[name]
    found = sobol_indices(*design(problem, np.random.default_rng(4), 2000))
    for *known, estimated in zip(problem.first, problem.total, found, strict=True):
        for truth, index in zip(known, estimated, strict=True):
            half = (index.upper - index.lower) / 2
            assert half < (0.1 if name == "fast sine" else 0.005)
            # 3 standard errors wide, where a surface follows: three of them
            assert abs(index.value - truth) < 1.5 * half + 1e-9


def test_a_chain_of_normal_parts_has_exact_indices():
    problem = INDEX_PROBLEMS["linear stack"]
    found = sobol_indices(*design(problem, np.random.default_rng(4), 600))
    for truth, index in zip(problem.first, found, strict=True):
        assert index.first[:3] == pytest.approx([truth] * 3, abs=1e-11)
        assert index.total[:3] == pytest.approx([truth] * 3, abs=1e-11)


@pytest.mark.parametrize("name", ["Ishigami", "Sobol' g", "OTL circuit", "piston"])
def test_errors_are_less_than_those_of_salib_at_equal_runs(name):
    theirs, ours, held = map(
        np.array, zip(*(study(name, i) for i in range(2)), strict=True)
    )
    theirs, ours = (np.sqrt(np.mean(x**2, axis=(0, 2))) for x in (theirs, ours))
    assert np.all(ours < 0.9 * theirs)  # of first orders, of totals
    assert held.mean() > 0.75


def test_without_a_surface_the_numbers_match_salib(monkeypatch):
    monkeypatch.setattr(group_surface, "MOST_TERMS", 0)
    problem, factors = INDEX_PROBLEMS["Ishigami"], names_of("Ishigami")
    groups, surface = design(problem, np.random.default_rng(5), 2000)
    found = sobol_indices(groups, surface)
    # SALib wants A, A with one of B, B
    Y = np.column_stack([groups[:, :1], groups[:, 2:], groups[:, 1:2]]).ravel()
    bounds = [[-np.pi, np.pi]] * 3
    known = salib.analyze(
        {"num_vars": 3, "names": factors, "bounds": bounds}, Y,
        calc_second_order=False, num_resamples=200, seed=1,
    )  # fmt: skip
    # its variance is that of A and B alone, ours that of all trials
    assert [x.total.value for x in found] == pytest.approx(known["ST"], rel=0.05)
    # and it keeps the chance correlation of A and B
    assert [x.first.value for x in found] == pytest.approx(known["S1"], abs=0.03)
    widths = [(x.first.upper - x.first.lower) / 2 for x in found]
    assert widths == pytest.approx(WIDER * known["S1_conf"], rel=0.5)


def test_the_same_function_is_followed_by_unit_samples_and_normal_scores():
    unit = np.random.default_rng(1).random(500)
    assert like_normal(3 + 0.1 * ndtri(unit), unit)
    assert not like_normal(-unit, unit)
    assert not like_normal(np.ones(500), unit)


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
    rng = np.random.default_rng(0)
    surface = GroupSurface(rng.random((499, 2, 2)), np.zeros(2, np.bool_))
    few = sobol_indices(rng.normal(size=(499, 4)), surface)
    assert few[0].first.reason == "needs 500 groups of 4 trials, 2000 in all"
    surface = GroupSurface(rng.random((600, 2, 2)), np.zeros(2, np.bool_))
    flat = sobol_indices(np.ones((600, 4)), surface)
    assert "does not spread" in flat[1].total.reason
    groups, surface = design(INDEX_PROBLEMS["rare jam"], np.random.default_rng(1), 1000)
    rod, *_ = sobol_indices(groups, surface)
    assert not rod.total.sure and rod.total.value > 0.5
    assert "few trials dominate" in rod.total.reason
