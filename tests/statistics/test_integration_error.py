"""Errors of the trials integrated again, and estimates for the other trials."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat.statistics.integration_error import (
    integration_error,
    response_ends,
    share_above_largest,
)
from tolstat.statistics.limits.yields import yield_of
from tolstat.statistics.sample import Sample
from tolstat.status import Status


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


def judged(values, precise, trials, limit, demanded=0.9, alike=None):
    """The verdict on trials of which some were integrated again; NaN: it failed."""
    status = np.where(np.isnan(values), Status.NOT_FINITE, Status.DONE)
    alike = np.ones(len(trials), bool) if alike is None else alike
    ends = response_ends(values, trials, precise[trials], alike)
    return yield_of(values, Sample(status), limit, demanded, ends)


def test_the_range_that_errors_allow():
    values = np.array([0.0, 0.8, 1.0, 1.4, np.nan, 2.0, 2.2])
    trials, precise = np.array([0, 2, 5]), np.array([0.1, 0.7, np.nan])
    found = response_ends(values, trials, precise, np.ones(3, bool))
    least, largest = found
    assert least[[0, 2]].tolist() == largest[[0, 2]].tolist() == [0.1, 0.7]
    # between errors of -0.1 and 0.3: the worse of both; beside a failed one: anything
    np.testing.assert_allclose(found[:, 1], [0.5, 1.1])
    assert (least[[3, 5, 6]] == -np.inf).all() and (largest[[3, 5, 6]] == np.inf).all()
    assert np.isnan(found[:, 4]).all()
    # one that failed in the run alone: others that failed may be done as well
    failed = np.array([np.nan, 1.0, np.nan])
    again = response_ends(failed, np.array([0, 1]), np.ones(2), np.ones(2, bool))
    assert again[:, 0].tolist() == [1, 1] and again[:, 2].tolist() == [-np.inf, np.inf]


@pytest.mark.parametrize(
    ("error", "limit", "word"),
    [
        (0.0, 1.0, "met"),
        (0.2, 1.0, "undecided (integration error)"),  # all lie 0.1 within
        (-0.2, 1.0, "undecided (integration error)"),  # the sign may differ
        (0.05, 1.0, "met"),
        (0.05, 0.8, "not met"),
        (0.2, 0.8, "undecided (integration error)"),
    ],
)
def test_errors_as_large_as_the_distance_leave_a_limit_undecided(error, limit, word):
    """Where every trial errs alike, and one of fifty is integrated again."""
    values = np.linspace(0.85, 0.9, 1000)
    trials = np.arange(0, 1000, 50)
    found = judged(values, values - error, trials, (-np.inf, limit))
    assert found.words == word
    assert (found.needed, found.reason != "") == (0, "(" in word)


def test_nearest_trials_that_change_sides_turn_no_verdict():
    """A thousand trials of which the four next to the limit err by 1e-3."""
    values = np.linspace(0.0, 1.01, 1000)
    near = np.argsort(np.abs(values - 1.0))[:4]
    trials = np.union1d(near, np.arange(7, 1000, 100))
    precise = values.copy()
    precise[near] = 2.0 - values[near]  # on the other side
    found = judged(values, precise, trials, (-np.inf, 1.0))
    assert np.any((values[near] <= 1.0) != (precise[near] <= 1.0))
    assert found.words == "met"


def test_an_error_that_turns_a_verdict_is_known_by_the_precise_trials():
    """Of a closed form: the yield is met as integrated, and not met in truth."""
    rng = np.random.default_rng(8)
    truth = rng.normal(size=5000)
    trials = np.sort(rng.choice(5000, 50, replace=False))
    for offset, word in ((0.0, "not met"), (-2.0, "undecided (integration error)")):
        values = truth + offset
        assert judged(values, truth, trials, (-np.inf, 1.0), 0.95).words == word
    assert judged(truth - 2, truth - 2, trials, (-np.inf, 1.0), 0.95).words == "met"


def test_trials_that_fail_when_integrated_again_leave_a_limit_undecided():
    values, trials = np.linspace(0.0, 0.5, 1000), np.arange(0, 1000, 50)
    precise = values.copy()
    assert judged(values, precise, trials, (-np.inf, 1.0)).words == "met"
    precise[trials[::4]] = np.nan  # a quarter of them, and so of the others
    found = judged(values, precise, trials, (-np.inf, 1.0))
    assert found.words == "undecided (integration error)"
    # and trials that fail in the run alone may have been within
    failed, precise = values.copy(), values
    failed[::5] = np.nan
    assert judged(failed, failed, trials, (-np.inf, 1.0)).words == "not met"
    found = judged(failed, precise, trials, (-np.inf, 1.0))
    assert found.words == "undecided (integration error)"


def test_an_undecided_verdict_keeps_its_number_of_trials():
    values, trials = np.linspace(0.0, 1.01, 300), np.arange(0, 300, 10)
    found = judged(values, values, trials, (-np.inf, 1.0), 0.99)
    assert found.words == "undecided" and found.needed > 300
