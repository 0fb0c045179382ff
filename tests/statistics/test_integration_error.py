"""Errors of the trials integrated again, and estimates for the other trials."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat.statistics.integration_error import (
    integration_error,
    share_above_largest,
    verdict_changes,
)


def test_trials_of_equal_response_take_turns():
    """Of three like machines integrated again one errs, so one in three of the rest."""
    values = np.zeros(12)
    trials, precise = np.array([0, 4, 5]), np.array([0.0, 3.0, 0.0])
    error = integration_error(values, trials, precise, np.ones(3, bool))
    better = error.removed(values)
    assert np.count_nonzero(better == 3.0) == 4 and better.sum() == 12
    assert better[4] == 3.0 and better[0] == better[5] == 0.0


def test_trials_chosen_by_another_response_count_once():
    values = np.arange(100.0)
    trials = np.array([0, 50, 51, 99])
    precise = values[trials] - [0.0, 0.0, 7.0, 0.0]
    alike = np.array([True, True, False, True])
    error = integration_error(values, trials, precise, alike)
    moved = values - error.removed(values)
    assert moved.sum() == 7.0 and moved[51] == 7.0
    # had it stood for others it would have counted for half of the machines
    every = integration_error(values, trials, precise, np.ones(4, bool))
    assert (values - every.removed(values)).sum() > 100


def test_choosing_by_the_response_does_not_bias_the_mean():
    """Errors grow with a response of which the largest were chosen on purpose."""
    rng = np.random.default_rng(4)
    plain, chosen = [], []
    for _ in range(300):
        values = rng.exponential(size=2000)
        errors = values**2 * rng.normal(1, 0.5, size=2000)
        random = rng.choice(2000, 20, replace=False)
        largest = np.argsort(values)[-20::2]
        for trials, found in ((random, plain), (np.union1d(random, largest), chosen)):
            precise = values[trials] - errors[trials]
            error = integration_error(
                values, trials, precise, np.ones(len(trials), bool)
            )
            moved = np.mean(values - error.removed(values))
            found.append((moved - errors.mean(), errors[trials].mean()))
    plain, chosen = np.array(plain), np.array(chosen)
    # of a true 2; the steeper errors grow between neighbours, the more is left
    assert abs(chosen[:, 0].mean()) < 0.1
    assert chosen[:, 1].mean() > 10  # what the mean of the chosen would have claimed
    assert chosen[:, 0].std() < 0.9 * plain[:, 0].std()


def test_at_most_one_in_twenty_bounds_is_wrong():
    rng = np.random.default_rng(5)
    n = 41
    bound = share_above_largest(n)
    assert bound == pytest.approx(0.0705, abs=1e-4)
    true = 1 - rng.random((20_000, n)).max(axis=1)  # share above the largest
    wrong = np.mean(true > bound)
    assert wrong == pytest.approx(0.05, abs=0.006)
    assert np.isnan(share_above_largest(0))


def test_sides_of_a_limit():
    values = np.array([0.0, 0.8, 0.95, 1.02, 1.3, np.nan, -2.2])
    trials, precise = np.array([0, 2, 3]), np.array([0.0, 1.01, 1.03])
    found = verdict_changes(values, trials, precise, (-2.0, 1.0))
    assert found.near == 2 and found.changed == 1
    assert found.gap == pytest.approx(0.2)  # of 0.8, and of -2.2 from the other end
    assert found.at_most == pytest.approx(1 / 6)
    every = verdict_changes(values[:5], np.arange(5), values[:5], (-np.inf, 1.0))
    assert every == (5, 0, np.inf, 0.0)
