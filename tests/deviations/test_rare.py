"""Rare trials: the stages of a run, and mixtures that keep the smaller kind."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import chi2, norm

from tests.studies.coverage.rare_problems import RARE_PROBLEMS, RareProblem, sought
from tolstat.deviations.distributions import Normal, Tolerance
from tolstat.deviations.mixture import centred, fitted
from tolstat.deviations.rare import Rare
from tolstat.deviations.rare_search import WIDE
from tolstat.deviations.samplers import AS_STUDY
from tolstat.statistics.intervals.weighted_estimates import rare_share

STREAMS = {f"x{i}": i for i in range(6)}


def test_a_smaller_kind_keeps_a_part_in_many_directions():
    """One of twelve lie in a corner, farther from each other than from the others."""
    rng = np.random.default_rng(1)
    points = rng.normal(size=(360, 10))
    points[:330, 0] = 4.8 + rng.exponential(0.2, 330)
    points[330:, 1:4] = 2.6 + rng.exponential(0.35, (30, 3))
    means = np.zeros((2, 10))
    means[0, 0], means[1, 1:4] = 4.8, 2.6
    start = centred(np.ones(2), 10)._replace(means=means)
    found = fitted(rng.permutation(points), np.zeros(360), start)
    assert len(found.shares) == 2
    drawn = found.points(rng.random(9000), rng.normal(size=(9000, 10)))
    assert np.mean(drawn[:, 1:4].min(axis=1) > 2.6) > 0.05


def test_each_part_is_fitted_to_as_many_points_as_it_needs():
    """Weights that hardly differ in one kind, and by e^10 in another."""
    rng = np.random.default_rng(1)
    points = 0.3 * rng.normal(size=(400, 4))
    points[:200, 0] += 5.0
    points[200:, 1] += 5.0
    logs = np.where(points[:, 0] > 2.5, 0.0, -30.0 * (points[:, 1] - 5.0))
    means = np.array([[5.0, 0, 0, 0], [0, 5.0, 0, 0]])
    start = centred(np.ones(2), 4)._replace(means=means)
    found = fitted(rng.permutation(np.column_stack([points, logs]))[:, :4], logs, start)
    one, other = found.means[np.argsort(found.means[:, 1])]
    assert one[0] == pytest.approx(5.0, abs=0.1)
    assert 4.0 < other[1] < 5.1


def test_few_points_leave_the_parts_as_they_are():
    start = centred(np.ones(2), 3)
    assert fitted(np.ones((5, 3)), np.zeros(5), start) is start


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
def test_all_trials_are_used_and_a_third_give_the_estimate(trials):
    *before, last = stages_of(lambda x: 3.0 - x[:, 0], trials)
    assert not any(np.isfinite(stage.weight).any() for stage in before)
    assert np.isfinite(last.weight).all() and len(last.unit) >= trials / 3
    assert sum(len(stage.unit) for stage in before) + len(last.unit) == trials


def test_a_share_of_each_stage_stays_wide_and_of_the_last_one_as_in_the_study():
    """They find what no fit knows; no fit reaches to this side."""
    *_, last = stages_of(lambda x: 4.0 - x[:, 0], 20_000)
    points = ndtri(last.unit)
    other_side = points[points[:, 0] < 0]
    assert len(other_side) / len(points) == pytest.approx(
        (AS_STUDY + WIDE) / 2, rel=0.2
    )
    wide = np.mean((other_side[:, 1:] ** 2).sum(axis=1) > chi2.isf(0.01, 5))
    assert wide == pytest.approx(1 / 3 * chi2.sf(chi2.isf(0.01, 5) / 4, 5), rel=0.3)


def test_a_response_that_leads_nowhere_is_bounded():
    *_, last = stages_of(lambda x: np.ones(len(x)), 5000)
    assert last.weight.max() < 1 / (1 - WIDE)
    assert np.median(last.weight) > 0.9
