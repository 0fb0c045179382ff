"""Rare trials: two searches of a limit, and mixtures that keep the smaller kind."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import norm

from tests.coverage.rare_problems import RARE_PROBLEMS, RareProblem, sought
from tolstat.deviations.distributions import Normal, Tolerance
from tolstat.deviations.mixture import fitted
from tolstat.deviations.rare import FIRST, STEP, Rare, trials_of_stage
from tolstat.deviations.subset_simulation import subset_simulation
from tolstat.statistics.intervals.weighted_estimates import rare_share

STREAMS = {f"x{i}": i for i in range(6)}
EACH = 400


def led(margin):
    """Return the stages that a response leads through, and where it leads."""
    course, stages = subset_simulation(1, STREAMS, EACH), []
    stage = next(course)
    while True:
        stages.append(stage)
        try:
            stage = course.send(margin(ndtri(stage.unit)))
        except StopIteration as end:
            return stages, end.value


def test_subset_simulation_finds_a_corner_of_several_parts():
    """That spread hides: of twice the spread one machine in 7000 lies there."""
    end = norm.isf(1e-6 ** (1 / 6))
    stages, (mixture, trials) = led(lambda x: end - x.min(axis=1))
    # two halves go by themselves, and need not be there at once
    sizes = [len(each.unit) for each in stages]
    assert trials == sum(sizes) and {EACH} <= set(sizes) <= {EACH, EACH // 2}
    # a quarter at each step: 1e-6 after ten or some more, and the last one moves
    assert 10 <= len(stages) <= 14
    beyond = ndtri(stages[-1].unit).min(axis=1) > end
    assert np.mean(beyond) > 0.05
    rng = np.random.default_rng(1)
    points = mixture.points(rng.random(4000), rng.normal(size=(4000, 6)))
    assert np.mean(points.min(axis=1) > end) > 0.01


def test_moved_trials_keep_the_distribution_of_the_study():
    """Moved and kept within a level they are normal beyond it, and as before beside."""
    drawn = []

    def margin(x):
        drawn.append(x)
        return 4.0 - x[:, 0]

    led(margin)
    x = drawn[1]  # moved from the quarter of the largest
    assert np.abs(x[:, 1:].mean(axis=0)).max() < 4 / np.sqrt(EACH / 4)
    assert x[:, 1:].std() == pytest.approx(1, abs=0.1)


def test_the_halves_of_subset_simulation_are_independent():
    drawn = []

    def margin(x):
        drawn.append(x)
        margins = 4.0 - x[:, 0]
        margins[EACH // 2 :] = 1.0  # the second half is led nowhere, and ends
        return margins

    _, (mixture, trials) = led(margin)
    sizes = [len(x) for x in drawn]
    assert sizes[:3] == [EACH, EACH, EACH // 2] and trials == sum(sizes)
    assert mixture is not None and np.all(mixture.means[:, 0] > 3.5)
    one, other = np.split(drawn[0], 2)
    assert not np.any(one == other)


def test_a_flat_response_ends_subset_simulation():
    stages, (mixture, trials) = led(lambda x: np.ones(len(x)))
    assert mixture is None and len(stages) == 2 and trials == 2 * EACH


def test_a_smaller_kind_keeps_a_part_in_many_directions():
    """One of twelve lie in a corner, farther from each other than from the others."""
    rng = np.random.default_rng(1)
    points = 1.5 * rng.normal(size=(360, 10))
    points[:330, 0] = 4.8 + rng.exponential(0.5, 330)
    points[330:, 1:4] = 2.6 + rng.exponential(0.6, (30, 3))
    found = fitted(points, 300.0, 1.5)
    drawn = found.points(rng.random(9000), rng.normal(size=(9000, 10)))
    assert np.mean(drawn[:, 1:4].min(axis=1) > 2.6) > 0.05


def test_a_corner_next_to_an_extreme_part_is_found():
    """By spread alone it was in one study of three, and the share told half."""
    problem = RARE_PROBLEMS["corner of four beside, 1e-6"]()
    for seed in (1, 2, 3):
        margins, weights = sought(problem, seed, 20_000)
        found = rare_share(margins < 0, weights)
        assert found.lower < problem.share < found.upper < 1.2 * problem.share


def test_contributor_names_do_not_share_internal_streams():
    """A part called as a stream of the sampler's own had scores that chose its kind."""
    share, end = 1e-5, norm.isf(0.5e-5)
    for name in ("stage", "parts", "moves"):
        problem = RareProblem(
            {name: Normal(Tolerance(-3.0, 3.0)), "other": Normal(Tolerance(-3.0, 3.0))},
            lambda x: end - np.abs(x[:, 0]),
            share,
        )
        margins, weights = sought(problem, 1, 5000)
        found = rare_share(margins < 0, weights)
        assert found.lower < share < found.upper < 1.2 * share


def stages_of(margin, trials):
    """Return all stages of a search that a response answers."""
    course, stages = Rare().stages(1, STREAMS, trials), []
    stage = next(course)
    while True:
        stages.append(stage)
        try:
            stage = course.send(margin(ndtri(stage.unit)))
        except StopIteration:
            return stages


@pytest.mark.parametrize("trials", [5000, 20_000, 33_333])
def test_all_trials_are_used_and_two_fifths_give_the_estimate(trials):
    *before, last = stages_of(lambda x: 3.0 - x[:, 0], trials)
    assert not any(np.isfinite(stage.weight).any() for stage in before)
    assert np.isfinite(last.weight).all() and len(last.unit) >= 0.4 * trials
    assert sum(len(stage.unit) for stage in before) + len(last.unit) == trials


@pytest.fixture(scope="module")
def fitted_stages():
    """Those that are drawn from fits, of 10000 trials, and the last one.

    They have other sizes than the first stage, and than the steps to the limit.
    """
    trials = 10_000
    *before, last = stages_of(lambda x: 3.0 - x[:, 0], trials)
    each = trials_of_stage(trials, len(STREAMS))
    assert each not in (round(FIRST * trials), round(STEP * trials))
    found = [stage for stage in before if len(stage.unit) == each]
    spreads = [stage.spread[0] for stage in found]
    assert spreads == sorted(spreads, reverse=True) and spreads[-1] == 1
    return [stage for stage in found if stage.spread[0] == 1], last


def test_four_stages_at_the_spread_of_the_study_suffice(fitted_stages):
    """What they do not need is left for the last stage, which tells the share."""
    at_one, last = fitted_stages
    assert len(at_one) == 4
    assert len(last.unit) >= 0.4 * 10_000 + 2 * len(at_one[0].unit)


def test_a_tenth_of_each_stage_stays_wide(fitted_stages):
    """It finds what no fit knows; of 1.5 sigmas, and no fit reaches to this side."""
    at_one, _ = fitted_stages
    points = np.concatenate([ndtri(stage.unit) for stage in at_one])
    other_side = points[points[:, 0] < 0]
    assert len(other_side) == pytest.approx(0.05 * len(points), rel=0.4)
    assert other_side[:, 1:].std() == pytest.approx(1.5, abs=0.25)
