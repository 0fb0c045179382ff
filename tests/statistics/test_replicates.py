"""Intervals of Latin hypercube and Sobol' samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tolstat.deviations import samplers
from tolstat.deviations.parts import find_in
from tolstat.statistics.limit import Limit
from tolstat.statistics.replicates import from_replicates
from tolstat.statistics.sample import Sample
from tolstat.statistics.summary import summarize


def responses(sampling, seed, trials=512):
    """A product of two normal numbers and a sum of squares: mean 4."""
    streams = {f"part_{i}": i for i in range(4)}
    sampler = find_in(samplers, sampling)()
    z = stats.norm.ppf(sampler.unit_samples(seed, streams, trials))
    return np.sum(z**2, axis=1) + z[:, 0] * z[:, 1], sampler.replicates


@pytest.mark.parametrize("sampling", ["latin", "sobol"])
def test_intervals_of_replicates_cover(sampling):
    """And what random trials would give is several times as wide."""
    inside, widths, plain = 0, [], []
    for seed in range(300):
        y, replicates = responses(sampling, seed)
        found = from_replicates(np.mean, y, np.arange(len(y)) % replicates)
        inside += found.lower <= 4.0 <= found.upper
        widths.append(found.upper - found.lower)
        plain.append(2 * 1.96 * y.std() / np.sqrt(len(y)))
    assert inside / 300 > 0.93 - 3 * np.sqrt(0.07 * 0.93 / 300)
    assert np.mean(widths) < 0.6 * np.mean(plain)


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
    assert found.quantiles[0.99865].reason == "needs 11856"
    yields = found.limited.yields
    assert yields.beyond.value == pytest.approx(np.mean((y > 12) | (status == 4)))
    assert yields.most.value - yields.least.value == pytest.approx(8 / 4096)
    assert yields.verdict == "met"
    assert found.limited.percentiles.ppk.reason == "for random trials only"


def test_what_replicates_cannot_tell():
    few = from_replicates(np.mean, np.arange(32.0), np.arange(32) % 16)
    assert few.value == 15.5 and "no replicates of 16" in few.reason
    alike = from_replicates(np.mean, np.zeros(512), np.arange(512) % 16)
    assert alike.value == 0.0 and "alike" in alike.reason
