"""The ring as it is cut: printed cases, SciPy, invariants, blocks, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import tolstat
from tests.machines.ring_reference import (
    CASES,
    DEG,
    blank,
    cut,
    forces,
    settings_of,
    states_of,
)
from tolstat.errors import ModelError
from tolstat.lanes.vector import WIDTH
from tolstat.machines.ring.declarations import RELATIVE, Settings, description_of
from tolstat.machines.ring.machine import Ring
from tolstat.machines.ring.parameters import depth_of_cut
from tolstat.model.checked import simulate

TIGHT = {"rtol": 1e-10}
TABLE = {  # thickness, m: computed, mm, at 1e5, 5e5, 1e6 N/m; printed
    0.05: ((-0.0600, 1.2087, 1.4866), (-0.06, 1.20, 1.48)),
    0.1: ((-0.0080, 1.3266, 1.6245), (-0.003, 1.32, 1.62)),
    0.2: ((-0.0051, 1.3491, 1.6464), (-0.005, 1.34, 1.64)),
    0.3: ((0.0035, 1.3535, 1.6507), (0.004, 1.35, 1.65)),
    0.4: ((0.0125, 1.3588, 1.6538), (0.013, 1.36, 1.65)),
    0.5: ((0.0213, 1.3636, 1.6567), (0.02, 1.36, 1.66)),
}
PRINTED = {  # mm: min, max, X(T), U(T), t_R(T); N: P_R, P_T at t_R0
    "A": (-0.0600102, 2.0, -0.1942025, -0.0066739, 1.7991236, 193.860328, 322.229717),
    "B": (1.3265859, 2.0, -0.6184875, -0.0095120, 1.3720005, 192.916950, 321.444731),
    "C": (1.6567160, 2.0, -0.2014368, -0.0001195, 1.7984437, 186.019504, 315.646050),
    "F": (1.0915595, 2.0180645, -0.3873884, 0.0203154, 1.6329270, 168.698069, 300.591139),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_printed_cases(case):
    low, high, X, U, end, P_R, P_T = PRINTED[case]
    given = {**CASES[case], **TIGHT}
    row = tolstat.evaluate("ring", None, given).iloc[0]
    off = 1.01e-7  # a unit of the seventh digit
    assert 1e3 * row["depth_min"] == pytest.approx(low, abs=off)
    assert 1e3 * row["depth_max"] == pytest.approx(high, abs=off)
    assert 1e3 * row["depth_end"] == pytest.approx(end, abs=off)
    assert row["peak_error"] == pytest.approx(2e-3 - row["depth_min"], abs=1e-18)
    settings = settings_of(**given)
    y, rings = states_of(settings, [settings.duration])
    assert 1e3 * y[0, -2] == pytest.approx(X, abs=off)
    depth = depth_of_cut(rings, y, settings.duration)[0]
    assert 1e3 * (depth - 2e-3 - y[0, -2]) == pytest.approx(U, abs=off)
    if case != "F":  # elsewhere the depth is nowhere greater than set
        assert row["radial_force_peak"] == pytest.approx(P_R, abs=5e-7)
        assert row["tangential_force_peak"] == pytest.approx(P_T, abs=5e-7)


def test_the_first_loss_of_cut_of_case_a():
    given = {**CASES["A"], **TIGHT}
    frame = tolstat.trajectory("ring", None, {**given, "duration": 0.1}, step=1e-6)
    t_R = frame["depth_min"]
    first = t_R.index[np.argmax(t_R.to_numpy() <= 0.0)]
    assert first == pytest.approx(0.061809, abs=1.1e-6)
    assert t_R.idxmin() == pytest.approx(0.069394, abs=1.1e-6)
    row = tolstat.evaluate("ring", None, given).iloc[0]
    assert row["out_of_cut_share"] == pytest.approx(0.0077, abs=5e-5)
    early = tolstat.evaluate("ring", None, {**given, "duration": 0.1}).iloc[0]
    assert early["out_of_cut_share"] == pytest.approx(np.mean(t_R <= 0.0), abs=2e-5)


def test_the_table():
    """All 18 cells within 0.02 mm of the print, and as computed independently."""
    for h, (known, printed) in TABLE.items():
        for K, computed, seen in zip((1e5, 5e5, 1e6), known, printed, strict=True):
            given = {"inner_radius": 3.0, "thickness": h, "tool_stiffness": K}
            row = tolstat.evaluate("ring", None, given).iloc[0]
            found = 1e3 * row["depth_min"]
            assert found == pytest.approx(computed, abs=6e-5)
            assert found == pytest.approx(seen, abs=0.02)
            assert 1e3 * row["depth_max"] == pytest.approx(2.0, abs=5e-5)
            # lost below 0.3 m with the softest tool alone
            assert (row["out_of_cut_share"] > 0.0) == (K == 1e5 and h < 0.3)


def random_cut(rng, N):
    return settings_of(
        radius=rng.uniform(1, 4), thickness=rng.uniform(0.04, 0.2),
        support_angle=rng.uniform(20, 140) * DEG, tool_angle=rng.uniform(0, 360) * DEG,
        ring_damping=10 ** rng.uniform(-5, -3.5), speed=rng.uniform(0.3, 2),
        hoop=bool(rng.integers(2)), harmonics=N, depth=rng.uniform(0.5, 3) * 1e-3,
        tool_stiffness=10 ** rng.uniform(4.8, 6), tool_mass=rng.uniform(50, 300),
        tool_damping=rng.uniform(0, 500), feed=rng.uniform(0.03, 0.2),
        cutting_force=rng.uniform(0.5, 2), force_exponent=rng.uniform(0.7, 1.1),
        tangential_depth_exponent=rng.choice([1.0, 0.85]),
        out_of_roundness_2=rng.uniform(0, 3e-4), out_of_roundness_2_phase=1.0,
        out_of_roundness_7=rng.uniform(0, 2e-4), out_of_roundness_7_phase=-2.0,
        duration=0.3, rtol=1e-10,
    )  # fmt: skip


@pytest.mark.parametrize("N", [2, 6, 9])
def test_against_all_coordinates_integrated_by_scipy(N):
    """Hoop tension, out-of-roundness, any angles and exponents; some lose the cut."""
    rng = np.random.default_rng(40 + N)
    times, lost = np.linspace(0.0, 0.3, 7), 0
    for soft in (False, True):
        s = random_cut(rng, N)
        if soft:
            s = replace(s, tool_stiffness=6e4, tool_damping=5.0, cutting_force=2.0)
        (t_R, _, X), fine = cut(s, times)
        y, rings = states_of(s, times)
        found = np.array([depth_of_cut(rings, row[None], t)[0] for row, t in zip(y, times, strict=True)])  # fmt: skip
        np.testing.assert_allclose(found, t_R, atol=3e-9 * s.depth)
        np.testing.assert_allclose(y[:, -2], X, atol=3e-9 * s.depth)
        machine, nominal = Ring(), np.zeros((1, len(description_of(s).contributors)))
        low, high = machine.evaluate(nominal, s).responses[0, :2]
        assert low == pytest.approx(fine.min(), abs=1e-6 * s.depth)
        assert high == pytest.approx(fine.max(), abs=1e-6 * s.depth)
        lost += fine.min() < 0.0
    assert lost


def test_energy_is_kept_through_losses_of_cut():
    """Invariant (i), by the null-space matrices."""
    from tests.machines.ring_reference import full

    s = settings_of(
        radius=3.025, thickness=0.05, tool_stiffness=1e5, ring_damping=0.0,
        tool_damping=0.0, tangential_coefficient=0.0, harmonics=6, rtol=1e-11,
    )  # fmt: skip
    y, rings = states_of(s, np.linspace(0.0, 3.0, 1201))
    assert (np.array([depth_of_cut(rings, r[None], 0.0)[0] for r in y]) < 0).any()
    f, n = full(s), 5

    def with_first(a, b):
        return np.concatenate([[rings.on.s[0] @ a], a, [rings.on.t[0] @ b], b])

    def energy(row):
        q, q_ = (
            f.Z.T @ with_first(row[i : i + n], row[i + n : i + 2 * n])
            for i in (0, 2 * n)
        )
        X, X_ = row[4 * n], row[4 * n + 1]
        t = s.depth + f.u @ q + X
        P_R = forces(s, t)[0]
        Phi = P_R * t / (s.force_exponent + 1.0)
        ring = 0.5 * f.pi_chi * (q_ @ f.M @ q_ + q @ f.K @ q)
        return ring + 0.5 * s.tool_mass * X_**2 + 0.5 * s.tool_stiffness * X**2 + Phi

    found = np.array([energy(row) for row in y])
    np.testing.assert_allclose(found, found[0], rtol=2e-9)


def test_a_rigid_ring_swings_as_far_as_its_energy_lets_it():
    """Invariant (ii): whatever the mass of the tool."""
    base = {
        "radius": 3.025,
        "thickness": 0.05,
        "tool_stiffness": 5e5,
        "tool_damping": 0.0,
    }
    stiff = {"youngs_modulus": 2.1e15, "harmonics": 2, "tangential_coefficient": 0.0}
    s = settings_of(**base)

    def Phi(t):
        return forces(s, t)[0] * t / 1.9

    X = brentq(lambda X: 0.5 * 5e5 * X * X + Phi(2e-3 - X) - Phi(2e-3), 1e-6, 1.9e-3)
    assert pytest.approx(1.340944, abs=5e-7) == 1e3 * (2e-3 - X)
    for mass in (100.0, 400.0):
        given = {**base, **stiff, "tool_mass": mass, "duration": 0.25, "rtol": 1e-9}
        row = tolstat.evaluate("ring", None, given).iloc[0]
        assert row["depth_min"] == pytest.approx(2e-3 - X, abs=4e-9)


def test_the_ring_stays_on_its_supports():
    """Invariant (iii)."""
    s = settings_of(support_angle=100 * DEG, tool_angle=2.0, harmonics=7, duration=0.4)
    y, rings = states_of(s, np.linspace(0.0, 0.4, 9))
    j, n = np.arange(2, 8), 6
    a_1, b_1 = y[:, :n] @ rings.on.s[0], y[:, n : 2 * n] @ rings.on.t[0]
    size = np.abs(y[:, : 2 * n]).max()
    for theta in (np.pi - 50 * DEG, np.pi + 50 * DEG):
        U = a_1 * np.cos(theta) + b_1 * np.sin(theta)
        U = U + y[:, :n] @ np.cos(j * theta) + y[:, n : 2 * n] @ np.sin(j * theta)
        np.testing.assert_allclose(U, 0.0, atol=1e-13 * size)


def test_out_of_roundness_turns_with_the_ring():
    """A stiff tool and ring: the depth is what the blank is."""
    lobes = {"out_of_roundness_3": 2e-4, "out_of_roundness_3_phase": 0.7}
    given = {
        "youngs_modulus": 2e14, "tool_stiffness": 1e11, "tool_mass": 1e7, "harmonics": 2,
        "cutting_force": 1e-6, "speed": 2.0, "duration": 1.7, "tool_angle": 2.5,
    }  # fmt: skip
    row = tolstat.evaluate("ring", lobes, given).iloc[0]
    s = settings_of(**given, **lobes)
    t = np.linspace(0.0, 1.7, 100_001)
    depth = 2e-3 + blank(s, t)
    for name, known in (("min", depth.min()), ("max", depth.max()), ("end", depth[-1])):
        assert row[f"depth_{name}"] == pytest.approx(known, abs=1e-9)
    more = tolstat.evaluate("ring", None, {**given, **lobes}).iloc[0]
    assert more["depth_min"] == pytest.approx(row["depth_min"], abs=1e-15)
    far = {"out_of_roundness_20": 1e-4}
    wide = {**given, "out_of_roundness_harmonics": [20]}
    assert tolstat.evaluate("ring", far, wide)["depth_max"].iloc[0] == pytest.approx(2.1e-3, abs=1e-8)  # fmt: skip


def test_deviations_change_the_declared_quantity():
    rng = np.random.default_rng(3)
    base = settings_of(inner_radius=3.0, duration=0.3, out_of_roundness_2=1e-4)
    names = [c.name for c in description_of(base).contributors]
    assert len(names) == 16 + 24
    deviation = {name: 1e-2 * rng.uniform(-1, 1) for name in names}
    for name in ("thickness", "depth", *(n for n in names if n.startswith("out_of"))):
        if not name.endswith("phase"):
            deviation[name] *= 1e-2
    row = tolstat.evaluate("ring", deviation, {"inner_radius": 3.0, "duration": 0.3, "out_of_roundness_2": 1e-4}).iloc[0]  # fmt: skip
    given = {
        name: base.nominal(name) * (1 + d)
        if name in RELATIVE
        else base.nominal(name) + d
        for name, d in deviation.items()
        if name != "radius"
    }
    # half the thickness follows its deviation
    given["radius"] = 3.0 + 0.5 * given["thickness"] + deviation["radius"]
    known = tolstat.evaluate("ring", None, {**given, "duration": 0.3}).iloc[0]
    for response in description_of(base).responses:
        # accelerations are less exact than displacements
        rel = 1e-5 if response.name.startswith("roller") else 1e-6
        assert row[response.name] == pytest.approx(
            known[response.name], rel=rel, abs=1e-9
        )
    # a radius that is set is not moved by the thickness
    set_ = {"radius": 3.05, "duration": 0.1}
    thicker = tolstat.evaluate("ring", {"thickness": 0.01}, set_).iloc[0]
    known = tolstat.evaluate("ring", None, {**set_, "thickness": 0.11}).iloc[0]
    assert thicker["depth_min"] == pytest.approx(known["depth_min"], rel=1e-6)


def test_bit_for_bit_the_same_in_any_block():
    rng = np.random.default_rng(6)
    settings = settings_of(duration=0.3, tool_stiffness=1e5, thickness=0.05)
    names = [c.name for c in description_of(settings).contributors]
    deviations = 0.05 * rng.uniform(-1, 1, (3 * WIDTH + 5, len(names)))
    for i, name in enumerate(names):
        if name.startswith("out_of") and not name.endswith("phase"):
            deviations[:, i] *= 1e-3 * (name == "out_of_roundness_3")
        elif name in ("radius", "width", "thickness", "depth"):
            deviations[:, i] *= 1e-2
    deviations[4, names.index("youngs_modulus")] = -1.5  # cannot exist
    deviations[5:9, names.index("out_of_roundness_3")] = 0.0
    machine = Ring()
    whole = simulate(machine, deviations, settings)
    impossible = machine.impossible(deviations, settings)["cannot exist"]
    assert np.flatnonzero(impossible).tolist() == [4]
    for rows in (
        slice(0, 1),
        slice(3, 8),
        slice(5, 6),
        slice(17, None),
        slice(None, None, -1),
    ):
        part = simulate(machine, deviations[rows], settings)
        np.testing.assert_array_equal(part.responses, whole.responses[rows])
        np.testing.assert_array_equal(part.status, whole.status[rows])
        np.testing.assert_array_equal(part.steps, whole.steps[rows])


def test_the_default_settings_are_precise_enough():
    """1e-4 mm in the smallest depth; steps are few."""
    shifts = {"cutting_force": np.linspace(-0.2, 0.2, 8)}
    for case in ("A", "B", "C"):
        found = tolstat.evaluate("ring", shifts, CASES[case])
        known = tolstat.evaluate("ring", shifts, {**CASES[case], **TIGHT})
        for name in ("depth_min", "depth_max"):
            assert np.abs(found[name] - known[name]).max() < 1e-5 * 1e-3
        assert found["steps"].max() < 3000


@pytest.mark.parametrize("N", [2, 17, 40])
@pytest.mark.parametrize("degrees", [1.0, 30.0, 90.0, 179.0])
def test_any_number_of_harmonics_and_any_angle_below_180_degrees(N, degrees):
    given = {
        "harmonics": N, "support_angle": degrees * DEG, "thickness": 0.05,
        "ring_damping": 1e-6, "duration": 0.01,
    }  # fmt: skip
    row = tolstat.evaluate("ring", None, given).iloc[0]
    assert row["status"] == "done"


def test_impossible_settings_are_refused():
    for given, words in (
        ({"speed": 0.0}, "speed"),
        ({"speed": -1.0}, "above 0"),
        ({"support_angle": np.pi}, "below 180 deg"),
        ({"support_angle": 0.0}, "above 0"),
        ({"harmonics": 1}, "at least 2"),
        ({"harmonics": 41}, "at most 40"),
        ({"radius": 3.0, "inner_radius": 3.0}, "both given"),
        ({"radius": 0.02}, "inner radius above 0"),
        (
            {"out_of_roundness_5": 1e-4, "out_of_roundness_harmonics": [2]},
            "5 is not in",
        ),
        ({"out_of_roundness_harmonics": [2, 2]}, "once"),
    ):
        with pytest.raises(ModelError, match=words):
            settings_of(**given)
    rows = tolstat.evaluate(
        "ring",
        {
            "speed": [0, -1, 0, 0, 0],
            "support_angle": [0, 0, 2.0, -1.5, 0],
            "thickness": [0, 0, 0, 0, -0.11],
        },
        {"duration": 0.01},
    )
    assert list(rows["status"]) == ["done"] + 4 * ["cannot exist"]
    assert Settings().middle_radius == 3.05


def test_without_a_depth_there_is_no_cut():
    row = tolstat.evaluate("ring", {"depth": -2.5e-3}, {"duration": 0.1}).iloc[0]
    assert row["out_of_cut_share"] == 1.0
    assert row["static_depth"] == row["depth_min"] == -0.5e-3
    assert row["radial_force_peak"] == row["tool_travel"] == 0.0


def test_more_tolerance_more_scatter_of_the_spec():
    """+1 sigma of each on the smallest depth of case A, mm, to the digits printed."""
    effects = {
        "cutting_force": (0.08, -0.081), "depth": (1e-4, 0.002),
        "tool_stiffness": (0.05, 0.046), "feed": (0.02, -0.012),
        "speed": (0.02, 0.006), "force_exponent": (0.02, -0.003),
        "thickness": (0.0005, 0.002), "youngs_modulus": (0.02, 0.002),
        "support_angle": (0.5 * DEG, -0.002), "tool_angle": (DEG, 0.002),
        "tool_mass": (0.03, 0.001),
    }  # fmt: skip
    nominal = tolstat.evaluate("ring", None, CASES["A"])["depth_min"].iloc[0]
    for name, (sigma, effect) in effects.items():
        row = tolstat.evaluate("ring", {name: sigma}, CASES["A"]).iloc[0]
        found = 1e3 * (row["depth_min"] - nominal)
        assert found == pytest.approx(effect, abs=7e-4), name


def test_no_crossing_is_searched_within_rounding(monkeypatch):
    """Steps that end at a crossing may become too short for its size to have digits."""
    import tolstat.moving

    whole = tolstat.moving.integrate

    def bounded(system, start, p, marks, accuracy, **options):
        few = accuracy._replace(max_steps=6000)
        return whole(system, start, p, marks, few, **options)

    monkeypatch.setattr(tolstat.moving, "integrate", bounded)
    rng = np.random.default_rng(0)
    shifts = {
        "cutting_force": 0.08 * rng.normal(size=200),
        "thickness": 1e-3 * rng.normal(size=200),
        "tool_stiffness": 0.05 * rng.normal(size=200),
    }
    given = {**CASES["A"], "duration": 0.3, "max_step": 2e-3}
    rows = tolstat.evaluate("ring", shifts, given)
    assert (rows["status"] == "done").all()
    assert (rows["out_of_cut_share"] > 0.0).any()


def test_many_lobes_shorten_the_step():
    """The blank alone moves the depth: out of the cut half of each wave, nearly."""
    lobes = {"out_of_roundness_harmonics": (1000,), "speed": 3.0, "duration": 0.1}
    given = {**lobes, "cutting_force": 0.0, "depth": 1e-3}
    waves = {"out_of_roundness_1000": 1e-2}
    found = tolstat.evaluate("ring", waves, given).iloc[0]
    out = np.arccos(0.1) / np.pi  # of each wave, deeper than the depth as set
    assert found["out_of_cut_share"] == pytest.approx(out, abs=5e-3)
