"""Mean and sigma as sampled: widths beside chi-square's, coverage, few trials."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tolstat.statistics.intervals.as_sampled import (
    few_dominate,
    mean_as_sampled,
    sigma_as_sampled,
)


def studies(draw, n, count=400):
    rng = np.random.default_rng(n)
    return [draw(rng, n) for _ in range(count)]


def normal(rng, n):
    return rng.normal(10.0, 2.0, n)


@pytest.mark.parametrize("n", [300, 1000])
def test_of_a_normal_response_they_are_as_wide_as_the_classical_ones(n):
    every = studies(normal, n)
    means, sigmas = (
        [of(x) for x in every] for of in (mean_as_sampled, sigma_as_sampled)
    )
    student = 2 * stats.t.ppf(0.975, n - 1) * 2.0 / np.sqrt(n)
    assert np.mean([x.upper - x.lower for x in means]) == pytest.approx(
        student, rel=0.02
    )
    ends = 2.0 * np.sqrt((n - 1) / stats.chi2.ppf([0.025, 0.975], n - 1))
    width = np.mean([x.upper - x.lower for x in sigmas]) / (ends[0] - ends[1])
    assert 0.98 < width < 1.1
    assert [x.value for x in sigmas] == pytest.approx([x.std(ddof=1) for x in every])


def test_they_follow_skewness():
    """Student's interval of the mean of a skewed response misses more often."""
    every = studies(lambda rng, n: rng.lognormal(size=n), 100, 2000)
    truth, t = np.exp(0.5), stats.t.ppf(0.975, 99)
    known = [(x, mean_as_sampled(x)) for x in every]
    known = [(x, found) for x, found in known if found.sure]
    held = np.mean([found.lower <= truth <= found.upper for _, found in known])
    student = np.mean([abs(x.mean() - truth) <= t * stats.sem(x) for x, _ in known])
    assert len(known) > 1900 and student < 0.93 < 0.95 < held


def test_few_trials_have_no_interval_as_sampled():
    x = np.zeros(1000)
    x[:2] = 1.0
    assert "few trials dominate" in mean_as_sampled(x).reason
    assert few_dominate(x) and few_dominate(np.zeros(1000))
    assert mean_as_sampled(x[:49]).reason == "needs 50"
    x[:200] = 1.0
    assert mean_as_sampled(x).sure and not few_dominate(x)


def test_between_replicates_the_scatter_counts():
    x = np.tile(np.random.default_rng(1).normal(size=256), 16)
    replicate = np.repeat(np.arange(16), 256)
    assert mean_as_sampled(x, replicate=replicate).lower == pytest.approx(x.mean())
    x += 0.01 * np.repeat([-1.0, 1.0], 8 * 256)
    found = mean_as_sampled(x, replicate=replicate)
    each = np.repeat([-0.01, 0.01], 8)
    half = 1.1 * stats.t.ppf(0.975, 15) * stats.sem(each)
    assert found.upper - found.value == pytest.approx(half, rel=0.01)


@pytest.mark.parametrize("of", [mean_as_sampled, sigma_as_sampled])
def test_units_do_not_matter(of):
    x = np.random.default_rng(2).lognormal(size=300)
    for unit in (1e-170, 1e170):
        assert np.array(of(unit * x)[:3]) / unit == pytest.approx(np.array(of(x)[:3]))
