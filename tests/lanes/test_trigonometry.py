"""arctan, sin and cos of vectors against 300 bits of mpmath, and special values."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

ULP = 2.0
ARCTAN = 1.1e-13  # relative


def ulps_off(name, x, found):
    """Return the greatest error in units of the last place of the true value."""
    exact = {"sin": mpmath.sin, "cos": mpmath.cos}[name]
    worst = 0.0
    with mpmath.workprec(300):
        for each, value in zip(x, found, strict=True):
            true = exact(mpmath.mpf(float(each)))
            unit = np.spacing(abs(float(true)))
            worst = max(worst, abs(float((mpmath.mpf(float(value)) - true) / unit)))
    return worst


def test_arctan_is_right_everywhere(on_lanes):
    rng = np.random.default_rng(1)
    sign = rng.choice([-1.0, 1.0], 6000)
    corners = [np.tan(np.pi / 8), np.tan(3 * np.pi / 8), 1.0, 5e-324, 1e-310, 1e308]
    near = np.concatenate(
        [np.nextafter(corners, 0), corners, np.nextafter(corners, 9e9)]
    )
    x = np.concatenate(
        [sign * 10 ** rng.uniform(-8, 8, 6000), rng.uniform(-3, 3, 6000), near]
    )
    found = on_lanes["arctan"](x)
    # below the normal numbers a unit of the last place is more than that
    tiny = np.abs(x) < 1e-300
    np.testing.assert_array_equal(found[tiny], x[tiny])
    with mpmath.workprec(300):
        for each, value in zip(x[~tiny], found[~tiny], strict=True):
            exact = mpmath.atan(mpmath.mpf(float(each)))
            assert abs(mpmath.mpf(float(value)) / exact - 1) <= ARCTAN, each


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_sin_and_cos_are_right_up_to_a_million(on_lanes, name):
    rng = np.random.default_rng(2)
    sign = rng.choice([-1.0, 1.0], 3000)
    x = np.concatenate(
        [
            rng.uniform(-1e6, 1e6, 5000),
            rng.uniform(-10, 10, 3000),
            sign * 10 ** rng.uniform(-12, 6, 3000),
        ]
    )
    assert ulps_off(name, x, on_lanes[name](x)) <= ULP


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_sin_and_cos_are_right_next_to_multiples_of_half_pi(on_lanes, name):
    rng = np.random.default_rng(3)
    n = np.concatenate([np.arange(1, 1500), rng.integers(1, 636619, 5000)])
    with mpmath.workprec(100):
        x = np.array([float(int(each) * mpmath.pi / 2) for each in n])
    x = np.concatenate([x, np.nextafter(x, 0), -x])
    x = x[np.abs(x) <= 1e6]
    assert ulps_off(name, x, on_lanes[name](x)) <= ULP


def test_special_values_as_numpy(on_lanes):
    x = np.array([0.0, -0.0, np.inf, -np.inf, np.nan])
    found = on_lanes["arctan"](x)
    np.testing.assert_allclose(found, np.arctan(x), rtol=ARCTAN)
    np.testing.assert_array_equal(np.signbit(found[:4]), np.signbit(np.arctan(x[:4])))
    with np.errstate(invalid="ignore"):
        np.testing.assert_array_equal(on_lanes["sin"](x), np.sin(x))
        np.testing.assert_array_equal(on_lanes["cos"](x), np.cos(x))
    assert np.signbit(on_lanes["sin"]([-0.0]))[0]
    tiny = np.array([5e-324, -1e-310, 1e-300])
    np.testing.assert_array_equal(on_lanes["sin"](tiny), tiny)


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_above_a_million_the_result_is_nan(on_lanes, name):
    x = np.array([np.nextafter(1e6, 2e6), -1.1e6, 1e22, -1e300])
    assert np.all(np.isnan(on_lanes[name](x)))
    assert np.all(np.isfinite(on_lanes[name]([1e6, -1e6])))
