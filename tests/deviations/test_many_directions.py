"""Trials out of limit in many directions: the fitted distribution, the estimates."""

from __future__ import annotations

import numpy as np
import pytest

from tests.deviations.searched import led
from tests.studies.coverage.rare_problems import RARE_PROBLEMS, sought
from tolstat.deviations.mixture import normal_of
from tolstat.deviations.rare import LAST_SHARE, Rare
from tolstat.statistics.intervals.weighted_estimates import rare_share

RNG = np.random.default_rng(1)
PARTS = 40


def test_one_variance_serves_all_directions_but_those_that_differ():
    """No single coordinate of the sphere is significantly wider; all together are."""
    halves = 1.3 * RNG.normal(size=(2, 2000, PARTS))
    halves[:, :, 0] = 4.5 + 0.2 * RNG.normal(size=(2, 2000))
    found = normal_of(halves)
    covariance = found.roots[0] @ found.roots[0].T
    assert found.means[0, 0] == pytest.approx(4.5, abs=0.05)
    assert np.abs(found.means[0, 1:]).max() < 0.06
    assert np.diag(covariance)[1:] == pytest.approx(1.69, rel=0.1)
    assert covariance[0, 0] == pytest.approx(0.85 * 0.04 + 0.15, rel=0.1)


def test_one_point_alone_has_a_distribution():
    found = normal_of(np.tile([[3.0, 1.0]], (2, 50, 1)))
    np.testing.assert_allclose(found.means[0], [3, 1])
    assert np.isfinite(found.roots).all()


def test_halves_that_descend_from_few_have_no_mean():
    """Their distance tells that the mean is chance; counted, it would be sure."""
    halves = RNG.normal(size=(2, 3, PARTS)).repeat(200, axis=1)
    mean = normal_of(halves).means[0]
    plain = halves.mean(axis=(0, 1))
    assert (mean**2).sum() < 0.5 * (plain**2).sum()


@pytest.mark.parametrize(
    "name",
    [
        "hundred equal, 1e-6",
        "paraboloid of a hundred",
        "noisy of fifty, 1e-5",
        "quadratic of a hundred, 1e-6",
        "RP63 (paraboloid of a hundred)",
        "thirty kinds, 1e-6",
    ],
)
def test_a_share_of_many_parts_is_estimated(name):
    """A mixture fitted in stages told a thirtieth of it for a hundred parts."""
    problem = RARE_PROBLEMS[name]()
    margins, weights = sought(problem, 2, 20_000)
    found = rare_share(margins < 0, weights)
    assert found.lower < problem.share < found.upper < 1.5 * found.value


RESPONSES = {
    "kinds": lambda x: 4.0 - x.max(axis=1),
    "none": lambda x: 9.0 - x.max(axis=1),
    "shell": lambda x: np.sqrt(x.shape[1]) + 4 - np.sqrt((x**2).sum(axis=1)),
    "passed or failed": lambda x: np.where(x[:, 0] > 2.5, -np.inf, 1.0),
}


@pytest.mark.parametrize("name", RESPONSES)
@pytest.mark.parametrize("parts", [16, 40])
def test_all_trials_are_used_and_a_tenth_give_the_estimate(name, parts):
    drawn, margin = [], RESPONSES[name]

    def counted(x):
        drawn.append(len(x))
        return margin(x)

    led(Rare().stages(1, {f"x{i}": i for i in range(parts)}, 5000), counted)
    assert sum(drawn) == 5000 and drawn[-1] >= LAST_SHARE * 5000
