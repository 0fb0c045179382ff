"""Profile shift of wheels that are coaxial at helix angles of choice."""

from __future__ import annotations

from math import asin, cos, degrees, pi, radians, sin, tan

import pytest
from scipy.optimize import brentq

from tolstat.machines.planetary.design import design_of, profile_shift, shift_34
from tolstat.machines.planetary.machine import Planetary
from tolstat.model.settings import make


def test_the_gear_computed_elsewhere():
    """AI 17 28 18 66, b2 = 20 deg: one lead fixes b3, the centre distance is free."""
    b3 = asin(sin(radians(20)) * 18 / 28)
    assert degrees(b3) == pytest.approx(12.701403, abs=5.1e-7)
    a, alpha = 24.602032, radians(20)
    assert profile_shift(17 + 28, 1.0, radians(20), alpha, a) == pytest.approx(
        0.713620, abs=5.1e-7
    )
    assert profile_shift(66 - 18, 1.0, b3, alpha, a) == pytest.approx(0.0, abs=1e-6)


def test_teeth_of_shifted_wheels_fill_the_pitch_circle():
    """Thickness at the pitch cylinder: both teeth together are one pitch."""
    alpha, b, m, z1, z2 = radians(20), radians(15), 2.0, 21, 33
    at = brentq(lambda x: tan(x) - tan(alpha) / cos(b), 0.1, 1.0)
    a = 1.02 * m * (z1 + z2) / 2 / cos(b)
    work = brentq(lambda x: a * cos(x) - a / 1.02 * cos(at), at, 1.0)

    def thickness(z, x):
        d = m * z / cos(b)
        s = m / cos(b) * (pi / 2 + 2 * x * tan(alpha))
        return d * cos(at) / cos(work) * (s / d + tan(at) - at - tan(work) + work)

    x = profile_shift(z1 + z2, m, b, alpha, a)
    both = thickness(z1, 0.3 * x) + thickness(z2, 0.7 * x)
    assert both == pytest.approx(2 * pi * a / (z1 + z2), rel=1e-12)


def test_the_shift_of_the_settings():
    teeth = {"teeth": (17, 28, 18, 66)}
    balanced = make(Planetary(), teeth)
    assert shift_34(balanced, design_of(balanced)) == pytest.approx(0.0, abs=1e-12)
    given = make(Planetary(), {**teeth, "helix_2": radians(24)})
    numbers = {each.name: each.value for each in Planetary().numbers(given, {})}
    assert abs(numbers["profile_shift_34"]) > 0.1
