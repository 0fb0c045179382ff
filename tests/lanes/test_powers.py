"""exp, log and powers of vectors against 300 bits of mpmath, and special values."""

from __future__ import annotations

import itertools

import mpmath
import numpy as np
import pytest

from tests.lanes.conftest import written_powers
from tolstat.lanes.vector import WIDTH

ULP = 2.0
EXACT = {"exp": mpmath.exp, "log": mpmath.log, "power": mpmath.power}
SPECIAL = [
    0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 2.0, -2.0, 3.0, -3.0, 2.5, -2.5, np.inf, -np.inf,
    np.nan, 5e-324, -5e-324, 1e-310, 1e308, -1e308, 2.0**53 + 2, 2.0**52 + 1, 1e300,
]  # fmt: skip


def ulps_off(name, found, *arguments):
    """Return the greatest error in units of the last place of the true value."""
    worst = 0.0
    with mpmath.workprec(300):
        for value, *each in zip(found, *arguments, strict=True):
            true = EXACT[name](*(mpmath.mpf(float(x)) for x in each))
            unit = np.spacing(abs(float(true)))
            worst = max(worst, abs(float((mpmath.mpf(float(value)) - true) / unit)))
    return worst


def test_exp_is_right_where_it_is_finite(on_lanes):
    rng = np.random.default_rng(1)
    halves = (np.arange(-1070, 1020) + 0.5) * np.log(2.0)  # where n changes
    x = np.concatenate(
        [
            rng.uniform(-745.0, 709.7, 3000),
            rng.uniform(-1.0, 1.0, 2000),
            rng.choice([-1.0, 1.0], 500) * 10 ** rng.uniform(-20, -1, 500),
            rng.uniform(-745.1, -708.0, 500),  # subnormal answers
            np.nextafter(halves, 0),
            np.nextafter(halves, 1e3),
        ]
    )
    assert ulps_off("exp", on_lanes["exp"](x), x) <= ULP


def test_log_is_right_everywhere(on_lanes):
    rng = np.random.default_rng(2)
    near_one = 1.0 + rng.choice([-1.0, 1.0], 1500) * 10 ** rng.uniform(-16, -1, 1500)
    corner = np.sqrt(0.5) * 2.0 ** np.arange(-20, 20)  # where k changes
    x = np.concatenate(
        [
            10 ** rng.uniform(-307, 308, 3000),
            rng.uniform(0.5, 2.0, 2000),
            near_one,
            5e-324 * rng.integers(1, 2**51, 500),  # subnormal
            np.nextafter(corner, 0),
            corner,
        ]
    )
    x = x[x != 1.0]
    assert ulps_off("log", on_lanes["log"](x), x) <= ULP
    assert on_lanes["log"]([1.0])[0] == 0.0


def test_powers_are_right_up_to_the_ends_of_the_numbers(on_lanes):
    rng = np.random.default_rng(3)
    x = np.concatenate(
        [
            10 ** rng.uniform(-300, 300, 3000),
            10 ** rng.uniform(-3, 3, 2000),
            rng.uniform(0.5, 2.0, 2000),
            1.0 + rng.choice([-1.0, 1.0], 1500) * 10 ** rng.uniform(-15, -2, 1500),
            5e-324 * rng.integers(1, 2**51, 300),
        ]
    )
    # exponents for which the answer is a number, up to its ends
    y = rng.uniform(-745.0, 709.7, len(x)) / np.log(x)
    y[::3] = rng.uniform(-2.0, 2.0, len(y[::3]))
    kept = np.isfinite(y) & (np.abs(y * np.log(x)) < 744.0) & (y * np.log(x) < 709.0)
    x, y = x[kept], y[kept]
    assert len(x) > 7000
    assert ulps_off("power", on_lanes["power"](x, y), x, y) <= ULP


@pytest.mark.parametrize("name", ["exp", "log"])
def test_special_values_as_numpy(on_lanes, name):
    x = np.array([*SPECIAL, 709.8, 710.0, 1e4, -745.2, -746.0, -1e4, -708.5])
    with np.errstate(all="ignore"):
        known = getattr(np, name)(x)
    found = on_lanes[name](x)
    np.testing.assert_allclose(found, known, rtol=3e-16, atol=5e-324)
    np.testing.assert_array_equal(np.signbit(found[x == 0]), np.signbit(known[x == 0]))


def test_special_powers_as_numpy(on_lanes):
    x, y = np.array(list(itertools.product(SPECIAL, SPECIAL))).T
    with np.errstate(all="ignore"):
        known = np.power(x, y)
    found = on_lanes["power"](x, y)
    np.testing.assert_allclose(found, known, rtol=3e-16, atol=5e-324)
    number = ~np.isnan(known)
    np.testing.assert_array_equal(np.signbit(found[number]), np.signbit(known[number]))


def test_powers_as_they_are_written():
    x = np.array([[2.0, 0.0, 1.5, 1e-3, 3.0, 0.25, 10.0, 7.0]])
    assert x.shape[1] == WIDTH
    out, v = np.zeros((6, WIDTH)), x[0]
    written_powers(x, out)
    known = np.stack([v**0.9, v**2, 2.0**v, 3**v, v**v, np.sqrt(v)])
    np.testing.assert_allclose(out, known, rtol=3e-16)
