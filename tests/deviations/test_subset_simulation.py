"""Subset simulation: steps to a limit, and moves that keep the study."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, norm

from tests.deviations.searched import led
from tolstat.deviations.rare_stage import RandomNumbers
from tolstat.deviations.subset_simulation import (
    MOVE_KINDS,
    approach,
    moved,
    relaxed,
    slope,
)

RNG = np.random.default_rng(1)
PARTS = 40
EACH = 400


def numbers(parts):
    return RandomNumbers(1, {f"x{i}": i for i in range(parts)})


def approached(margin, parts=PARTS, trials=EACH):
    """Return both halves out of limit, the number of trials, and all of them."""
    drawn, (halves, used) = led(approach(numbers(parts), trials), margin)
    assert used == sum(map(len, drawn))
    return halves, drawn


def test_a_corner_of_several_parts_is_found():
    """That spread hides: of twice the spread one machine in 7000 lies there."""
    end = norm.isf(1e-6 ** (1 / 6))
    halves, drawn = approached(lambda x: end - x.min(axis=1), 6)
    # a quarter at each step: 1e-6 after ten or some more
    assert 10 <= len(drawn) <= 15
    assert all(np.all(half.min(axis=1) > end) and len(half) for half in halves)


def test_steps_tell_the_share_as_subset_simulation_does():
    """A quarter of the trials is kept at each step but the last."""
    end = norm.isf(1e-5)
    found = []
    for scale in (1.0, -1.0):
        _, drawn = approached(lambda x, s=scale: end - s * x[:, 0], 6, 2000)
        found.append(len(drawn) - 2)
    assert np.mean(found) == pytest.approx(np.log(1e-5) / np.log(0.25), abs=1)


def test_moved_trials_keep_the_distribution_of_the_study():
    """Moved and kept within a level they are normal beyond it, and as before beside."""
    _, drawn = approached(lambda x: 4.0 - x[:, 0], 6)
    x = drawn[1]  # moved from the quarter of the largest
    assert np.abs(x[:, 1:].mean(axis=0)).max() < 4 / np.sqrt(EACH / 4)
    assert x[:, 1:].std() == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("far", MOVE_KINDS[MOVE_KINDS[:, 2] == 1])
def test_a_move_keeps_the_distribution_and_turns_no_farther_than_it_says(far):
    """Squares, and products with the start: as of a normal pair of that correlation."""
    axis = np.array([0.6, 0.8, 0.0])
    x, z = RNG.normal(size=(2, 200_000, 3))
    axes = np.tile(axis, (len(x), 1))
    y = moved(x, z, axes, np.tile(far, (len(x), 1)), np.zeros_like(x))
    np.testing.assert_allclose(y.T @ y / len(y), np.eye(3), atol=0.02)
    assert np.mean(y**4) == pytest.approx(3, rel=0.02)
    assert np.mean((x @ axis) * (y @ axis)) == pytest.approx(
        np.sqrt(1 - far[0] ** 2), abs=0.02
    )
    across = [
        np.linalg.norm(each - np.outer(each @ axis, axis), axis=1) for each in (x, y)
    ]
    if far[3]:
        np.testing.assert_allclose(*across)
    else:
        both = np.sqrt(1 - far[1] ** 2) * np.eye(3)
        both += (np.sqrt(1 - far[0] ** 2) - both[0, 0]) * np.outer(axis, axis)
        np.testing.assert_allclose(y.T @ x / len(y), both, atol=0.02)


def test_a_move_of_some_directions_leaves_the_others():
    far = MOVE_KINDS[MOVE_KINDS[:, 2] < 1][0]
    x, z = RNG.normal(size=(2, 200_000, 3))
    some = np.tile([far[2] / 2, far[2], 1.0], (len(x), 1))
    axes = np.tile([1.0, 0, 0], (len(x), 1))
    y = moved(x, z, axes, np.tile(far, (len(x), 1)), some)
    np.testing.assert_array_equal(y[:, 1:], x[:, 1:])
    assert np.corrcoef(x[:, 0], y[:, 0])[0, 1] == pytest.approx(
        np.sqrt(1 - far[1] ** 2), abs=0.02
    )


def test_the_slope_is_that_of_a_linear_response_though_trials_fail():
    weights = np.arange(1.0, 21)
    points = RNG.normal(size=(300, 20))
    margins = 3 - points @ weights
    margins[::50] = -np.inf
    known = -weights / np.linalg.norm(weights)
    assert slope(points, margins) @ known > 0.97
    assert np.linalg.norm(slope(points, np.full(300, -np.inf))) == pytest.approx(1)
    # without a slope it is where the trials are
    mean = (points + 3).mean(axis=0)
    np.testing.assert_allclose(
        slope(points + 3, np.ones(300)), mean / np.linalg.norm(mean)
    )


def relaxed_points(margin, points, axis, sweeps=8):
    known = points, margin(points)
    axes = np.tile(axis / np.linalg.norm(axis), (len(points), 1))
    course = relaxed(numbers(points.shape[1]), points, sweeps, known, axes)
    return led(course, margin)[1]


def test_moved_trials_across_a_slope_are_nearly_independent():
    end = norm.isf(1e-6)

    def margin(x):
        return end - x.sum(axis=1) / np.sqrt(PARTS)

    start = np.full((800, PARTS), (end + 0.6) / np.sqrt(PARTS))
    points = relaxed_points(
        margin, start + 0.1 * RNG.normal(size=start.shape), start[0]
    )
    assert np.all(points.sum(axis=1) / np.sqrt(PARTS) > end - 1e-9)
    mean = points.mean(axis=0)
    across = mean - mean.mean()
    assert (across**2).sum() < chi2.isf(1e-3, PARTS - 1) / 400
    # beyond a limit at z a normal part is about 1/z farther on average
    over = points.sum(axis=1).mean() / np.sqrt(PARTS) - end
    assert over == pytest.approx(norm.pdf(end) / norm.sf(end) - end, abs=0.06)


def test_moved_trials_turn_where_only_the_distance_counts():
    """Small moves alone left each half near one of its ancestors."""
    end = chi2.isf(1e-6, 100)

    def margin(x):
        return end - (x**2).sum(axis=1)

    ancestors = RNG.normal(size=(4, 100))
    length = np.linalg.norm(ancestors, axis=1)[:, None]
    ancestors = ancestors / length
    start = (1.03 * np.sqrt(end) * ancestors).repeat(100, axis=0)
    points = relaxed_points(margin, start, np.ones(100))
    assert np.all((points**2).sum(axis=1) > end)
    left = [x @ a for x, a in zip(np.split(points, 4), ancestors, strict=True)]
    assert np.mean(left) < 0.2 * np.sqrt(end)


def test_the_halves_are_independent():
    margins_of = []

    def margin(x):
        margins = 4.0 - x[:, 0]
        margins_of.append(margins)
        return margins

    (one, other), drawn = approached(margin, 6)
    assert not np.any(np.isin(one[:, 0], other[:, 0]))
    first, second = np.split(drawn[0], 2)
    assert not np.any(first == second)


def test_a_flat_response_and_one_without_a_way_end_the_approach():
    halves, drawn = approached(lambda x: np.ones(len(x)))
    assert not any(map(len, halves)) and len(drawn) == 1
    # all alike but a few, which are alike, too
    halves, _ = approached(lambda x: 2.0 - (x[:, 0] > 1) - (x[:, 0] > 2.5))
    assert not any(map(len, halves))


def test_a_response_in_steps_is_followed():
    """More than a quarter of the trials are alike at each step."""
    root = np.sqrt(PARTS)
    halves, _ = approached(lambda x: 3.25 - np.floor(x.sum(axis=1) / root))
    assert min(half.sum(axis=1).min() for half in halves) >= 4 * root - 1e-9
