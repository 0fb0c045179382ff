"""Moments, performance and yield by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from tolstat.statistics.capability import by_moments, by_percentiles
from tolstat.statistics.moments import mean_of, moments, sigma_of
from tolstat.statistics.yields import yield_of

INF = math.inf
NORMAL = stats.norm(10, 2).ppf((np.arange(10_000) + 0.5) / 10_000)


def test_moments_are_scipys():
    x = np.random.default_rng(1).gamma(2.0, size=500)
    m = moments(x)
    assert m.skewness == pytest.approx(stats.skew(x))
    assert m.kurtosis == pytest.approx(stats.kurtosis(x))
    assert (m.mean, m.sigma) == (x.mean(), x.std(ddof=1))
    assert moments(np.full(500, 0.1)).sigma == 0.0


def test_the_mean_of_a_symmetric_response_has_students_interval():
    found = mean_of(NORMAL)
    known = stats.t.interval(0.95, 9999, 10, NORMAL.std(ddof=1) / 100)
    assert (found.lower, found.upper) == pytest.approx(known, rel=1e-6)
    assert mean_of(NORMAL[:100]).reason == "no trustworthy interval at 100 trials"
    assert mean_of(np.full(300, 0.1))[:3] == pytest.approx((0.1, 0.1, 0.1))


def test_the_mean_of_a_skewed_response_reaches_farther_up():
    found = mean_of(np.random.default_rng(1).lognormal(0, 1, 300))
    assert found.upper - found.value > 1.1 * (found.value - found.lower)


def test_sigma_of_a_normal_response():
    found = sigma_of(NORMAL)
    assert found.value == pytest.approx(2, rel=1e-3)
    # asymptotic: sigma / sqrt(2 n), and a tenth wider
    assert math.log(found.upper / found.value) == pytest.approx(
        1.1 * 1.96 / math.sqrt(2 * 10_000), rel=0.01
    )
    heavy = np.random.default_rng(1).lognormal(0, 1, 10_000)
    assert not sigma_of(heavy).sure and sigma_of(heavy).value > 0


@pytest.mark.parametrize(
    ("limit", "pp", "ppk"),
    [
        ((4.0, 16.0), 1.0, 1.0),
        ((4.0, 13.0), 0.75, 0.5),
        ((-INF, 13.0), None, 0.5),
        ((8.0, INF), None, 1 / 3),
        ((11.0, 17.0), 0.5, -1 / 6),  # the middle lies beyond
    ],
)
def test_performance_of_a_normal_response(limit, pp, ppk):
    for found in (by_percentiles(NORMAL, limit), by_moments(NORMAL, limit)):
        assert found.ppk.value == pytest.approx(ppk, rel=4e-3)
        assert found.ppk.lower < ppk < found.ppk.upper
        if pp is None:
            assert math.isnan(found.pp.value) and "one end" in found.pp.reason
        else:
            assert found.pp.value == pytest.approx(pp, rel=4e-3)
            assert found.pp.lower < pp < found.pp.upper


def test_performance_that_cannot_be_told():
    few = by_percentiles(NORMAL[::10], (-INF, 16.0)).ppk
    assert few.value == pytest.approx(1.0, abs=0.1) and not few.sure
    assert few.reason == "needs 3544 trials"
    few = by_percentiles(NORMAL[::10], (4.0, 16.0)).pp
    assert np.isnan([few.lower, few.upper]).all()  # no interval has one end
    assert "does not spread" in by_moments(np.ones(2000), (0.0, 2.0)).ppk.reason
    assert by_percentiles(np.ones(5000), (0.0, 2.0)).ppk.value == INF
    for trials in (1, 20, 3543, 5000):
        for limit in ((0.0, 1.0), (0.0, 2.0), (2.0, 3.0), (-INF, 2.0)):
            flat = by_percentiles(np.ones(trials), limit)
            assert flat.ppk.reason == "the response does not spread"
            one_end = "the limit has one end"
            assert flat.pp.reason == (flat.ppk.reason if limit[0] > -INF else one_end)
    assert "no trial" in by_percentiles(np.empty(0), (0.0, 2.0)).ppk.reason


def test_yield_with_failed_trials():
    values = np.arange(990.0)
    found = yield_of(values, 10, (-INF, 979.0))  # 10 beyond, 10 failed
    assert found.beyond.value == pytest.approx(0.020)
    known = stats.binomtest(20, 1000).proportion_ci(method="exact")
    assert found.beyond[1:3] == pytest.approx((known.low, known.high))
    assert found.least.value == pytest.approx(0.980)
    assert found.most.value == pytest.approx(0.990)
    assert found.verdict == "not met"


def test_one_failed_trial_in_384_counts():
    values = np.zeros(383)
    found = yield_of(values, 1, (-INF, 1.0), demanded=0.9)
    assert found.beyond.value == pytest.approx(1 / 384)
    assert found.least.value < found.most.value == 1.0


@pytest.mark.parametrize(
    ("beyond", "demanded", "verdict"),
    [(0, 0.99, "met"), (30, 0.99, "not met"), (10, 0.99, "undecided")],
)
def test_verdicts_take_the_whole_interval(beyond, demanded, verdict):
    values = np.r_[np.zeros(1000 - beyond), np.full(beyond, 2.0)]
    found = yield_of(values, 0, (-INF, 1.0), demanded)
    assert found.verdict == verdict
    assert (found.needed > 0) == (verdict == "undecided" and beyond != 10)


def test_an_undecided_limit_says_what_would_decide():
    values = np.r_[np.zeros(994), np.full(6, 2.0)]
    found = yield_of(values, 0, (-INF, 1.0), 0.99)
    assert found.verdict == "undecided" and found.needed in (2000, 4000)
    more = np.r_[
        np.zeros(994 * found.needed // 1000), np.full(6 * found.needed // 1000, 2)
    ]
    assert yield_of(more, 0, (-INF, 1.0), 0.99).verdict == "met"
