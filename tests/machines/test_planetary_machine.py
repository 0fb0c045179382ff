"""Planetary gears with deviations: forces, sharing, backlash, refusals."""

from __future__ import annotations

import math
from itertools import chain, combinations

import numpy as np
import pytest
from scipy.optimize import brentq

import tolstat
from tests.machines.planetary_catalogue import CATALOGUE
from tolstat.errors import ModelError
from tolstat.machines.planetary import designs
from tolstat.machines.planetary.declarations import Settings
from tolstat.machines.planetary.design import design_of
from tolstat.machines.planetary.machine import Planetary, felt_in_mesh, shared
from tolstat.machines.planetary.scheme import EXAMPLES

F, C = 3e4, 4e8
UM = 1e-6

# D = 1.5, three satellites; dw2 = 150 mm at b2 = atan(1.5 tan 15 deg)
B3 = math.radians(15)
B2 = math.atan(1.5 * math.tan(B3))
CASE = {
    "teeth": (24, 30, 20, 74), "helix_3": B3, "module": 0.15 * math.cos(B2) / 30,
    "module_ratio": math.cos(B2) / math.cos(B3), "torque": 1.5 * 1000 * 0.12 / 0.075,
}  # fmt: skip


def by_hand(e, F, c):
    """Try every set of satellites in contact: one has forces that push, and gaps."""
    k = len(e)
    for group in chain.from_iterable(
        combinations(range(k), m) for m in range(1, k + 1)
    ):
        X = (F / c - sum(e[j] for j in group)) / len(group)
        outside = [X + e[j] for j in range(k) if j not in group]
        if all(X + e[j] > 0 for j in group) and all(gap <= 0 for gap in outside):
            return np.array([c * (X + e[j]) if j in group else 0.0 for j in range(k)])
    raise AssertionError(e)


def by_root(e, F, c):
    """Close in on X."""

    def left(X):
        return np.maximum(X + e, 0).sum() - F / c

    top = F / c + np.ptp(e) - e.min() + 1e-3
    X = brentq(left, -e.max() - 1e-3, top, xtol=1e-18, rtol=1e-15)
    return c * np.maximum(X + e, 0)


@pytest.mark.parametrize(
    ("errors", "forces"),
    [
        ((0, 0, 10), (8666.667, 8666.667, 12666.667)),
        ((0, 0, 60), (2000, 2000, 26000)),
        ((0, 0, 100), (0, 0, 30000)),
    ],
)
def test_the_printed_shares(errors, forces):
    K, found = shared(UM * np.array([errors]), F, C)
    np.testing.assert_allclose(found, [forces], rtol=0, atol=5e-4)
    assert K[0] == pytest.approx(3 * max(forces) / F, abs=1e-7)


@pytest.mark.parametrize("k", [2, 3, 4, 5, 8])
def test_shares_against_every_set_of_satellites(k):
    rng = np.random.default_rng(k)
    for size in (1e-6, 2e-5, 2e-4, 1e-2):
        e = rng.normal(0, size, (60, k))
        e[::3] = np.round(e[::3] / size) * size  # ties
        K, found = shared(e, F, C)
        by_sets = np.array([by_hand(row, F, C) for row in e])
        np.testing.assert_allclose(found, by_sets, rtol=1e-9, atol=1e-6 * F)
        by_roots = np.array([by_root(row, F, C) for row in e])
        np.testing.assert_allclose(found, by_roots, rtol=1e-9, atol=1e-6 * F)
        np.testing.assert_allclose(found.sum(axis=1), F)
        np.testing.assert_allclose(K, k * found.max(axis=1) / F)
        assert K.min() >= 1 and K.max() <= k


def test_shares_where_all_touch_are_the_closed_formula():
    e = np.random.default_rng(9).uniform(-1e-6, 1e-6, (500, 4))
    expected = 1 + 4 * C * (e.max(axis=1) - e.mean(axis=1)) / F
    np.testing.assert_allclose(shared(e, F, C).K, expected, rtol=1e-13)


@pytest.mark.parametrize("k", [2, 3, 7])
def test_shares_at_their_ends(k):
    one = np.zeros((1, k))
    one[0, -1] = 1.0  # a metre: one satellite carries all
    assert shared(one, F, C).K[0] == k
    assert np.count_nonzero(shared(one, F, C).forces) == 1
    for alike in (0.0, -1e-3, 0.1):
        K, forces = shared(np.full((1, k), alike), F, C)
        assert K[0] == 1 and np.ptp(forces) == 0
    # the last one just reached, just not
    first = F / C / (k - 1)
    reached = np.full((1, k), first)
    for last, n in ((1e-9, k), (-1e-9, k - 1)):
        reached[0, 0] = last
        assert np.count_nonzero(shared(reached, F, C).forces) == n


def evaluate(deviations, **settings):
    return tolstat.evaluate("planetary", deviations, settings)


def design(**settings):
    return design_of(Settings(**settings))


def test_the_printed_axial_forces():
    own = design(**CASE)
    assert own.dw2 == pytest.approx(0.15) and own.dw3 == pytest.approx(0.10)
    assert round(math.degrees(own.b2), 6) == 21.896368
    force = 2 * 1000 / own.dw2
    assert round(force * math.tan(own.b2), 6) == 5358.983849
    assert round(2 * 1000 / own.dw3 * math.tan(own.b3), 6) == 5358.983849
    # these modules need no profile shift: the balance finds the same angles
    balance = design(**{**CASE, "helix_3": None})
    assert balance.b3 == pytest.approx(B3) and balance.b2 == pytest.approx(B2)
    assert evaluate({}, **CASE)["residual_axial_force"][0] == 0
    rng = np.random.default_rng(1)
    db2, db3 = rng.normal(0, 0.02, (2, 50))
    found = evaluate({"helix_error_2": db2, "helix_error_3": db3}, **CASE)
    expected = 2000 / 0.15 * np.tan(B2 + db2) - 2000 / 0.10 * np.tan(B3 + db3)
    np.testing.assert_allclose(found["residual_axial_force"], expected, atol=1e-8)
    slope = np.hypot(1 / math.cos(B2) ** 2 / 0.075, 1 / math.cos(B3) ** 2 / 0.05)
    assert round(1000 * slope * 0.5e-3, 6) == 13.222649


def test_angles_that_do_not_balance_leave_a_force():
    own = design(helix_2=0.3, helix_3=0.25)
    found = evaluate({"helix_error_2": 0.01}, helix_2=0.3, helix_3=0.25)
    T = 500 / 3 * own.dw2 / own.dw1  # of a satellite
    expected = 2 * T / own.dw2 * math.tan(0.31) - 2 * T / own.dw3 * math.tan(0.25)
    assert found["residual_axial_force"][0] == pytest.approx(expected)


STUDY = {
    "model": "planetary", "trials": 40_000, "seed": 5,
    "settings": {
        "teeth": [24, 30, 20, 74], "helix_3": f"{B3} rad",
        "module": f"{CASE['module']} m", "module_ratio": CASE["module_ratio"],
        "torque": f"{F * 0.12 / 2} N m", "mesh_stiffness": f"{C} N/m",
    },
    "deviations": {"position_error": "+-9 um", "helix_error": "+-1.5 mrad"},
}  # fmt: skip


def test_the_printed_spread_and_sharing_in_a_run(tmp_path):
    run = tolstat.run(STUDY, output=tmp_path / "planetary.h5")
    K = run.column("load_sharing_factor")
    n = len(K)
    assert (run.column("unloaded_satellites") == 0).all()
    error = K.std() / math.sqrt(n)
    assert abs(K.mean() - 1.101554125) < 4 * error < 1.5e-3
    exact = 1 + 3 * C * 3 * UM * 3 / (2 * math.sqrt(math.pi)) / F
    assert round(exact, 9) == 1.101554125
    # a torque of 1000 N m on each satellite: 13.222649 N; here F is 3e4 N, not 4e4
    sigma = run.column("residual_axial_force").std() * 4 / 3
    assert abs(sigma / 13.222649 - 1) < 4 / math.sqrt(2 * n)


def test_pins_and_thicknesses_are_as_many_as_there_are():
    for k in (2, 3, 4):
        found = evaluate({f"position_error_{k}": [0.0, 60 * UM]}, satellites=k)
        assert found["load_sharing_factor"][0] == 1 < found["load_sharing_factor"][1]
    with pytest.raises(ModelError, match="position_error_4"):
        evaluate({"position_error_4": 0.0}, satellites=3)


def test_loads_of_the_machine_are_those_of_the_formula():
    own, e = design(satellites=4), UM * np.array([[5, -20, 0, 80], [1, 0, 300, 2]])
    rows = {f"position_error_{j + 1}": e[:, j] for j in range(4)}
    found = evaluate(rows, satellites=4, torque=700.0, mesh_stiffness=2e8)
    forces = np.array([by_hand(row, 1400 / own.dw1, 2e8) for row in e])
    largest = forces.max(axis=1)
    np.testing.assert_allclose(found["satellite_force_max"], largest)
    share = 4 * largest / (1400 / own.dw1)
    np.testing.assert_allclose(found["load_sharing_factor"], share)
    unloaded = np.count_nonzero(forces == 0, axis=1)
    assert list(found["unloaded_satellites"]) == list(unloaded) == [1, 3]
    pins = evaluate(
        rows, satellites=4, torque=700.0, mesh_stiffness=2e8, position_at="pin"
    )
    felt = {name: (1 + own.D) * values for name, values in rows.items()}
    other = evaluate(felt, satellites=4, torque=700.0, mesh_stiffness=2e8)
    np.testing.assert_allclose(pins.iloc[:, -6:-1], other.iloc[:, -6:-1])


@pytest.mark.parametrize("scheme", EXAMPLES)
def test_a_pin_that_moves_rolls_its_satellite_on_wheel_4(scheme):
    own = design(scheme=scheme, teeth=EXAMPLES[scheme])
    external = {"AA": (1, 1), "II": (0, 0), "AI": (1, 0)}[scheme]
    # places on the line of centres, seen from the pin
    at_12 = -own.dw2 / 2 if external[0] else own.dw2 / 2
    at_34 = -own.dw3 / 2 if external[1] else own.dw3 / 2
    spin = -1 / at_34  # pin at speed 1; the satellite rests where it touches wheel 4
    assert felt_in_mesh(own) == pytest.approx(abs(1 + spin * at_12))


def involute(alpha):
    return math.tan(alpha) - alpha


def opened(a, alpha, da, external):
    """Play along the pitch circle of a mesh whose centre distance grows; involutes."""
    new = math.acos(a * math.cos(alpha) / (a + da))
    play = 2 * (a + da) * (involute(new) - involute(alpha))
    return play if external else -play


@pytest.mark.parametrize("scheme", EXAMPLES)
def test_backlash_against_involutes_and_a_satellite_that_turns(scheme):
    settings = {"scheme": scheme, "teeth": EXAMPLES[scheme], "pressure_angle": 0.4}
    own = design(**settings)
    one, two = {"AA": (1, 1), "II": (0, 0), "AI": (1, 0)}[scheme]
    z1, z2, *_ = EXAMPLES[scheme]
    da = 1e-7
    angles = [math.atan(math.tan(0.4) / math.cos(b)) for b in (own.b2, own.b3)]
    play = [opened(own.a, x, da, e) for x, e in zip(angles, (one, two), strict=True)]
    satellite = play[1] / (own.dw3 / 2)
    wheel_1 = play[0] / (own.dw1 / 2) + satellite * z2 / z1
    found = evaluate({"centre_distance": da}, **settings)["backlash"][0]
    assert found == pytest.approx(wheel_1, rel=1e-4)
    for n, turns in (
        (1, 2 / own.dw1),
        (2, 2 / own.dw1),
        (3, 2 / own.dw3 * z2 / z1),
        (4, 2 / own.dw3 * z2 / z1),
    ):
        thin = evaluate({f"tooth_thickness_{n}": -1e-4}, **settings)["backlash"][0]
        assert thin == pytest.approx(1e-4 * turns)


@pytest.mark.parametrize("scheme", EXAMPLES)
def test_a_gear_is_coaxial_with_zero_shift(scheme):
    for mr in (1.0, 1.01, 0.995):
        s = Settings(scheme=scheme, teeth=EXAMPLES[scheme], module_ratio=mr)
        own, m = design_of(s), s.module
        one, two = {"AA": (1, 1), "II": (-1, -1), "AI": (1, -1)}[scheme]
        modules = m, m, m / mr, m / mr
        helix = own.b2, own.b2, own.b3, own.b3
        d = [
            z * m / math.cos(b) for z, m, b in zip(s.teeth, modules, helix, strict=True)
        ]
        np.testing.assert_allclose(own[5:9], d)
        assert d[0] + one * d[1] == pytest.approx(2 * own.a)
        assert d[3] + two * d[2] == pytest.approx(2 * own.a)
        assert math.tan(own.b2) / math.tan(own.b3) == pytest.approx(d[1] / d[2])
        assert own.alpha34 == pytest.approx(
            math.atan(math.tan(math.radians(20)) / math.cos(own.b3))
        )


def test_a_given_angle_is_balanced_by_the_other_and_profile_shift():
    """Base circles and leads of wheels 3 and 4 are those of their own module."""
    s = Settings(helix_2=0.3)
    own, m3 = design_of(s), s.module
    assert math.tan(0.3) / math.tan(own.b3) == pytest.approx(own.D)
    lead = math.pi * own.dw3 / math.tan(own.b3)
    reference = math.asin(math.pi * m3 * 21 / lead)
    d3 = m3 * 21 / math.cos(reference)
    transverse = math.atan(math.tan(s.pressure_angle) / math.cos(reference))
    assert own.dw3 * math.cos(own.alpha34) == pytest.approx(d3 * math.cos(transverse))
    assert abs(own.dw3 / d3 - 1) > 1e-3
    both = design(helix_2=0.3, helix_3=own.b3)
    np.testing.assert_allclose(both[1:], own[1:], atol=1e-12)
    np.testing.assert_allclose(design(helix_3=own.b3)[1:], own[1:], atol=1e-12)


def test_every_gear_of_the_catalogue_is_a_machine():
    gears = designs(**CATALOGUE, module=2.5e-3)
    for row in gears.iloc[::9].to_dict("records"):
        teeth = tuple(int(row[f"z{n}"]) for n in (1, 2, 3, 4))
        settings = {"teeth": teeth, "satellites": 3, "addendum": 0.0}
        own = design(**settings)
        assert own.ratio == pytest.approx(row["ratio"])
        found = own.D, own.b2, own.b3
        assert found == pytest.approx((row["D"], row["helix_2"], row["helix_3"]))
        # the spread of the axial force is what `balance` foretells
        force = 2 * 500 / own.dw1 / 3
        rows = [
            evaluate({f"helix_error_{n}": 1e-6}, **settings)["residual_axial_force"][0]
            for n in (2, 3)
        ]
        assert np.hypot(*rows) == pytest.approx(force * row["balance"] * 1e-6, rel=1e-4)


def test_tips_that_touch_are_refused_where_pitch_circles_do_not():
    gears = designs(**CATALOGUE)
    tight = gears[gears["tip_gap"] <= 0]
    assert len(tight) == 4
    for row in tight.to_dict("records"):
        teeth = tuple(int(row[f"z{n}"]) for n in (1, 2, 3, 4))
        design(teeth=teeth, addendum=0.0)
        with pytest.raises(
            ModelError, match=r"3 satellites touch.*at most 2 have room"
        ):
            design(teeth=teeth)


GIVEN = {"helix_2": 0.3, "helix_3": 0.3}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (
            {"scheme": "II"},
            r"wheel 1 is a ring around wheel 2 .* 36, not 24; give other",
        ),
        ({"scheme": "II"}, r"other teeth: \[78, 26, 30, 81\]"),
        ({"teeth": (24, 36, 84, 84)}, "wheel 4 is a ring around wheel 3 .* 84, not 84"),
        ({"scheme": "AA", "teeth": (30, 40, 20, 15)}, "z1 z3 = z2 z4 = 600: wheel 1"),
        ({"teeth": (17, 45, 18, 66)}, r"kap = .* = 1.29167 .* sin\^2 b3 = -0.145889"),
        (
            {**GIVEN, "module_ratio": 0.5},
            "circle of 52.338 mm and has one of 133.91 mm",
        ),
        ({**GIVEN, "module_ratio": 0.5}, "module_ratio = 1.0500, which needs none"),
        ({"helix_3": 1.0}, "not coaxial"),
        ({"satellites": 6}, "they are 80.616 mm apart and 101.74 mm wide"),
        ({"satellites": 6}, "6 satellites touch.*at most 4 have room"),
        ({"teeth": (25, 36, 21, 84), "helix_2": 0.3}, "= 3549 .* = 9; .* none can"),
        (
            {"scheme": "AA", "teeth": (31, 21, 25, 25), "helix_2": 0.3},
            "z1 z3 - z2 z4 = 250 .* = 3; of the numbers that have room 2, 5 can",
        ),
        ({"satellites": 1}, "at least 2"),
        ({"torque": -1.0}, "at least 1e-6 N m"),
        ({"teeth": (24, 36, 21)}, "4 are expected"),
        ({"position_at": "pins"}, "pin"),
    ],
)
def test_impossible_gears_are_refused(settings, words):
    with pytest.raises(ModelError, match=words):
        evaluate({}, **settings)


def test_the_proposed_ratio_needs_no_shift():
    with pytest.raises(ModelError) as refused:
        design(helix_2=0.3, helix_3=0.2, module_ratio=0.7)
    fits = float(str(refused.value).split("module_ratio = ")[1].split(",")[0])
    s = Settings(helix_2=0.3, helix_3=0.2, module_ratio=fits)
    own = design_of(s)
    assert own.dw3 == pytest.approx(s.module / fits * 21 / math.cos(0.2), rel=1e-4)


def test_grades_have_their_sizes():
    along_the_mesh = Planetary().describe(Settings()).contributors
    assert along_the_mesh[2].gear.error == "pitch"
    pins = Planetary().describe(Settings(position_at="pin")).contributors
    assert pins[2].gear is None
    sizes = {c.name: c.size for c in pins if c.size}
    assert sizes == {"centre_distance": pytest.approx(80.616e-3, abs=1e-6)}
