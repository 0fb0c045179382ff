"""Planetary gears against geometry: pitch circles that roll, teeth that are counted."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import brentq

from tolstat.errors import ModelError
from tolstat.machines.planetary import existence
from tolstat.machines.planetary.scheme import (
    SCHEMES,
    assembly,
    balanced,
    diameter_ratio,
    fourth,
    ratio,
    unbalance,
)

EXTERNAL = {"AA": (True, True), "II": (False, False), "AI": (True, False)}


def any_teeth(name, rng):
    """Teeth whose rings are larger than the wheels in them."""
    z1, z2, z3, z4 = (int(z) for z in rng.integers(12, 90, 4))
    outer, inner = EXTERNAL[name]
    return (
        z1 if outer else z1 + z2, z2, z3, z4 if inner else z4 + z3,
    )  # fmt: skip


def circles(name, teeth):
    """Radii r1 ... r4 of pitch circles on one centre distance, with r1 = 1."""
    z1, z2, z3, z4 = teeth
    one, two = EXTERNAL[name]
    r2 = z2 / z1
    a = 1 + r2 if one else 1 - r2
    r3 = a / (z4 / z3 + 1) if two else a / (z4 / z3 - 1)
    return 1.0, r2, r3, r3 * z4 / z3, a


@pytest.mark.parametrize("name", SCHEMES)
def test_the_ratio_is_that_of_circles_that_roll(name):
    """Velocities at the points of contact, solved for the speed of wheel 1."""
    rng = np.random.default_rng(1)
    one, two = EXTERNAL[name]
    for _ in range(300):
        teeth = any_teeth(name, rng)
        r1, r2, r3, r4, a = circles(name, teeth)
        # where the pairs touch: on the line of centres, a the place of the satellite
        at_12, at_34 = r1, r4
        assert at_12 == pytest.approx(a - r2 if one else a + r2)
        assert at_34 == pytest.approx(a - r3 if two else a + r3)
        spin = -1.0 * a / (at_34 - a)  # carrier at speed 1; 3 rests where it touches 4
        wheel_1 = (a + spin * (at_12 - a)) / r1
        assert ratio(SCHEMES[name], *teeth) == pytest.approx(wheel_1, abs=1e-9)
        assert diameter_ratio(SCHEMES[name], *teeth) == pytest.approx(r2 / r3)
        z4 = fourth(SCHEMES[name], ratio(SCHEMES[name], *teeth), *teeth[:3])
        assert z4 == pytest.approx(teeth[3])


@pytest.mark.parametrize("name", SCHEMES)
def test_existence_against_pitch_circles(name):
    """Thousands of gears by (9): dw2 from the ratio, then all that hangs on it."""
    rng = np.random.default_rng(2)
    s12, s34 = SCHEMES[name]
    n_exist = 0
    for _ in range(20_000):
        i, D, k = rng.uniform(-8, 20), rng.uniform(0.05, 3), int(rng.integers(2, 9))
        if name != "AI" and rng.random() < 0.8:
            i = rng.uniform(-2, 1.2)
        # z2 / z1 = dw2 / dw1, from the table
        y = {
            "AA": (i - 1 + D) / (1 - D),
            "II": (1 - i - D) / (1 - D),
            "AI": (i - 1 - D) / (1 + D),
        }[name]
        dw2, dw3 = y, y / D
        apart = 1 + s12 * dw2  # 2a, with dw1 = 1
        dw4 = apart - s34 * dw3
        room = apart * np.sin(np.pi / k) > max(dw2, dw3)
        exists = bool(y > 0 and apart > 0 and dw4 > 0 and room)
        lower, upper = existence(name, D, k)
        assert (lower < i < upper) == exists, (i, D, k)
        n_exist += exists
    assert n_exist > 1000


def test_the_printed_ends_of_existence():
    printed = {
        ("AA", 0.7): (0.3, 0.761842427), ("AA", 1.3): (-2.239230485, -0.3),
        ("II", 0.7): (0.186774174, 0.3), ("II", 1.3): (-0.3, -0.160769515),
        ("AI", 0.7): (1.7, 4.317107084), ("AI", 1.3): (2.3, 17.167433715),
    }  # fmt: skip
    for (name, D), ends in printed.items():
        np.testing.assert_allclose(existence(name, D, 3), ends, rtol=0, atol=5e-10)


def test_two_satellites_never_touch_where_wheel_2_is_the_larger():
    lower, upper = existence("AI", [0.5, 1.0, 1.5], 2)
    np.testing.assert_allclose(lower, [1.5, 2.0, 2.5])
    np.testing.assert_allclose(upper, [3.0, np.inf, np.inf])
    lower, upper = existence("AA", [0.5, 1.0, 1.5], 2)
    np.testing.assert_allclose(lower, [0.5, 0.0, -np.inf])
    np.testing.assert_allclose(upper, [1.0, 0.0, -0.5])


def test_no_gear_aa_or_ii_has_equal_wheels_on_its_satellites():
    for name in ("AA", "II"):
        for k in (2, 3, 7):
            assert np.ptp(existence(name, 1.0, k)) == 0


@pytest.mark.parametrize(
    ("name", "D", "k", "words"),
    [
        ("IA", 1.0, 3, "scheme = 'IA'"),
        ("AI", 0.0, 3, "D = dw2 / dw3 must be above 0"),
        ("AI", [1.0, np.nan], 3, "above 0"),
        ("AI", 1.0, 1, "satellites = 1: a whole number from 2"),
    ],
)
def test_wrong_gears_are_refused(name, D, k, words):
    with pytest.raises(ModelError, match=words):
        existence(name, D, k)


def test_the_example_of_the_source():
    """II 75, 20, 24, 79: (9) as corrected; as printed it gives 5.389 for 3.75."""
    teeth = 75, 20, 24, 79
    i, D = ratio(SCHEMES["II"], *teeth), diameter_ratio(SCHEMES["II"], *teeth)
    assert (1 - i - D) / (1 - D) == pytest.approx(20 / 75)
    assert round(20 / 75, 6) == 0.266667
    assert (1 - i * D) / (1 - D) == pytest.approx(5.389, abs=5e-4)
    assert 75 * (1 - i) * 24 / 20 == pytest.approx(79)  # (11)
    assert balanced(SCHEMES["II"], 1.0, *teeth)[2:] == (0, 0)  # kap = 1: spur wheels


def can_be_put_in(name, k, teeth):
    """Turn each satellite through all its teeth, until both meshes fit; exact.

    Places along pitch circles are counted in teeth. Where one wheel is in the other,
    places of both count in one direction, else against each other.
    """
    z1, z2, z3, z4 = teeth
    one, two = EXTERNAL[name]
    for j in range(k):
        at = Fraction(j, k)  # of a turn: where the satellite is
        for n in range(z3):
            # turned so that wheel 3 fits wheel 4 as on the first satellite
            turn = at + (at * z4 + n) / z3 if two else at - (at * z4 + n) / z3
            seen = z2 * (at - turn)
            if (z1 * at + (seen if one else -seen)).denominator == 1:
                break
        else:
            return False
    return True


@pytest.mark.parametrize("name", SCHEMES)
def test_assembly_against_turning_satellites_by_hand(name):
    rng = np.random.default_rng(3)
    possible = 0
    for _ in range(1500):
        teeth, k = any_teeth(name, rng), int(rng.integers(2, 7))
        if rng.random() < 0.5:  # common factors of wheels 2 and 3
            f = int(rng.integers(2, 7))
            teeth = (teeth[0], teeth[1] // f * f, teeth[2] // f * f, teeth[3])
            teeth = tuple(max(z, f) for z in teeth)
        whole, step = assembly(SCHEMES[name], k, *teeth)
        assert (whole % step == 0) == can_be_put_in(name, k, teeth), (k, teeth)
        possible += whole % step == 0
    assert 100 < possible < 1400


@pytest.mark.parametrize("name", SCHEMES)
def test_balanced_helix_angles_against_a_root_of_both_conditions(name):
    rng = np.random.default_rng(4)
    found, none = 0, 0
    for _ in range(600):
        teeth = z1, z2, z3, z4 = any_teeth(name, rng)
        mr = rng.choice([1.0, 0.8, 1.25])
        one, two = EXTERNAL[name]
        sums = (z1 + z2 if one else z1 - z2), (z4 + z3 if two else z4 - z3)
        kap, _, b2, b3 = balanced(SCHEMES[name], mr, *teeth)
        assert kap == pytest.approx(mr * sums[0] / sums[1])

        def force(b3, kap=kap, mr=mr, z2=z2, z3=z3):
            cos_b2 = kap * np.cos(b3)  # coaxial
            d2, d3 = mr * z2 / cos_b2, z3 / np.cos(b3)
            return np.sqrt(1 - cos_b2**2) / cos_b2 / d2 - np.tan(b3) / d3

        low = 1e-6 if kap <= 1 else np.arccos(1 / kap) + 1e-9
        high = np.pi / 2 - 1e-6
        if abs(kap - 1) < 1e-9:
            assert b2 == b3 == 0
        elif force(low) * force(high) < 0:
            assert b3 == pytest.approx(brentq(force, low, high, xtol=1e-13), abs=1e-9)
            assert np.cos(b2) == pytest.approx(kap * np.cos(b3))
            D = diameter_ratio(SCHEMES[name], *teeth)
            assert unbalance(b2, b3, D) == pytest.approx(0, abs=1e-9)
            assert np.sin(b2) / (mr * z2) == pytest.approx(np.sin(b3) / z3)  # one lead
            found += 1
        else:
            assert np.isnan(b2) and np.isnan(b3)
            none += 1
    assert found > 50 and none > 50
