"""Moments, performance and yield by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from tolstat.statistics.intervals.as_sampled import skewness, spreads
from tolstat.statistics.intervals.moments import Reach, mean_of, sigma_of, unseen
from tolstat.statistics.intervals.quantiles import quantiles
from tolstat.statistics.intervals.shares import anytime_valid
from tolstat.statistics.intervals.weights import least_mean, mean_between
from tolstat.statistics.limits.limit import Limit, ppk_of, yield_of_ppk
from tolstat.statistics.limits.yields import joint_yield, yield_of
from tolstat.statistics.sample import Sample, quantiles_at
from tolstat.statistics.summary import (
    MovedNumbers,
    ResponseUncertainty,
    by_moments,
    by_percentiles,
    by_share,
    summarize,
)
from tolstat.status import Status

INF = math.inf
NORMAL = stats.norm(10, 2).ppf((np.arange(10_000) + 0.5) / 10_000)


def test_skewness_matches_scipy():
    rng = np.random.default_rng(1)
    for x in (rng.gamma(k, size=500) for k in (0.1, 0.5, 1.0, 2.0, 50.0)):
        assert skewness(x) == pytest.approx(stats.skew(x) / math.sqrt(500))
    assert not spreads(np.full(500, 0.1)) and math.isnan(skewness(np.full(500, 0.1)))


def test_the_mean_of_a_normal_response():
    """About 1.4 times as wide as Student's: the price of asking for no shape."""
    found = mean_of(NORMAL)
    known = stats.t.interval(0.95, 9999, 10, NORMAL.std(ddof=1) / 100)
    times = (found.upper - found.lower) / (known[1] - known[0])
    assert 1.3 < times < 1.5 and found.lower < known[0] and found.upper > known[1]
    assert mean_of(NORMAL[:19]).reason == "needs 20"
    assert mean_of(np.empty(0)).reason == "no trial is done"


def test_equal_trials_give_no_mean_interval_without_a_range():
    nothing = np.zeros(200)
    found = mean_of(nothing)
    assert (
        found.value == 0.0
        and found.reason == "all trials are equal: 1 unit in 42 may differ"
    )
    share = mean_of(nothing, Reach((0.0, 1.0)))
    # as little as can be: each trial was none with the probability 1 - p
    assert share.lower == 0.0
    assert 1 - 0.025 ** (1 / 200) < share.upper < 1.5 * (1 - 0.025 ** (1 / 200))
    assert sigma_of(nothing, Reach((0.0, 1.0))).upper < np.sqrt(share.upper) * 1.1
    one_end = mean_of(np.random.default_rng(1).exponential(size=500), Reach((0.0, INF)))
    assert one_end.sure


def test_bets_are_fair():
    """Of any distribution between the ends, whatever its shape; ever so few trials."""
    rng, missed = np.random.default_rng(3), np.zeros(4)
    for _ in range(400):
        for i, (x, mean) in enumerate(
            (
                ((rng.random(40) < 0.5) * 1.0, 0.5),
                ((rng.random(40) < 0.03) * 1.0, 0.03),
                (rng.random(40) ** 3, 0.25),
                (rng.beta(0.1, 0.3, 40), 0.25),
            )
        ):
            lower, upper = mean_between(x, 0.0, 1.0)
            assert 0 <= lower <= upper <= 1
            missed[i] += not lower <= mean <= upper
    assert (missed / 400 <= 0.05).all()


def test_the_order_of_the_trials_does_not_matter_to_a_mean():
    x = np.random.default_rng(4).gamma(2.0, size=2000)
    for of in (mean_of, sigma_of):
        a, b = of(x), of(np.sort(x))
        assert b.lower == pytest.approx(a.lower, rel=0.05)
        assert b.upper == pytest.approx(a.upper, rel=0.05)


def test_a_lower_bound_needs_no_upper_end():
    x = np.random.default_rng(5).lognormal(size=2000)
    assert least_mean(x, 0.0, 0.025) == mean_between(x, 0.0, 1e9)[0]
    assert mean_between(x, 0.0, 1e9)[1] > 1e3


def test_sigma_of_a_normal_response():
    found = sigma_of(NORMAL)
    assert found.value == pytest.approx(2, rel=1e-3)
    assert 1.9 < found.lower < 2 < found.upper < 2.3
    heavy = np.random.default_rng(1).lognormal(0, 1, 10_000)
    assert sigma_of(heavy).upper > 1.3 * sigma_of(heavy).value
    few = np.where(np.arange(1000) < 19, np.arange(1000.0), 0.0)
    assert sigma_of(few).reason == "only 18 trials differ from all others"
    assert sigma_of(few, Reach((0.0, 1000.0))).sure


def test_reasons_for_missing_intervals():
    # both extremes of n: 1 - n q^(n-1) + (n-1) q^n = 95 %
    for n in (50, 1000, 4096):
        q = 1 - unseen(n)
        assert n * q ** (n - 1) - (n - 1) * q**n == pytest.approx(0.05)
    assert unseen(1) == 1.0


def all_done(values):
    return Sample(np.full(len(values), Status.DONE))


def performance(of, values, limit, **more):
    return of(values, all_done(values), Limit(*limit), **more)


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
    for of in (by_percentiles, by_moments):
        found = performance(of, NORMAL, limit)
        assert found.ppk.value == pytest.approx(ppk, rel=4e-3)
        assert found.ppk.lower < ppk < found.ppk.upper
        if pp is None:
            assert math.isnan(found.pp.value) and "one end" in found.pp.reason
        else:
            assert found.pp.value == pytest.approx(pp, rel=4e-3)
            assert found.pp.lower < pp < found.pp.upper


def test_performance_that_is_not_estimable():
    def by(values, limit):
        return performance(by_percentiles, np.asarray(values), limit)

    few = by(NORMAL[::10], (-INF, 16.0)).ppk
    assert few.value == pytest.approx(1.0, abs=0.1) and not few.sure
    assert few.reason == "needs 3544"
    assert performance(by_moments, NORMAL[::10], (-INF, 16.0)).ppk.sure
    few = by(NORMAL[::10], (4.0, 16.0)).pp
    assert np.isnan([few.lower, few.upper]).all()  # no interval has one end
    still = performance(by_moments, np.ones(2000), (0.0, 2.0)).ppk
    assert still.reason == "the response does not spread"
    for trials in (1, 20, 3543, 5000):
        for limit in ((0.0, 1.0), (0.0, 2.0), (2.0, 3.0), (-INF, 2.0)):
            flat = by(np.ones(trials), limit).ppk
            assert flat.reason == "the response does not spread"
            assert math.isnan(flat.value)
    assert "no trial" in by(np.empty(0), (0.0, 2.0)).ppk.reason
    # half of the machines or more, or all of the outermost, at one value
    tied = np.where(np.arange(10_000) < 200, 1.0, 0.0)
    assert "the same value" in by(tied, (-INF, 0.5)).ppk.reason
    assert by(1e-9 * NORMAL, (-INF, 1.0)).ppk.reason == "over 100: hardly any spread"


def test_verdict_and_ppk_have_one_threshold():
    """A normal response with Ppk 1: 1350 per million beyond one end."""
    one, two = Limit(-INF, 16.0), Limit(4.0, 16.0)
    assert yield_of_ppk(1.0, 1) == pytest.approx(0.99865, abs=1e-6)
    assert one.ppk == pytest.approx(stats.norm.ppf(0.9973) / 3)
    assert two.ppk == pytest.approx(1.0, abs=1e-4)
    for limit in (one, two):
        assert ppk_of(1 - yield_of_ppk(1.33, limit.ends), limit.ends) == pytest.approx(
            1.33
        )
    beyond = judged_of(NORMAL, 0, one.permitted).fraction_out_of_limit
    found = by_share(beyond, one)
    assert found.lower < 1.0 < found.upper
    assert found.value == pytest.approx(-stats.norm.ppf(beyond.value) / 3)
    none = by_share(
        judged_of(NORMAL, 0, (-INF, 99.0)).fraction_out_of_limit, Limit(-INF, 99.0)
    )
    assert none.value == none.upper == INF and none.lower > 1


def judged_of(values, failed, limit, demanded=0.9973):
    """Judge trials of which so many more failed."""
    status = np.full(len(values) + failed, Status.DONE)
    status[len(values) :] = Status.NOT_FINITE
    every = np.append(values, np.full(failed, np.nan))
    return yield_of(every, Sample(status), limit, demanded)


def test_yield_with_failed_trials():
    values = np.arange(990.0)
    found = judged_of(values, 10, (-INF, 979.0))  # 10 beyond, 10 failed
    assert found.fraction_out_of_limit == anytime_valid(20, 1000)
    assert found.within.value == pytest.approx(0.980)
    assert found.within_at_most.value == pytest.approx(0.990)
    assert found.verdict == "not met"


def test_one_failed_trial_in_384_counts():
    found = judged_of(np.zeros(383), 1, (-INF, 1.0), demanded=0.9)
    assert found.fraction_out_of_limit.value == pytest.approx(1 / 384)
    assert found.within.value < found.within_at_most.value == 1.0


@pytest.mark.parametrize(
    ("beyond", "demanded", "verdict"),
    [(0, 0.99, "met"), (30, 0.99, "not met"), (10, 0.99, "undecided")],
)
def test_verdicts_use_the_whole_interval(beyond, demanded, verdict):
    values = np.r_[np.zeros(1000 - beyond), np.full(beyond, 2.0)]
    found = judged_of(values, 0, (-INF, 1.0), demanded)
    assert found.verdict == verdict
    assert (found.needed > 0) == (verdict == "undecided")


def test_all_limits_at_once():
    a, b = np.arange(1000.0), np.arange(1000.0)[::-1]
    status = np.full(1000, Status.DONE)
    status[500] = Status.NOT_FINITE
    found = joint_yield(
        {"a": a, "b": b, "c": a}, Sample(status), {"a": (-INF, 899.0), "b": (10.0, INF)}
    )
    assert found.value == pytest.approx((1000 - 100 - 1) / 1000)
    assert found == anytime_valid(899, 1000)


def test_failed_trials_count_out_of_limit_or_anywhere():
    x = np.random.default_rng(6).normal(size=2000)
    failed = x > np.quantile(x, 0.98)
    status = np.where(failed, Status.NOT_FINITE, Status.DONE)
    values = np.where(failed, np.nan, x)
    known = quantiles(x, [0.05, 0.95, 0.99])
    above = quantiles_at(values, Sample(status), [0.05, 0.95, 0.99], (-INF, 1.0))
    assert above[0.05] == known[0.05] and above[0.95] == known[0.95]
    assert above[0.99].reason == "failed trials may lie there"
    anywhere = quantiles_at(values, Sample(status), [0.05, 0.95], (-1.0, 1.0))
    assert anywhere[0.95].upper == known[0.95].upper
    assert anywhere[0.95].lower < known[0.95].lower
    assert anywhere[0.05].lower < known[0.05].lower
    assert anywhere[0.05].upper == known[0.05].upper
    below = quantiles_at(values, Sample(status), [0.95], (-1.0, INF))[0.95]
    assert below.upper < known[0.95].upper


def test_counts_tell_that_tails_are_not_those_of_a_normal_response():
    """Few trials say little of quantiles, and enough of the trials out of limit."""
    normal = np.random.default_rng(3).standard_normal(4096)
    jams = normal.copy()
    jams[:8] = 9.5
    for values, known in ((normal, True), (jams, False)):
        summary = summarize(values, all_done(values), Limit(-INF, 9.0))
        far = summary.mean.value + 3 * summary.sigma.value
        tail = summary.quantiles[0.99865]
        assert tail.lower <= far <= tail.upper  # quantiles show no difference
        assert summary.normal_tails is known


def test_no_uncertainty_makes_a_sigma_negative():
    values = np.random.default_rng(3).standard_normal(1000)
    gains = np.linspace(-3.0, 3.0, 41)
    every = dict.fromkeys(summarize(values, all_done(values)).quantiles, gains)
    moved = MovedNumbers(gains, gains, every)
    uncertainty = ResponseUncertainty(None, moved)
    summary = summarize(values, all_done(values), uncertainty=uncertainty)
    assert summary.mean.lower < -2.0
    assert summary.sigma.lower == summary.sigma_for_any_distribution.lower == 0.0
