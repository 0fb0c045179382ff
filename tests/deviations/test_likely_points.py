"""Trials out of limit that are led towards the middle: each kind, where likeliest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from tests.deviations.searched import led
from tolstat.deviations.rare import (
    LEAST_DISTANCE,
    likely_points,
    separated,
    study_around,
)
from tolstat.deviations.rare_stage import RandomNumbers

RNG = np.random.default_rng(1)


def found(margin, parts, starts, trials=4000):
    """Return likely points, and all trials of the search."""
    numbers = RandomNumbers(1, {f"x{i}": i for i in range(parts)})
    drawn, (points, used) = led(likely_points(numbers, starts, trials), margin)
    assert used == sum(map(len, drawn)) <= trials
    return points


def out_of_limit(margin, parts, spread, number=2000):
    points = spread * RNG.normal(size=(number, parts))
    return points[margin(points) < 0]


def test_each_of_thirty_kinds_is_found_where_it_is_likeliest():
    """Subset simulation of as many trials kept four of them."""
    end = norm.isf(1e-6 / 30)

    def margin(x):
        return end - x.max(axis=1)

    points = found(margin, 30, out_of_limit(margin, 30, 2.5)[:400], 5000)
    top = points.argmax(axis=1)
    assert set(top) == set(range(30))
    near = np.array([np.linalg.norm(points[top == i], axis=1).min() for i in range(30)])
    assert near.min() >= end and np.median(near) < end + 0.5


def test_the_design_point_of_a_hundred_parts_is_found():
    """That of the first-order method: the end of a linear limit."""
    end = norm.isf(1e-6)

    def margin(x):
        return end - x.sum(axis=1) / 10

    points = found(margin, 100, out_of_limit(margin, 100, 3.0)[:100])
    assert len(points) == 1
    assert np.linalg.norm(points[0]) < end + 1.5
    assert points[0].sum() / 10 >= end


@pytest.mark.parametrize("small", [0.02, 0.002])
def test_a_small_kind_among_many_trials_of_another_is_kept(small):
    def margin(x):
        return np.minimum(4.5 - x[:, 0], 2.6 - x[:, 1:4].min(axis=1))

    starts = np.zeros((500, 10))
    few = round(small * 500)
    starts[:, 0], starts[:few, 0], starts[:few, 1:4] = 7.0, 0.0, 4.0
    starts += 0.3 * RNG.normal(size=starts.shape)
    points = found(margin, 10, starts)
    corner = points[points[:, 0] < 4.5]
    assert len(points) <= 4 and len(corner)
    assert np.linalg.norm(corner, axis=1).min() < 1.5 * np.sqrt(3) * 2.6


def test_trials_stay_out_of_limit_and_none_go_away_from_the_middle():
    starts = out_of_limit(lambda x: 2.0 - x[:, 0], 3, 2.0)[:50]
    points = found(lambda x: 2.0 - x[:, 0], 3, starts, 120)
    assert np.all(points[:, 0] >= 2.0)
    assert np.linalg.norm(points, axis=1).max() <= np.linalg.norm(starts, axis=1).max()


def test_points_are_apart_and_the_likeliest_comes_first():
    points = separated(RNG.normal(size=(300, 2)) * 3)
    squares = ((points[:, None] - points) ** 2).sum(axis=2)
    np.fill_diagonal(squares, np.inf)
    assert squares.min() >= LEAST_DISTANCE**2
    distance = np.linalg.norm(points, axis=1)
    assert np.all(np.diff(distance) >= 0)
    mixture = study_around(points)
    assert len(mixture.shares) == min(len(points), 60)
    np.testing.assert_array_equal(mixture.means[0], points[0])


def test_without_a_start_nothing_is_tried():
    with pytest.raises(StopIteration) as end:
        next(likely_points(RandomNumbers(1, {"x": 0}), np.empty((0, 1)), 100))
    points, used = end.value.value
    assert points.shape == (0, 1) and used == 0
