"""Tails: against OpenTURNS, SciPy, closed forms; refused where they must be."""

from __future__ import annotations

import numpy as np
import openturns as ot
import pytest
from scipy import stats
from scipy.optimize import brentq

from tolstat.statistics.tail_fit import (
    LEVELS,
    Pareto,
    anderson_darling,
    fit_pareto,
    level_of,
)
from tolstat.statistics.tails import upper_tail


def excesses(shape, n=2000, seed=0):
    return np.sort(stats.genpareto(shape).rvs(n, random_state=seed))


@pytest.mark.parametrize("shape", [-0.3, -0.05, 0.0, 0.2, 0.6])
def test_the_fit_is_the_one_of_openturns(shape):
    y = 3.0 * excesses(shape)
    found = fit_pareto(y)
    known = ot.GeneralizedParetoFactory().buildMethodOfLikelihoodMaximization(
        ot.Sample.BuildFromPoint(y), 0.0
    )
    ours, theirs = stats.genpareto, known.getParameter()
    likelihood = ours(found.shape, scale=found.scale).logpdf(y).sum()
    # at least as likely as what an optimiser of three others finds
    assert likelihood >= ours(theirs[1], scale=theirs[0]).logpdf(y).sum() - 1e-6
    assert found.shape == pytest.approx(theirs[1], abs=0.01)
    assert found.scale == pytest.approx(theirs[0], rel=0.01)


def test_no_neighbouring_fit_is_more_likely():
    y = excesses(0.3)
    found = fit_pareto(y)

    def likelihood(shape, scale):
        return stats.genpareto(shape, scale=scale).logpdf(y).sum()

    best = likelihood(*found)
    for shape in (-1e-3, 0.0, 1e-3):
        for scale in (-1e-3, 0.0, 1e-3):
            assert likelihood(found.shape + shape, found.scale + scale) <= best + 1e-9


@pytest.mark.parametrize("shape", [-0.2, 0.0, 0.4])
def test_anderson_darling_by_its_definition(shape):
    y = excesses(shape, 300)
    fit = Pareto(shape, 1.0)
    z = stats.genpareto(shape).cdf(y)
    i = np.arange(1, 301)
    known = -300 - np.mean((2 * i - 1) * (np.log(z) + np.log1p(-z[::-1])))
    assert anderson_darling(y, fit) == pytest.approx(known, rel=1e-9)


@pytest.mark.parametrize("shape", [-0.2, 0.1, 0.5])
def test_the_level_of_a_true_tail_is_uniform(shape):
    rng = np.random.default_rng(5)
    levels = []
    for _ in range(600):
        y = np.sort(stats.genpareto(shape).rvs(150, random_state=rng))
        fit = fit_pareto(y)
        levels.append(level_of(anderson_darling(y, fit), fit.shape))
    for level in LEVELS[1:-1]:
        rejected = np.mean(np.array(levels) <= level)
        assert abs(rejected - level) < 4 * np.sqrt(level * (1 - level) / 600)


def test_an_exponential_tail_goes_on_as_it_must():
    tail = upper_tail(np.random.default_rng(1).exponential(size=20_000))
    for share in (1e-3, 1e-4, 1e-5):
        found = tail.exceeded_by(share)
        assert found.lower < -np.log(share) < found.upper
    assert tail.trials == 20_000 and tail.exceedances == 283
    assert tail.level >= 0.1 and not tail.refused


def test_levels_and_shares_are_inverse():
    tail = upper_tail(np.random.default_rng(2).lognormal(size=5000))
    level = tail.exceeded_by(1e-3)
    found = tail.share_beyond(level.value)
    assert found.value == pytest.approx(1e-3, rel=1e-9)
    # a value at an end of one interval has the share at an end of its own
    assert tail.share_beyond(level.upper).upper == pytest.approx(1e-3, rel=0.05)
    assert tail.share_beyond(level.lower).lower == pytest.approx(1e-3, rel=0.05)


def test_a_tail_scales_and_shifts_with_its_response():
    x = np.random.default_rng(3).gumbel(size=5000)
    one, other = upper_tail(x), upper_tail(1e5 * x - 3e5)
    assert other.shape == pytest.approx(one.shape, abs=1e-6)
    a, b = one.exceeded_by(1e-4), other.exceeded_by(1e-4)
    for end in ("value", "lower", "upper"):
        assert getattr(b, end) == pytest.approx(1e5 * getattr(a, end) - 3e5, rel=1e-5)


def test_the_share_above_the_threshold_is_itself_uncertain():
    """At the threshold the interval is that of a binomial likelihood, at 99 %."""
    tail = upper_tail(np.random.default_rng(8).exponential(size=10_000))
    k, n = tail.exceedances, tail.trials
    found = tail.share_beyond(tail.threshold)
    assert found.value == k / n

    def lost(share):
        both = stats.binom.logpmf(k, n, [k / n, share])
        return both[0] - both[1] - stats.chi2.ppf(0.99, 1) / 2

    assert found.lower == pytest.approx(brentq(lost, 1e-3, k / n), rel=0.02)
    assert found.upper == pytest.approx(brentq(lost, k / n, 0.1), rel=0.02)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.arange(999.0), "needs 1000"),
        (np.round(np.random.default_rng(4).normal(size=5000), 1), "steps"),
        (np.zeros(5000), "steps"),
        # two kinds of machines: the tail is not of one piece
        (
            np.concatenate(
                [
                    np.random.default_rng(5).normal(size=4950),
                    np.random.default_rng(6).normal(9.0, 0.2, size=50),
                ]
            ),
            "no threshold gives a good fit",
        ),
    ],
)
def test_a_tail_that_is_none_is_refused(values, words):
    tail = upper_tail(values)
    assert words in tail.refused
    assert words in tail.exceeded_by(1e-3).reason
    assert not tail.share_beyond(1e9).sure


def test_too_far_is_not_told():
    tail = upper_tail(np.random.default_rng(7).exponential(size=2000))
    assert tail.exceeded_by(1 / 200_000).sure
    assert "too far to tell" in tail.exceeded_by(1 / 250_000).reason
    assert "too far to tell" in tail.share_beyond(1e3).reason
    assert "count the trials" in tail.share_beyond(0.0).reason
