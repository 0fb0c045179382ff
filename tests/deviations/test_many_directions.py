"""Trials out of limit in many directions: moves, slope, the fitted distribution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import chi2, norm

from tests.coverage.rare_problems import RARE_PROBLEMS, sought
from tolstat.deviations.many_directions import (
    FAR,
    approach,
    moved,
    normal_of,
    one_region,
    slope,
)
from tolstat.deviations.rare import Rare
from tolstat.statistics.intervals.weighted_estimates import rare_share

RNG = np.random.default_rng(1)
PARTS = 40


def led(margin, parts=PARTS, trials=400, seed=1):
    """Return what an approach finds, and all its trials."""
    course, drawn = approach(seed, {f"x{i}": i for i in range(parts)}, trials), []
    stage = next(course)
    while True:
        drawn.append(ndtri(stage.unit))
        try:
            stage = course.send(margin(drawn[-1]))
        except StopIteration as end:
            return *end.value, drawn


@pytest.mark.parametrize("far", FAR[[1, 7]])
def test_moves_keep_the_distribution_of_the_study(far):
    """Squares, and products with the start: as of a normal pair of that correlation."""
    axis = np.array([0.6, 0.8, 0.0])
    x, z = RNG.normal(size=(2, 200_000, 3))
    y = moved(x, z, axis, np.tile(far, (len(x), 1)))
    np.testing.assert_allclose(y.T @ y / len(y), np.eye(3), atol=0.02)
    along, across = np.sqrt(1 - far**2)
    both = across * np.eye(3) + (along - across) * np.outer(axis, axis)
    np.testing.assert_allclose(y.T @ x / len(y), both, atol=0.02)


def test_the_slope_is_that_of_a_linear_response_though_trials_fail():
    weights = np.arange(1.0, 21)
    points = RNG.normal(size=(300, 20))
    margins = 3 - points @ weights
    margins[::50] = -np.inf
    known = -weights / np.linalg.norm(weights)
    assert slope(points, margins) @ known > 0.97


def test_halves_are_independent_and_nearly_so_are_trials_across_the_slope():
    end = norm.isf(1e-5) * np.sqrt(PARTS)
    (one, other), used, drawn = led(lambda x: end - x.sum(axis=1), trials=800)
    assert used == sum(map(len, drawn)) <= 15 * 800
    assert np.all(np.concatenate([one, other]).sum(axis=1) > end)
    # of 4000 trials that descend from few, worth 200 or more: mean across the slope
    mean = np.concatenate([one, other]).mean(axis=0)
    across = mean - mean.mean()
    assert (across**2).sum() < chi2.isf(1e-3, PARTS - 1) / 200
    assert not np.any(one[:, 0] == other[:, 0])


def test_a_flat_response_and_one_without_a_way_end_the_approach():
    found, used, _ = led(lambda x: np.ones(len(x)))
    assert not found.size and used == 400 and not one_region(found)
    # all alike but a few, which are alike, too
    found, used, _ = led(lambda x: 2.0 - (x[:, 0] > 1) - (x[:, 0] > 2.5))
    assert not found.size


def test_a_response_in_steps_is_followed():
    """More than a quarter of the trials are alike at each step."""
    found, _, _ = led(lambda x: 3.25 - np.floor(x.sum(axis=1) / np.sqrt(PARTS)))
    assert found.size and found.sum(axis=2).min() >= 4 * np.sqrt(PARTS) - 1e-9


def test_different_trials_in_the_halves_are_several_regions():
    one, other = RNG.normal(size=(2, 300, PARTS))
    one[:, 0] += 5
    other[:, 1] += 5
    assert not one_region(np.array([one, other]))
    other[:, 0] += 5
    other[:, 1] -= 5
    assert one_region(np.array([one, other]))


def test_one_variance_serves_all_directions_but_those_that_differ():
    """No single coordinate of the sphere is significantly wider; all together are."""
    halves = 1.3 * RNG.normal(size=(2, 2000, PARTS))
    halves[:, :, 0] = 4.5 + 0.2 * RNG.normal(size=(2, 2000))
    found = normal_of(halves)
    covariance = found.roots[0] @ found.roots[0].T
    assert found.means[0, 0] == pytest.approx(4.5, abs=0.05)
    assert not found.means[0, 1:].any()  # less than chance
    assert np.diag(covariance)[1:] == pytest.approx(1.69, rel=0.1)
    assert covariance[0, 0] == pytest.approx(0.85 * 0.04 + 0.15, rel=0.1)


@pytest.mark.parametrize(
    "name", ["hundred equal, 1e-6", "paraboloid of a hundred", "noisy of fifty, 1e-5"]
)
def test_a_share_of_many_parts_is_estimated(name):
    """A mixture fitted in stages told a thirtieth of it for a hundred parts."""
    problem = RARE_PROBLEMS[name]()
    margins, weights = sought(problem, 2, 20_000)
    found = rare_share(margins < 0, weights)
    assert found.lower < problem.share < found.upper < 1.2 * found.value


def test_all_trials_are_used_also_where_several_kinds_are_met():
    course = Rare().stages(1, {f"x{i}": i for i in range(30)}, 5000)
    stage, sizes = next(course), []
    while True:
        sizes.append(len(stage.unit))
        try:
            stage = course.send(4.0 - ndtri(stage.unit).max(axis=1))
        except StopIteration:
            break
    assert sum(sizes) == 5000 and np.isfinite(stage.weight).all()
