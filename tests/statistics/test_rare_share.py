"""The fraction out of limit of a rare run, with few heavy trials."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from tests.coverage.rare_problems import RARE_PROBLEMS, sought
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.weighted_estimates import (
    plain_trials,
    rare_share,
    unmet,
)

N = 1000


@pytest.mark.parametrize("number", [99, 100])
def test_with_few_units_out_of_limit_the_heaviest_of_all_bounds(number):
    """Of a hundred the heaviest beyond stands for the next one (Fay and Feuer)."""
    weights = np.full(N, 0.01)
    weights[-1] = 2.0  # not beyond
    found = rare_share(np.arange(N) < number, weights)
    counts = weights[:number] / N
    assert found.value == pytest.approx(counts.sum())
    next_one = (0.01 if number == 100 else 2.0) / N
    mean, variance = counts.sum() + next_one, (counts**2).sum() + next_one**2
    upper = variance / mean / 2 * chi2.ppf(0.975, 2 * mean**2 / variance)
    assert found.upper == pytest.approx(upper, rel=1e-6)


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
    assert 0.94e-6 < found.lower < 1e-6 < found.upper < 1.08e-6
