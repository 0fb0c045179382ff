"""The linear ring: printed tables, a null-space projection, brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tolstat
from tests.machines.ring_reference import CASES, DEG, eigenvalues, full
from tolstat.machines.ring import spectrum
from tolstat.machines.ring.declarations import description_of
from tolstat.machines.ring.flutter import flutter_speed, flutters
from tolstat.machines.ring.harmonics import Supported, harmonics, inverse, supported
from tolstat.machines.ring.linear import (
    compliances,
    growth_rate,
    ring_matrix,
    static_depth,
)
from tolstat.machines.ring.machine import Ring
from tolstat.machines.ring.parameters import build
from tolstat.model.settings import make

FIGURES = {"thickness": 0.05, "support_angle": 40 * DEG, "ring_damping": 0.0}


def settings_of(**given):
    return make(Ring(), given)


def nominal(settings):
    return build(np.zeros((1, len(description_of(settings).contributors))), settings)


def random_settings(rng, N):
    return settings_of(
        radius=rng.uniform(0.5, 6), thickness=rng.uniform(0.02, 0.3),
        width=rng.uniform(0.1, 2), support_angle=rng.uniform(5, 170) * DEG,
        tool_angle=rng.uniform(0, 360) * DEG, ring_damping=10 ** rng.uniform(-6, -3),
        speed=rng.uniform(0.1, 3), hoop=bool(rng.integers(2)), harmonics=N,
        youngs_modulus=rng.uniform(0.5, 2.5) * 1e11, density=rng.uniform(2e3, 9e3),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("radius", "nu", "omega", "zero", "flutter", "onset"),
    [
        (5.0, 8.97435897, 2.730325, 5.991447, 6.597822, 5.69002),
        (4.0, 21.91005609, 4.266133, 9.361636, 10.309097, 8.89057),
        (3.0, 69.24659702, 7.584237, 16.642908, 18.327284, 15.80487),
    ],
)
def test_printed_frequencies_and_onsets(radius, nu, omega, zero, flutter, onset):
    given = {**FIGURES, "radius": radius}
    assert nominal(settings_of(**given)).nu[0] == pytest.approx(nu, abs=5e-9)
    assert spectrum(0.0, given).frequency[0] == pytest.approx(omega, abs=5e-7)
    short = {**given, "duration": 0.01}
    row = tolstat.evaluate("ring", None, short).iloc[0]
    assert row["zero_speed"] == pytest.approx(zero, abs=5e-7)
    assert row["flutter_speed"] == pytest.approx(flutter, abs=5e-7)
    # invariant (iv), but for the double root there
    at_zero = spectrum(2.0 * np.sqrt(nu), given)
    assert at_zero.frequency[0] < 1e-6 * np.sqrt(nu)
    lower, upper = 0.5 * zero, flutter
    for _ in range(50):
        middle = 0.5 * (lower + upper)
        grows = spectrum(middle, {**given, "ring_damping": 1.5e-4}).growth[0] > 0.0
        lower, upper = (lower, middle) if grows else (middle, upper)
    assert upper == pytest.approx(onset, abs=1e-5)


def test_printed_growth_beyond_flutter():
    found = spectrum([20.803635, 26.628653], {**FIGURES, "radius": 3.0})
    np.testing.assert_allclose(found.growth, [4.184589, 8.286480], atol=5e-7)
    np.testing.assert_allclose(found.frequency, [5.982170, 5.758290], atol=5e-7)


def test_printed_spectrum():
    given = {**FIGURES, "radius": 3.0}
    at_rest = spectrum(0.0, given).eigenvalues[0]
    known = [7.584237, 15.400360, 38.571023, 56.931019]
    np.testing.assert_allclose(np.abs(at_rest.imag[:8:2]), known, atol=5e-7)
    turning = spectrum(8.0, {**given, "ring_damping": 1e-4}).eigenvalues[0][:8:2]
    known = [6.403762, 13.641104, 33.327372, 57.984979]
    np.testing.assert_allclose(np.abs(turning.imag), known, atol=5e-7)
    decay = [-0.007537, -0.010635, -0.109176, -0.166233]
    np.testing.assert_allclose(turning.real, decay, atol=6e-7)


def test_printed_frequencies_under_hoop_tension():
    given = {**FIGURES, "radius": 3.0, "hoop": True}
    found = spectrum([0.0, 8.0, 16.64, 30.0, 60.0], given)
    known = [7.5842, 7.2766, 6.4747, 5.1082, 3.1482]
    np.testing.assert_allclose(found.frequency, known, atol=5e-5)
    speeds = np.linspace(0.5, 200.0, 200)
    for radius, angle in ((3.0, 40.0), (5.0, 80.0)):
        more = {**given, "radius": radius, "support_angle": angle * DEG}
        assert np.abs(spectrum(speeds, more).growth).max() < 1e-11


def test_gyroscopic_forces_hold_the_ring_between_zero_and_flutter():
    root = np.sqrt(69.24659702)
    found = spectrum(root * np.array([1.9, 2.1, 2.2, 2.21]), {**FIGURES, "radius": 3.0})
    assert np.all(found.growth[:3] < 1e-6)
    assert found.growth[3] > 0.1
    assert found.frequency[1] > 0.1


@pytest.mark.parametrize("N", [2, 3, 6, 12, 25, 40])
def test_eigenvalues_and_compliance_against_a_null_space_projection(N):
    rng = np.random.default_rng(N)
    for _ in range(6 if N < 20 else 1):
        s = random_settings(rng, N)
        f, ring = full(s), nominal(s)
        known, found = eigenvalues(f), spectrum(s.speed, _given(s)).eigenvalues[0]
        assert len(found) == len(known) == 4 * (N - 1)
        scale = np.abs(known).max()
        gap = np.abs(known[:, None] - found[None, :]).min(axis=1)
        # some are nearly critically damped: two that meet hang on a root of rounding
        assert gap.max() < 1e-6 * scale
        assert np.median(gap) < 1e-11 * scale
        c_R, c_T = compliances(ring, s.hoop)
        np.testing.assert_allclose(
            c_R, f.u @ np.linalg.solve(f.K, f.u) / f.pi_chi, rtol=1e-7
        )
        np.testing.assert_allclose(c_T, f.u @ np.linalg.solve(f.K, f.v) / f.pi_chi, rtol=1e-6, atol=1e-9 * c_R[0])  # fmt: skip
        # |U/P| at complex frequencies
        C = harmonics(N).C
        push = np.concatenate(
            [np.zeros(2 * N - 2), inverse(ring.on.s, C)[0] @ ring.tool_place.u_a[0], inverse(ring.on.t, C)[0] @ ring.tool_place.u_b[0]]
        )  # fmt: skip
        sees = np.concatenate(
            [ring.tool_place.u_a[0], ring.tool_place.u_b[0], np.zeros(2 * N - 2)]
        )
        A = ring_matrix(ring, ring.Omega, s.hoop)[0]
        for x in (3.0 + 20j, -1.0 + 200j, 50.0 + 0j):
            here = sees @ np.linalg.solve(x * np.eye(len(A)) - A, push)
            there = f.u @ np.linalg.solve(f.M * x * x + f.D * x + f.K, f.u)
            assert abs(here) == pytest.approx(abs(there), rel=1e-7)


def _given(s):
    names = ("radius", "thickness", "width", "support_angle", "ring_damping", "hoop", "harmonics", "youngs_modulus", "density")  # fmt: skip
    return {name: getattr(s, name) for name in names}


def test_a_ring_with_friction_at_rest_is_damped():
    """Invariant (v)."""
    rng = np.random.default_rng(5)
    for N in (2, 6, 11):
        s = random_settings(rng, N)
        assert spectrum(0.0, _given(s)).growth[0] < 0.0


@pytest.mark.parametrize("case", CASES)
def test_printed_statics(case):
    known = {
        "A": (5.723053e-07, 0.950610, -8.986025e-03),
        "B": (7.329345e-08, 1.661501, -1.841438e-02),
        "C": (7.093180e-10, 1.828296, -7.110902e-06),
        "F": (4.787476e-07, 1.551152, -2.338061e-05),
    }[case]
    ring = nominal(settings_of(**CASES[case]))
    assert compliances(ring, False)[0][0] == pytest.approx(known[0], rel=1e-6)
    depth = static_depth(ring, False)
    assert 1e3 * depth[0] == pytest.approx(known[1], abs=5e-7)
    assert growth_rate(ring, depth, False)[0] == pytest.approx(known[2], rel=3e-7)


@pytest.mark.parametrize(("N", "known"), [(3, 0.43987), (4, 0.52865), (6, 0.57231), (8, 0.57335), (12, 0.57411), (24, 0.57587)])  # fmt: skip
def test_printed_compliance_over_the_harmonics(N, known):
    ring = nominal(settings_of(**CASES["A"], harmonics=N))
    assert 1e6 * compliances(ring, False)[0][0] == pytest.approx(known, abs=1e-5)


@pytest.mark.parametrize("N", [2, 3, 5, 6, 9, 14, 40])
def test_flutter_against_a_fine_scan(N):
    """Every angle, whatever it was begun from; nothing grows below, all does above."""
    few = 14 if N < 10 else 3
    angles = np.concatenate([np.linspace(0.02, 3.1, few), [40 * DEG, 80 * DEG]])
    for begun in (1.0, 2.8)[: 1 + (N < 10)]:
        found = flutter_speed(0.5 * angles, begun, N)
        assert np.all((found > 2.0) & (found <= np.sqrt(20.0) * 1.0001))
        on = supported(0.5 * angles, N)
        assert not flutters(found * (1 - 1e-5), on).any()
        assert flutters(found * (1 + 1e-5), on).all()
        for part in np.linspace(0.02, 0.98, 25 if N < 10 else 7):
            assert not flutters(2.0 + part * (found - 2.0), on).any()
    if N == 6:
        np.testing.assert_allclose(found[-2:], [2.202414, 2.343075], atol=5e-7)
    if N == 2:
        # closed form: 9 Omega^2 = (9/4 Omega^2 - 9)(sqrt C_a + sqrt C_b)^2
        C_a, C_b = (1.25 + 2.0 * x[:, 0] ** 2 for x in on)
        k = (np.sqrt(C_a) + np.sqrt(C_b)) ** 2
        np.testing.assert_allclose(found, np.sqrt(9 * k / (2.25 * k - 9)), rtol=1e-9)


def test_chatter_against_the_projection_with_the_tool():
    rng = np.random.default_rng(11)
    for _ in range(6):
        s = replace(random_settings(rng, 6), hoop=False, tool_damping=30.0)
        ring, f = nominal(s), full(s)
        depth = static_depth(ring, False)
        if not np.isfinite(depth[0]):
            continue
        n, t = len(f.M), depth[0]
        from tests.machines.ring_reference import forces

        near = 1e-6 * t
        slopes = (np.array(forces(s, t + near)) - forces(s, t - near)) / (2 * near)
        # the static depth is where it says
        P_R, P_T = forces(s, t)
        q = -np.linalg.solve(f.K, P_R * f.u + P_T * f.v) / f.pi_chi
        assert s.depth + f.u @ q - P_R / s.tool_stiffness == pytest.approx(t, rel=1e-9)
        M = np.block(
            [[f.M, np.zeros((n, 1))], [np.zeros((1, n)), np.array([[s.tool_mass]])]]
        )
        D = np.block(
            [[f.D, np.zeros((n, 1))], [np.zeros((1, n)), np.array([[s.tool_damping]])]]
        )
        K = np.block(
            [
                [f.K, np.zeros((n, 1))],
                [np.zeros((1, n)), np.array([[s.tool_stiffness]])],
            ]
        )
        push = np.concatenate(
            [(slopes[0] * f.u + slopes[1] * f.v) / f.pi_chi, slopes[:1]]
        )
        K = K + np.outer(push, np.concatenate([f.u, [1.0]]))
        known = eigenvalues(f._replace(M=M, D=D, K=K)).real.max()
        found = growth_rate(ring, depth, False)[0]
        assert found == pytest.approx(known, abs=1e-6 * max(1.0, abs(known)))


def test_above_the_zero_speed_there_is_no_equilibrium():
    given = {**FIGURES, "radius": 3.0, "duration": 0.01}
    rows = tolstat.evaluate("ring", {"speed": [32.0, 33.0]}, given)  # times 1 + that
    assert list(rows["status"]) == ["done", "no static depth"]
    # set near it, nothing is asked that no ring could answer
    fast = tolstat.evaluate("ring", {"speed": [0.0, 0.05]}, {**given, "speed": 16.5})
    assert list(fast["status"]) == ["done", "done"]
    assert fast["zero_speed"].tolist() == pytest.approx([16.642908] * 2, abs=1e-6)
    assert {"static_depth", "static_error", "growth_rate"}.isdisjoint(fast)
    tense = tolstat.evaluate("ring", {"speed": [33.0]}, {**given, "hoop": True})
    assert list(tense["status"]) == ["done"]
    assert "flutter_speed" not in tense


def test_the_first_of_two_onsets_of_flutter():
    """Near 102 deg it flutters for a thousandth of its speed, and later for good."""
    on = supported(np.radians([51.0]), 6)
    speeds = 2.0 + 2e-4 * np.arange(1, 2600)
    many = Supported(*(np.repeat(each, len(speeds), axis=0) for each in on))
    first = speeds[flutters(speeds, many)][0]
    assert first < 2.4725
    for nominal in (98.0, 102.0, 106.0):
        found = flutter_speed(np.radians([51.0]), np.radians(nominal), 6)[0]
        assert found == pytest.approx(first, abs=2e-4)
