"""Linear analysis: exact for a linear stack; its failures are reported."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat.statistics.sample import Sample
from tolstat.statistics.sensitivity.linear import (
    departures,
    root_sum_square,
    scatter_of,
)
from tolstat.statistics.summary import summarize
from tolstat.status import Status


def stack(n=20_000, seed=0):
    rng = np.random.default_rng(seed)
    parts = {"a": rng.normal(0.1, 0.3, n), "b": rng.normal(0, 0.4, n)}
    slopes = {"a": 1.0, "b": -2.0}
    return parts, slopes


def test_a_linear_stack_is_exact():
    parts, slopes = stack()
    gap = 5.0 + parts["a"] - 2 * parts["b"]
    found = root_sum_square(5.0, slopes, scatter_of(parts))
    assert found.mean == pytest.approx(gap.mean(), abs=1e-12)
    assert found.sigma == pytest.approx(gap.std(ddof=1), rel=1e-12)
    variances = {n: s**2 * parts[n].var(ddof=1) for n, s in slopes.items()}
    shares = {n: v / gap.var(ddof=1) for n, v in variances.items()}
    assert found.shares == pytest.approx(shares)
    summary = summarize(gap, Sample(np.full(len(gap), Status.DONE)))
    assert not any(each.fails for each in departures(found, summary.quantiles))


def test_correlated_parts_add_as_they_must():
    rng = np.random.default_rng(1)
    common = rng.normal(size=5000)
    parts = {"a": common + rng.normal(size=5000), "b": common}
    found = root_sum_square(0.0, {"a": 1.0, "b": 1.0}, scatter_of(parts))
    assert found.sigma == pytest.approx((parts["a"] + common).std(ddof=1))
    assert sum(found.shares.values()) < 0.8  # the rest is their correlation


def test_linear_analysis_fails_at_a_kink():
    """Jamming: nothing at the nominal machine, everything beyond the clearance."""
    x = np.random.default_rng(2).normal(size=20_000)
    loss = np.maximum(np.abs(x) - 1, 0)
    found = root_sum_square(0.0, {"x": 0.0}, scatter_of({"x": x}))
    summary = summarize(loss, Sample(np.full(len(x), Status.DONE)))
    upper = departures(found, summary.quantiles)[-1]
    assert upper.share == 0.99865 and upper.fails
    assert upper.relative == pytest.approx(-1.0)  # it promises nothing at all


def test_a_failed_slope_gives_nan():
    found = root_sum_square(0.0, {"x": np.nan}, scatter_of({"x": np.arange(10.0)}))
    assert np.isnan([found.mean, found.sigma, found.shares["x"]]).all()
