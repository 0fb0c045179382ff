"""Intervals of Latin hypercube and Sobol' samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tolstat.deviations.draw import SAMPLERS
from tolstat.statistics.intervals.moments import Reach, mean_of
from tolstat.statistics.intervals.replicates import (
    mean_of_replicates,
    never_met,
    quantile_of_replicates,
    share_from_replicates,
)
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.sample import Sample
from tolstat.statistics.summary import summarize


def responses(sampling, seed, trials=512):
    """A product of two normal numbers and a sum of squares: mean 4."""
    streams = {f"part_{i}": i for i in range(4)}
    sampler = SAMPLERS[sampling]
    z = stats.norm.ppf(sampler.unit_samples(seed, streams, trials))
    return np.sum(z**2, axis=1) + z[:, 0] * z[:, 1], sampler.replicates


def numbers(n):
    return np.arange(n) % 16


@pytest.mark.parametrize(("sampling", "width"), [("latin", 0.95), ("sobol", 0.85)])
def test_intervals_of_replicates_cover(sampling, width):
    """And what as many random trials would give is wider."""
    inside, widths, plain = 0, [], []
    for seed in range(100):
        y, replicates = responses(sampling, seed, 4096)
        found = mean_of_replicates(y, np.arange(len(y)) % replicates)
        inside += found.lower <= 4.0 <= found.upper
        widths.append(found.upper - found.lower)
        random = mean_of(y)
        plain.append(random.upper - random.lower)
    assert inside / 100 > 0.93 - 3 * np.sqrt(0.07 * 0.93 / 100)
    assert np.mean(widths) < width * np.mean(plain)


def test_a_summary_of_replicates():
    y, replicates = responses("sobol", 1, 4096)
    status = np.ones(4096, int)
    status[:8] = 4
    sample = Sample(status, replicates)
    found = summarize(
        np.where(status == 1, y, np.nan), sample, Limit(-np.inf, 12.0, 0.9)
    )
    assert found.mean.value == y[8:].mean() and found.mean.sure
    assert found.sigma.sure and found.quantiles[0.95].sure
    assert found.quantiles[0.99865].reason == "needs 22223"
    yields = found.limited.yields
    assert yields.fraction_out_of_limit.value == pytest.approx(
        np.mean((y > 12) | (status == 4))
    )
    assert yields.within_at_most.value - yields.within.value == pytest.approx(8 / 4096)
    assert yields.verdict == "met"
    assert found.limited.percentiles.ppk.reason.startswith("needs")
    assert found.limited.moments.ppk.sure


def test_a_share_that_no_trial_has_is_bounded():
    found = share_from_replicates(np.zeros(4096, bool), numbers(4096))
    assert found.value == found.lower == 0.0
    assert found.upper == never_met(4096, 16) == pytest.approx(4.15 / 4096, rel=1e-3)
    # sixteen replicates, of which each meets it with a probability of 1 - 1/(1 + m p)
    m, p = 256, found.upper
    assert (1 / (1 + m * p)) ** 16 == pytest.approx(0.025)
    good = Sample(np.ones(4096, int), 16)
    met = summarize(np.zeros(4096), good, Limit(-1.0, 1.0)).limited.yields
    assert met.verdict == "met" and met.within.upper == 1.0
    few = Sample(np.ones(1024, int), 16)
    unsure = summarize(np.zeros(1024), few, Limit(-1.0, 1.0)).limited.yields
    assert unsure.verdict == "undecided" and 1537 <= unsure.needed < 2000


def test_quantiles_lie_within_the_trials():
    y = responses("latin", 3, 4096)[0]
    for share in (0.05, 0.5, 0.95, 0.99):
        found = quantile_of_replicates(y, numbers(4096), share)
        assert y.min() <= found.lower <= found.value <= found.upper <= y.max()
        assert np.mean(y <= found.lower) < share < np.mean(y <= found.upper)
    assert quantile_of_replicates(y, numbers(4096), 0.995).reason == "needs 6000"


def test_failed_replicated_trials_count_out_of_limit_or_anywhere():
    y, replicates = responses("latin", 4, 4096)
    status = np.where(y > np.quantile(y, 0.97), 4, 1)
    values, sample = np.where(status == 1, y, np.nan), Sample(status, replicates)
    known = quantile_of_replicates(y, numbers(4096), 0.95)
    upper = summarize(values, sample, Limit(-np.inf, 99.0)).quantiles[0.95]
    assert upper == known
    anywhere = summarize(values, sample).quantiles[0.95]
    assert anywhere.lower < known.lower and anywhere.upper == known.upper
    assert "failed" in summarize(values, sample).quantiles[0.99].reason


def test_reasons_for_missing_intervals_of_replicates():
    few = mean_of_replicates(np.arange(32.0), numbers(32))
    assert few.value == 15.5 and "no replicates of 16" in few.reason
    alike = mean_of_replicates(np.zeros(512), numbers(512))
    assert alike.value == 0.0 and "equal" in alike.reason
    known = mean_of_replicates(np.zeros(512), numbers(512), Reach((0.0, 1.0)))
    assert (known.lower, known.upper) == (0.0, never_met(512, 16))
