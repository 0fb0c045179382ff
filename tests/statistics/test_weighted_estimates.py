"""Intervals of weighted trials: effect of cap and cut. See tests.studies.coverage."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from tolstat.statistics.intervals import weighted_estimates
from tolstat.statistics.intervals.moments import order_of
from tolstat.statistics.intervals.weighted_estimates import (
    weighted_quantiles,
    weighted_share,
)
from tolstat.statistics.intervals.weights import Weights, log_gain, mean_between
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.sample import Sample
from tolstat.statistics.summary import summarize
from tolstat.status import Status

N = 3000
SHARES = 0.05, 0.5, 0.95
Z = np.random.default_rng(5).standard_normal(N)
HALVED = Weights(np.exp(np.log(2) - 1.5 * Z**2), 2.0, 0.0)


def test_weights_of_one_change_nothing_but_rounding():
    ones = Weights(np.ones(N))
    plain = mean_between(Z, -20.0, 20.0)
    assert mean_between(Z, -20.0, 20.0, weights=ones) == pytest.approx(plain, abs=2e-3)
    found = weighted_quantiles(Z, ones, [0.9])[0.9]
    assert found.lower < norm.ppf(0.9) < found.upper
    assert found.value == pytest.approx(np.quantile(Z, 0.9), abs=0.01)


def test_all_numbers_match_units_of_the_new_distribution():
    sample = Sample(np.full(N, Status.DONE), weights=HALVED)
    found = summarize(Z, sample, Limit(-1.2, 1.2, 0.95), (-20.0, 20.0))
    for estimate, truth in (
        (found.mean, 0.0),
        (found.sigma, 0.5),
        (found.quantiles[0.05], 0.5 * norm.ppf(0.05)),
        (found.quantiles[0.99], 0.5 * norm.ppf(0.99)),
        (found.limited.yields.within, 1 - 2 * norm.sf(2.4)),
        (found.limited.moments.ppk, 0.8),
    ):
        assert estimate.lower < truth < estimate.upper
    assert found.limited.yields.verdict == "met"
    assert found.limited.percentiles.ppk.reason.endswith("too few with these weights")


def test_the_cut_widens_every_interval():
    cut = Weights(HALVED.values, 2.0, 0.01)
    beyond = Z > 1.0
    sharp, wide = weighted_share(beyond, HALVED), weighted_share(beyond, cut)
    assert wide.upper == pytest.approx(sharp.upper + 0.01)
    left = weighted_share(beyond, cut).complement
    assert left.lower == pytest.approx(1 - wide.upper)
    a, b = (mean_between(Z, -5.0, 5.0, weights=w) for w in (HALVED, cut))
    assert b[1] - a[1] > 0.03 and a[0] - b[0] > 0.03
    x, y = (weighted_quantiles(Z, w, [0.5])[0.5] for w in (HALVED, cut))
    assert y.upper > x.upper and y.lower < x.lower


def test_shares_of_zero_and_one_have_one_sided_intervals():
    # the weights of a sample add up to its number only on the average
    assert abs(HALVED.values.sum() / N - 1) > 1e-3
    all_of_them, none = np.ones(N, np.bool_), np.zeros(N, np.bool_)
    whole, nothing = (weighted_share(of, HALVED) for of in (all_of_them, none))
    assert whole.value == 1 == whole.upper > whole.lower > 0.9
    assert nothing.value == 0 == nothing.lower < nothing.upper < 0.1
    assert weighted_share(~none, HALVED).complement[:3] == (0.0, 0.0, 1 - whole.lower)
    for most in (Z < 2.0, Z > -0.1):
        a, b = weighted_share(most, HALVED), weighted_share(most, HALVED).complement
        assert a.lower < a.value < a.upper
        assert a.value + weighted_share(~most, HALVED).value == pytest.approx(1)
        assert b.value == pytest.approx(1 - a.value)


@pytest.mark.parametrize("weights", [Weights(np.ones(N)), HALVED], ids=["one", "own"])
def test_a_quantile_too_far_out_has_no_end_on_either_side(weights):
    """Where all trials may lie above it; what is low is high in a mirror."""
    for share in (0.0005, 0.001, 0.01, 0.4):
        low = weighted_quantiles(Z, weights, [share])[share]
        high = weighted_quantiles(-Z, weights, [1 - share])[1 - share]
        if (1 - share) ** N > 0.025:  # all may lie above it: no interval can be
            assert low.reason == f"{N} trials are too few with these weights"
            assert np.isnan(low.lower) and np.isnan(low.upper)
        else:
            assert low.lower < low.value < low.upper
        assert high.reason == low.reason
        mirrored = (-low.upper, -low.lower)
        assert high[1:3] == pytest.approx(mirrored, nan_ok=True)


def test_failed_trials_have_weights():
    status = np.where(Z > 0.8, Status.NOT_FINITE, Status.DONE)
    values = np.where(Z > 0.8, np.nan, Z)
    sample = Sample(status, weights=HALVED)
    found = summarize(values, sample, Limit(-np.inf, 10.0))
    failing = norm.sf(1.6)
    assert sample.failures.lower < failing < sample.failures.upper
    yields = found.limited.yields
    assert (
        yields.fraction_out_of_limit.lower
        < failing
        < yields.fraction_out_of_limit.upper
    )
    assert yields.within_at_most.value == 1.0
    assert found.quantiles[0.99].reason == "failed trials may lie there"
    # the mean of those that are done
    known = -0.5 * norm.pdf(1.6) / norm.cdf(1.6)
    assert found.mean.lower < known < found.mean.upper


def test_too_small_an_effective_sample_size_gives_no_interval():
    heavy = Weights(np.where(np.arange(N) < 100, 30.0, 0.0))
    assert heavy.number == 100
    for found in (
        weighted_share(Z > 0, heavy),
        weighted_quantiles(Z, heavy, [0.5])[0.5],
    ):
        assert (
            found.reason == "effective sample size 100; 150 needed" and not found.sure
        )


def test_failed_trials_of_unknown_side_have_weighted_quantiles():
    """Without a limit, or with one of two ends, it may be on either."""
    status = np.full(N, Status.DONE)
    status[7] = Status.NOT_FINITE
    values = np.where(status == Status.DONE, Z, np.nan)
    for limit in (None, Limit(-3.0, 3.0)):
        found = summarize(values, Sample(status, weights=HALVED), limit)
        for share in (0.05, 0.5, 0.95):
            each = found.quantiles[share]
            assert each.value == pytest.approx(0.5 * norm.ppf(share), abs=0.04)
            assert each.lower < each.value < each.upper


def test_ends_of_a_quantile_are_those_of_every_trial_tried():
    """Few exact gains find what all find, with equal and infinite values too."""
    rng = np.random.default_rng(3)
    w = HALVED.values
    for values in (Z, np.round(Z, 1), np.where(rng.uniform(size=N) < 0.6, 0.0, Z)):
        values = np.where(rng.uniform(size=N) < 0.01, np.inf, values)
        for weights in (HALVED, Weights(w, 2.0, 0.003), Weights(np.ones(N))):
            order = order_of(N)
            mixed, part = values[order], weights.part(order)
            at = np.unique(values)[::7]  # of a monotone gain, some places suffice
            for share, found in weighted_quantiles(values, weights, SHARES).items():
                more = [log_gain(mixed <= x, share, 0.025, part) > 0 for x in at]
                less = [log_gain(mixed > x, 1 - share, 0.025, part) > 0 for x in at]
                assert more == (at >= found.upper).tolist()
                assert less == (at < found.lower).tolist()


def test_ends_of_quantiles_take_few_passes(monkeypatch):
    """A pass reads all trials; a search by halves takes 11 for each end."""
    passes = []
    monkeypatch.setattr(
        weighted_estimates,
        "log_gain",
        lambda *given: (passes.append(0), log_gain(*given))[1],
    )
    weighted_quantiles(Z, HALVED, SHARES)
    assert len(passes) <= 4 * 2 * len(SHARES)
