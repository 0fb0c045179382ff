"""Examples of JCGM 101:2008, clause 9, with the statistics of tolstat."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat.statistics.intervals.moments import mean_of, sigma_of
from tolstat.statistics.intervals.quantiles import quantiles

N = 1_000_000


def ends(values):
    return [quantiles(values, [share])[share] for share in (0.025, 0.975)]


def inside(found, known, rounding):
    """The printed endpoint lies in the interval, give or take its last digit."""
    return found.lower - rounding <= known <= found.upper + rounding


def test_additive_model_of_normal_quantities():
    """9.2.2: u = 2.00, 95 % interval -3.92 .. 3.92."""
    y = np.random.default_rng(1).normal(size=(4, N)).sum(axis=0)
    u = sigma_of(y)
    assert u.lower <= 2.0 <= u.upper and u.upper - u.lower < 0.01
    assert abs(mean_of(y).value) < 4 * 2.0 / np.sqrt(N)
    low, high = ends(y)
    assert inside(low, -3.92, 0.005) and inside(high, 3.92, 0.005)


def test_additive_model_of_rectangular_quantities():
    """9.2.3: u = 2.00, 95 % interval -3.88 .. 3.88, where the normal one is wrong."""
    half = np.sqrt(3)
    y = np.random.default_rng(2).uniform(-half, half, (4, N)).sum(axis=0)
    assert sigma_of(y).value == pytest.approx(2.0, abs=0.01)
    low, high = ends(y)
    assert inside(low, -3.88, 0.005) and inside(high, 3.88, 0.005)
    assert high.upper < 3.92


def test_one_quantity_dominates():
    """9.2.4: one rectangular quantity ten times wider: u = 10.1, -17.0 .. 17.0."""
    half = np.sqrt(3) * np.array([[1.0], [1.0], [1.0], [10.0]])
    y = np.random.default_rng(3).uniform(-half, half, (4, N)).sum(axis=0)
    assert sigma_of(y).value == pytest.approx(10.15, abs=0.05)
    low, high = ends(y)
    assert inside(low, -17.0, 0.05) and inside(high, 17.0, 0.05)


def test_mass_calibration():
    """9.3: estimate 1.234 mg, u = 0.075 mg, 95 % interval 1.084 .. 1.384 mg."""
    rng = np.random.default_rng(4)
    m_ref = rng.normal(100_000.000, 0.050, N)
    dm_ref = rng.normal(1.234, 0.020, N)
    rho_air = rng.uniform(1.10, 1.30, N)
    rho_w = rng.uniform(7e3, 9e3, N)
    rho_ref = rng.uniform(7.95e3, 8.05e3, N)
    # (36): the correction to the nominal 100 g, mg
    y = (m_ref + dm_ref) * (1 + (rho_air - 1.2) * (1 / rho_w - 1 / rho_ref)) - 100_000.0
    assert mean_of(y).value == pytest.approx(1.234, abs=0.001)
    assert sigma_of(y).value == pytest.approx(0.0754, abs=0.0005)
    low, high = ends(y)
    assert inside(low, 1.084, 0.0015) and inside(high, 1.385, 0.0015)
