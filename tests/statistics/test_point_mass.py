"""A value that many units share is found; a smooth response has none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tolstat.statistics.point_mass import point_mass_of

DRAWN = {
    "normal": stats.norm(5.0, 2.0),
    "lognormal": stats.lognorm(0.7, scale=3.0),
    "weibull": stats.weibull_min(1.7, scale=4.0),
    "gumbel": stats.gumbel_r(3.0, 2.0),
}


def draws(name, n, seed=0):
    return DRAWN[name].rvs(n, random_state=seed)


def test_units_that_share_a_value_are_a_point_mass():
    rng = np.random.default_rng(1)
    loss = np.where(rng.random(4000) < 0.9, 0.0, rng.exponential(0.01, 4000))
    mass = point_mass_of(loss)
    assert mass.value == 0.0 and mass.share.lower < 0.9 < mass.share.upper
    rest = mass.without(loss)
    assert len(rest) == np.count_nonzero(loss)


def test_nearly_equal_values_are_a_point_mass():
    """A loss of smoothed friction is never quite zero."""
    rng = np.random.default_rng(2)
    jammed = rng.random(4000) < 0.05
    nothing = 1e-8 * rng.lognormal(size=4000)
    loss = np.where(jammed, rng.exponential(0.01, 4000), nothing)
    mass = point_mass_of(loss)
    assert mass.share.value == pytest.approx(0.95, abs=0.02)
    assert mass.largest < 1e-5 < mass.without(loss).min() * 10


@pytest.mark.parametrize("name", DRAWN)
def test_a_smooth_response_has_no_point_mass(name):
    assert point_mass_of(draws(name, 5000)) is None
    assert point_mass_of(np.random.default_rng(0).weibull(0.5, 5000)) is None
    assert point_mass_of(np.ones(100)) is None and point_mass_of(np.empty(0)) is None
