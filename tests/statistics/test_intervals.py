"""Intervals against the binomial distribution and SciPy, and their coverage."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom, binomtest

from tolstat.statistics.intervals.quantiles import _binomial_quantile, quantiles
from tolstat.statistics.intervals.shares import anytime_valid, proportion
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.sample import Sample
from tolstat.statistics.summary import summarize
from tolstat.status import Status


@pytest.mark.parametrize(
    ("count", "trials"), [(0, 10), (10, 10), (3, 64), (40, 4096), (1, 1)]
)
def test_shares_match_clopper_and_pearson(count, trials):
    expected = binomtest(count, trials).proportion_ci(0.95, method="exact")
    found = proportion(count, trials)
    assert found.value == count / trials
    assert (found.lower, found.upper) == pytest.approx((expected.low, expected.high))


@pytest.mark.parametrize("trials", [5, 30, 100, 473, 4096])
@pytest.mark.parametrize("share", [0.05, 0.5, 0.95, 0.99])
def test_quantile_intervals_cover_and_no_more_than_needed(trials, share):
    """With values 1..n the interval's ends are ranks; their coverage is binomial."""
    found = quantiles(np.arange(1.0, trials + 1), [share])[share]
    needed = math.ceil(math.log(0.025) / math.log(max(share, 1 - share)))
    if trials < needed:
        assert not found.sure and found.reason == f"needs {needed}"
        return
    low, high = int(found.lower), int(found.upper)
    assert binom.cdf(low - 1, trials, share) <= 0.025
    assert binom.cdf(low, trials, share) > 0.025 or low == trials
    assert binom.sf(high - 1, trials, share) <= 0.025
    assert binom.sf(high - 2, trials, share) > 0.025 or high == 1


@pytest.mark.parametrize("n", [1, 2, 17, 368, 4096, 100_000])
@pytest.mark.parametrize("share", [0.00135, 0.05, 0.5, 0.99, 0.99865])
def test_ranks_match_scipy(n, share):
    for probability in (0.005, 0.025, 0.5, 0.975, 0.995):
        expected = binom.ppf(probability, n, share)
        assert _binomial_quantile(probability, n, share) == expected


def test_coverage_on_a_skewed_distribution():
    rng = np.random.default_rng(10)
    true, inside = np.exp(1.6448536269514722), 0
    for _ in range(2000):
        found = quantiles(rng.lognormal(size=200), [0.95])[0.95]
        inside += found.lower <= true <= found.upper
    assert inside / 2000 > 0.95 - 3.5 * np.sqrt(0.95 * 0.05 / 2000)


def test_two_sided_numbers_of_wilks():
    # both ends with at most 2.5 % each
    for share, needed in ((0.95, 72), (0.05, 72), (0.5, 6)):
        assert quantiles(np.zeros(5), [share])[share].reason == f"needs {needed}"
    assert quantiles(np.empty(0), [0.5])[0.5].reason == "no trial is done"


def test_failed_trials_count_against():
    values = np.array([1.0, 2.0, np.nan, 3.0, np.nan])
    status = np.array(
        [Status.DONE, Status.DONE, Status.NOT_FINITE, Status.DONE, Status.NOT_RUN]
    )
    sample = Sample(status)
    found = summarize(values, sample, Limit(-np.inf, 2.5))
    assert found.quantiles[0.5].value == 2.5  # of 1, 2, 3 and one above all
    assert summarize(values, sample).quantiles[0.5].value == 2.0
    assert (found.least, found.largest) == (1.0, 3.0)
    assert found.limited.yields.fraction_out_of_limit == anytime_valid(2, 4)
    assert sample.failures == proportion(1, 4)
    nothing = summarize(values[2:3], Sample(status[2:3]), Limit(0.0, 1.0))
    assert nothing.mean.reason == "no trial is done"
