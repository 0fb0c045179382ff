"""The fraction out of limit of a rare run, with few heavy trials."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from tests.studies.coverage.rare_problems import RARE_PROBLEMS, sought
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.weighted_estimates import (
    plain_trials,
    rare_share,
    unmet,
)

N = 1000


@pytest.mark.parametrize(("number", "times"), [(9, 200), (20, 5), (50, 2), (100, 1)])
def test_with_few_units_out_of_limit_the_next_one_may_be_heavier(number, times):
    """In the ratio of a hundred to these; up to ten at least as the heaviest of all."""
    weights = np.full(N, 0.01)
    weights[-1] = 2.0  # not beyond
    found = rare_share(np.arange(N) < number, weights)
    counts = weights[:number] / N
    assert found.value == pytest.approx(counts.sum())
    next_one = times * 0.01 / N
    mean, variance = counts.sum() + next_one, (counts**2).sum() + next_one**2
    upper = variance / mean / 2 * chi2.ppf(0.975, 2 * mean**2 / variance)
    assert found.upper == pytest.approx(upper, rel=1e-6)


def test_fewer_units_out_of_limit_do_not_narrow_the_interval():
    """With nine the next one was the heaviest of all, no heavier than these."""
    weights = np.full(N, 1e-6)
    uppers = []
    for number in (9, 10, 11, 20):
        weights[:number] = 1.0
        uppers.append(rare_share(np.arange(N) < number, weights).upper / number)
    assert np.all(np.diff(uppers) < 0)


def test_weights_of_nearly_zero_have_an_interval():
    weights = np.full(N, 1.0)
    weights[:3] = 1e-170
    found = rare_share(np.arange(N) < 3, weights)
    assert found.lower <= found.value < found.upper <= unmet(weights) * 1.5


def test_with_none_out_of_limit_the_heaviest_bounds_the_share():
    weights = np.linspace(0.5, 2.0, N)
    found = rare_share(np.zeros(N, bool), weights)
    assert found == (0, 0, unmet(weights), "")
    assert (1 - found.upper / 2.0) ** N == pytest.approx(0.025)
    assert rare_share(np.zeros(0, bool), weights[:0]).reason


def test_plain_trials_are_given_for_a_nearly_normal_count():
    near = Estimate(1e-6, 0.95e-6, 1.05e-6)
    assert plain_trials(near) == pytest.approx(1e6 * (1.96 / 0.05) ** 2, rel=1e-4)
    assert np.isnan(plain_trials(Estimate(6e-6, 2.7e-6, 0.0145)))  # of 0.4 trials
    assert np.isnan(plain_trials(Estimate(0.999, 0.968, 1.0)))
    assert np.isnan(plain_trials(Estimate(0.0, 0.0, 1e-3)))


def test_the_smaller_of_two_regions_of_ten_parts_is_found():
    """Without it the share is 0.91e-6: fits on 40 points told 0.87 to 0.94."""
    margins, weights = sought(
        RARE_PROBLEMS["two regions of ten parts, 1e-6"](), 1, 20_000
    )
    found = rare_share(margins < 0, weights)
    assert found.value > 0.95e-6
    assert found.lower < 1e-6 < found.upper < 1.08e-6
