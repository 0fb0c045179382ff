"""Static indeterminacy of the stand: degrees, self-stress, loads of deviations."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tolstat.machines.stand.declarations import Settings
from tolstat.machines.stand.machine import Stand
from tolstat.machines.stand.views import loads, loops, self_stress

UP = np.pi / 2
EQUALIZED, BALANCED = {"variant": "equalized"}, {"drive": "balanced"}


def named(at, load):
    return dict(zip(at.members, load, strict=True))


@pytest.mark.parametrize(
    ("settings", "free", "touched"),
    [({}, 1, 2), (BALANCED, 0, 1), (EQUALIZED, 1, 1), (EQUALIZED | BALANCED, 0, 0)],
)
@pytest.mark.parametrize("phi31", [UP, 0.3, -2.0])
def test_degree(settings, free, touched, phi31):
    for expected, touches in ((free, False), (touched, True)):
        at = loops(Settings(**settings), phi31, touched=touches)
        stress = self_stress(at)
        assert len(stress) == expected
        np.testing.assert_allclose(stress @ at.J, 0, atol=1e-12)


@pytest.mark.parametrize(
    ("settings", "known"),
    [
        (EQUALIZED | BALANCED, (0.048117888, 0.047907078)),
        (BALANCED, (0.020786928, 0.020695858)),
    ],
)
def test_determinants_of_square_machines(settings, known):
    found = [
        abs(np.linalg.det(loops(Settings(**settings), phi31, touched=False).J))
        for phi31 in (UP, 0.3)
    ]
    assert found == pytest.approx(known, abs=6e-10)


def test_the_second_loop_loads_itself():
    at = loops(Settings(), 1.1, touched=False)
    stress = named(at, self_stress(at)[0])
    ratios = {"mesh_1": 1, "mesh_2": -1, "shaft_12": 0.21, "shaft_9": 0.546}
    for name, value in stress.items():
        assert value == pytest.approx(ratios.get(name, 0.0), abs=1e-12), name
    loaded = named(at, loads(at)["tooth_position_1"])
    assert loaded["mesh_1"] == pytest.approx(2.0443827e7, rel=3e-8)
    N = Settings()
    yielding = 2 / N.k3 + N.r2**2 / N.c2 + N.r3**2 / N.c3
    assert loaded["mesh_1"] == pytest.approx(1 / yielding, rel=1e-12)


TABLE = """
rod_length_1 -32461240 -18372220 -3858165 1325565 28035060
crank_radius_1 927463.9 524920.4 110233.3 -37873.29 -801001.7
crank_angle_1 -11356790 -6427650 -1349807 463758.3 9808265
tooth_position_1 18372220 30842020 6476825 10412090 -15867110
guide_clearance 18690040 10578080 2221396 -763213.7 -16141600
"""


@pytest.mark.parametrize("row", TABLE.strip().splitlines())
def test_loads_of_deviations(row):
    contributor, *known = row.split()
    at = loops(Settings(), UP, touched=True)
    found = named(at, loads(at)[contributor])
    members = ("rod_1", "mesh_1", "shaft_12", "shaft_9", "guide")
    for member, text in zip(members, known, strict=True):
        assert found[member] == pytest.approx(float(text), rel=5e-7), member
    assert found["rod_2"] == pytest.approx(-found["rod_1"], rel=1e-12)
    assert found["mesh_2"] == pytest.approx(-found["mesh_1"], rel=1e-12)
    assert found["mesh_0"] == 0


def test_the_pairs_are_sums_of_single_parts():
    found = loads(loops(Settings(), 1.0, touched=True))
    rods = found["rod_length_1"] - found["rod_length_2"]
    np.testing.assert_allclose(found["rod_difference"], rods, rtol=1e-12)
    cranks = (found["crank_radius_2"] - found["crank_radius_1"]) / 2
    np.testing.assert_allclose(found["crank_difference"], cranks, rtol=1e-12)


def test_loads_with_the_differential():
    at = loops(Settings(drive="balanced"), UP, touched=True)
    found = named(at, loads(at)["rod_length_1"])
    assert found["rod_1"] == pytest.approx(-21517130, rel=3e-7)
    assert found["shaft_9"] == pytest.approx(7527922, rel=3e-7)


@pytest.mark.parametrize("phi31", [UP, 0.3, 4.0])
def test_rods_of_different_length_in_closed_form(phi31):
    N = Settings()
    at = loops(N, phi31, touched=True)
    sin4 = (N.h - N.r * np.sin(phi31)) / N.l
    phi4 = np.arcsin(sin4)
    p = N.r * np.sin(phi31 + phi4)
    c_w = N.c3 + N.r3**2 / (2 / N.k3 + N.r2**2 / N.c2)
    yielding = 2 / N.k + (N.dl_s * np.cos(phi4)) ** 2 / N.c_s + p**2 / c_w
    found = loads(at)
    rod = at.members.index("rod_1")
    assert found["rod_length_2"][rod] == pytest.approx(1 / yielding, rel=1e-12)
    for name, elongation in (
        ("crank_radius_1", np.cos(phi31 + phi4)),
        ("crank_angle_1", -p),
        ("hinge_height_1", sin4),
    ):
        assert found[name][rod] == pytest.approx(elongation / yielding, rel=1e-9)


def test_a_stand_that_cannot_be_mounted_has_no_numbers():
    assert Stand().numbers(Settings(l=0.6), {}) == ()


def test_the_view_and_the_numbers_of_a_study(tmp_path):
    shown = tolstat.view("stand", "indeterminacy")
    assert "1 with the guides free, 2 touched" in shown.sentence
    frame = shown.frame().set_index(["guides", "deviation"])
    # N of 1 mm
    assert frame.loc[("touched", "rod_length_1"), "rod_1"] == pytest.approx(-32461.24)
    assert frame.loc[("free", "self-stress 1 of 1"), "shaft_9"] == pytest.approx(546)
    turn = tolstat.view("stand", "indeterminacy_turn").frame()
    at_90 = turn.iloc[45]["rod_1, crank_radius_1"]
    assert at_90 == pytest.approx(927.4639, rel=1e-6)
    study = {
        "model": "stand", "trials": 2, "seed": 1,
        "deviations": {"rod_length": "+-1 mm", "friction": "+-10 %"},
    }  # fmt: skip
    run = tolstat.run(study, output=tmp_path / "run.h5")
    numbers = {each.name: each.value for each in run.numbers}
    assert numbers["degree_free"] == 1 and numbers["degree_touched"] == 2
    assert numbers["load_rod_length_1"] == pytest.approx(-32461240, rel=3e-7)
    assert {*numbers} == {"degree_free", "degree_touched", "load_rod_length_1"}
