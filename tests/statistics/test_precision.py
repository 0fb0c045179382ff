"""Requested precision, and when it is reached."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.integration_error import integration_error
from tolstat.statistics.sample import Sample
from tolstat.statistics.sample_size import (
    Precision,
    Statistic,
    next_stage,
    trials_wanted,
)
from tolstat.status import Status

MEDIAN = Statistic("y", "quantile", 0.5)


def done(n):
    return Sample(np.full(n, Status.DONE))


def test_the_missing_precision():
    two_percent = Precision(MEDIAN, 0.02, True)
    assert two_percent.missing(Estimate(10.0, 9.8, 10.2)) == pytest.approx(1.0)
    assert two_percent.missing(Estimate(-10.0, -10.4, -9.6)) == pytest.approx(2.0)
    assert two_percent.missing(Estimate(10.0, reason="needs 3000")) == np.inf
    assert two_percent.missing(Estimate(0.0, -0.1, 0.1)) == np.inf
    assert two_percent.missing(Estimate(0.0, 0.0, 0.0)) == 0
    absolute = Precision(MEDIAN, 0.5, False)
    assert absolute.missing(Estimate(0.0, -0.25, 0.25)) == pytest.approx(0.5)


def test_the_interval_sets_the_length_of_a_stage():
    y = np.random.default_rng(0).normal(10.0, 1.0, 1024)
    sample = done(1024)
    half = (MEDIAN.estimate(y, sample).upper - MEDIAN.estimate(y, sample).lower) / 2
    reached = Precision(MEDIAN, 1.01 * half, False)

    def wanted(*rules):
        return trials_wanted(rules, {"y": y}, sample, {}, {})

    assert wanted(reached) == 0
    twice = Precision(MEDIAN, half / 2, False)
    assert wanted(reached, twice) == pytest.approx(1.1 * 4 * 1024)
    asked = next_stage(1024, wanted(reached, twice))
    assert asked % 256 == 0 and 1.1 * 4 * 1024 <= asked < 1.1 * 4 * 1024 + 256
    far = Precision(MEDIAN, half / 100, False)
    assert next_stage(1024, wanted(far)) == 8 * 1024


def test_the_interval_of_a_skewed_mean_shrinks_faster_than_the_root():
    """Half the mean is in 1 of 50: by the root, five times as many seem needed."""
    rng, needed = np.random.default_rng(7), []
    rule = Precision(Statistic("y", "mean"), 0.2, True)

    def draw(n):
        return np.where(rng.random(n) < 0.02, rng.exponential(size=n), 0.0)

    for _ in range(15):
        y = draw(1024)
        needed.append(trials_wanted([rule], {"y": y}, done(1024), {}, {}))
    y = draw(60_000)
    first = 8000
    while trials_wanted([rule], {"y": y[:first]}, done(first), {}, {}):
        first += 1000
    assert 0.5 < np.median(needed) / first < 2


def test_a_rule_does_not_end_with_equal_trials():
    nothing, mean = np.zeros(1024), Statistic("y", "mean")
    for rule in (Precision(mean, 0.2, True), Precision(mean, 1e-3, False)):
        for ranges in ({}, {"y": (0.0, 1.0)}):
            assert trials_wanted([rule], {"y": nothing}, done(1024), {}, ranges) > 1024
    assert next_stage(1024, np.inf) == 8 * 1024


def test_a_fraction_out_of_limit_counts_failed_trials():
    y = np.full(2000, 1.0)
    y[:100] = np.nan
    status = np.full(2000, Status.DONE)
    status[:100] = Status.NOT_FINITE
    sample = Sample(status)
    beyond = Statistic("y", "beyond").estimate(y, sample, (-np.inf, 2.0))
    assert beyond.value == 0.05 and beyond.lower < 0.05 < beyond.upper


def test_errors_are_subtracted_from_similar_trials():
    values = np.array([0.0, 0.0, 10.0, 11.0, 20.0, np.nan])
    trials = np.array([1, 2, 4, 5])
    precise = np.array([0.0, 9.9, 20.4, 3.0])
    every = np.ones(4, bool)
    found = integration_error(values, trials, precise, every)
    assert found.failed == 1 and found.largest == pytest.approx(0.4)
    np.testing.assert_allclose(
        found.removed(values), [0.0, 0.0, 9.9, 10.9, 20.4, np.nan]
    )
    none = integration_error(values, trials[:0], precise[:0], every[:0])
    assert np.isnan(none.largest) and np.isnan(none.removed(values)).all()


def test_the_median_of_two_modes_never_seems_precise():
    """Of 0 and 1, equally likely, it has a narrow interval in 5 % of studies."""
    rng, ended, narrow = np.random.default_rng(3), 0, 0
    rule = Precision(Statistic("y", "quantile", 0.5), 0.05, False)
    for _ in range(400):
        y = rng.integers(0, 2, 1024) + 0.01 * rng.normal(size=1024)
        sample = Sample(np.full(1024, Status.DONE))
        narrow += rule.missing(rule.statistic.estimate(y, sample)) <= 1
        ended += trials_wanted([rule], {"y": y}, sample, {}, {}) == 0
    assert narrow > 10 and ended <= 3
