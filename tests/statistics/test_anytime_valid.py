"""Anytime-valid verdicts."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import beta, binom

from tolstat.statistics.intervals.shares import (
    anytime_valid,
    evidence_against,
    proportion,
)
from tolstat.statistics.sample_size import (
    fewest_trials,
    trials_enough,
    trials_that_decide,
)

BAR = 0.0027


@pytest.mark.parametrize(("count", "trials"), [(0, 50), (3, 500), (40, 100)])
def test_the_evidence_is_an_averaged_ratio_of_likelihoods(count, trials):
    share = 0.45
    weight = beta(0.5, 0.5)

    def ratio(p):
        return binom.pmf(count, trials, p) / binom.pmf(count, trials, share)

    whole = quad(lambda p: ratio(p) * weight.pdf(p), 0, share, limit=200)[0]
    assert np.exp(evidence_against(count, trials, share)) == pytest.approx(
        whole / weight.cdf(share), rel=1e-6
    )


@pytest.mark.parametrize(
    ("count", "trials"), [(0, 1), (0, 4096), (5, 4096), (2048, 4096), (270, 100_000)]
)
def test_intervals_contain_exact_intervals_and_are_symmetric(count, trials):
    found, once = anytime_valid(count, trials), proportion(count, trials)
    assert found.value == once.value
    assert found.lower <= once.lower and once.upper <= found.upper
    assert found.upper - found.lower < 2 * (once.upper - once.lower)
    mirrored = anytime_valid(trials - count, trials)
    assert mirrored.lower == pytest.approx(1 - found.upper, abs=1e-12)


def test_checking_after_every_trial_keeps_the_error_rate():
    """And an exact interval of one look would."""
    rng, share = np.random.default_rng(1), 0.1
    looks = np.unique(np.geomspace(10, 5000, 60).astype(int))
    counts = np.add.reduceat(
        rng.random((600, looks[-1])) < share, np.append(0, looks[:-1]), axis=1
    ).cumsum(axis=1)
    ends = {
        (count, n): (anytime_valid(count, n), proportion(count, n))
        for n, column in zip(looks.tolist(), counts.T, strict=True)
        for count in set(column.tolist())
    }
    missed = np.zeros((2, len(counts)), bool)
    for i, row in enumerate(counts):
        for count, n in zip(row.tolist(), looks.tolist(), strict=True):
            for kind, found in enumerate(ends[count, n]):
                missed[kind, i] |= found.upper < share
    assert missed[0].mean() <= 0.025
    assert missed[1].mean() > 0.05


def test_zero_out_of_limit_decides_after_some_trials():
    assert anytime_valid(0, 1700).upper < BAR < anytime_valid(0, 1600).upper


@pytest.mark.parametrize("times", [1, 4])
def test_the_fewest_trials_without_one_out_of_limit_show_a_share(times):
    fewest = fewest_trials(BAR, times)
    assert anytime_valid(0, times * fewest).upper <= BAR
    assert anytime_valid(0, times * int(0.9 * fewest)).upper > BAR


def test_planned_trials_are_enough_if_they_decide_with_the_fraction_so_far():
    assert trials_enough(0, 100, BAR, 1700) == 1700  # met
    assert trials_enough(10, 100, BAR, 1700) == 1700  # not met
    assert trials_enough(0, 100, BAR, 1600) == trials_that_decide(0, 100, BAR) > 1600


@pytest.mark.parametrize("trials", [300, 2000])
def test_the_printed_number_of_trials_decides_with_its_probability(trials):
    """Over shares as Jeffreys' prior, near the bar, has them."""
    rng = np.random.default_rng(trials)
    asked = decided = 0
    for _ in range(400):
        share = rng.uniform(0, np.sqrt(4 * BAR)) ** 2  # its density there
        count = rng.binomial(trials, share)
        found = anytime_valid(count, trials)
        if not found.lower <= BAR <= found.upper:
            continue
        more = trials_that_decide(count, trials, BAR)
        assert more > trials
        again = anytime_valid(count + rng.binomial(more - trials, share), more)
        asked += 1
        decided += not again.lower <= BAR <= again.upper
    assert decided / asked > 0.8 - 3 * np.sqrt(0.16 / asked)
    assert decided / asked < 0.97


def test_a_share_at_the_demanded_value_is_never_decided():
    assert trials_that_decide(270_000_000, 10**11, BAR) == 0
