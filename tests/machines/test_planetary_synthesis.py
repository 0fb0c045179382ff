"""The synthesis against four nested loops, and against the printed catalogue."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest

from tests.machines.planetary_catalogue import CATALOGUE
from tolstat.errors import ModelError
from tolstat.machines.planetary import designs, synthesis
from tolstat.machines.planetary.declarations import Settings
from tolstat.machines.planetary.scheme import SCHEMES
from tolstat.units.grammar import Range

AA = {
    "scheme": "AA", "ratio": -1.0, "ratio_tolerance": 0.1, "satellites": 3,
    "z1": (20, 27), "z2": (20, 36), "z3": (20, 36), "z4": (20, 36), "helix": (0.1, 0.6),
}  # fmt: skip
II = {
    "scheme": "II", "ratio": 0.1, "ratio_tolerance": 0.2, "satellites": 4,
    "z1": (70, 80), "z2": (20, 30), "z3": (20, 34), "z4": (70, 82), "helix": (0, 0.6),
    "module_ratio": 1.05,
}  # fmt: skip
AI = {
    "scheme": "AI", "ratio": 6.06, "ratio_tolerance": 0.01, "satellites": 2,
    "z1": (20, 25), "z2": (20, 44), "z3": (20, 44), "z4": (60, 100), "helix": (0, 1.0),
    "module_ratio": 0.8,
}  # fmt: skip


def by_loops(asked):
    """Every set of teeth, each condition in plain words, as the source has them."""
    mr, k = asked.get("module_ratio", 1.0), asked["satellites"]
    one = 1 if asked["scheme"] in ("AA", "AI") else -1
    two = 1 if asked["scheme"] == "AA" else -1
    low, high = asked["helix"]
    wanted, wide = (Fraction(str(asked[n])) for n in ("ratio", "ratio_tolerance"))
    about = float(wanted), 1.001 * float(wide * abs(wanted))
    found = []
    every = [range(a, b + 1) for a, b in (asked[f"z{n}"] for n in (1, 2, 3, 4))]
    for z1, z2, z3, z4 in itertools.product(*every):
        if abs(1 - one * two * z2 * z4 / (z1 * z3) - about[0]) > about[1]:
            continue
        i = 1 - one * two * Fraction(z2 * z4, z1 * z3)  # exact at the ends
        if abs(i - wanted) > wide * abs(wanted):
            continue
        whole = z1 * z3 - one * two * z2 * z4
        sums = z1 + one * z2, z4 + two * z3
        if whole % (k * math.gcd(z2, z3)) or min(sums) <= 0 or i == 0:
            continue
        kap, x = mr * sums[0] / sums[1], z2 / z3
        if math.isclose(kap, 1):
            b2 = b3 = 0.0
        else:
            below = mr**2 * x**2 - kap**2
            square = (1 - kap**2) / below if below else -1.0
            if not 0 < square < 1 or mr * x * math.sqrt(square) >= 1:
                continue
            b3 = math.asin(math.sqrt(square))
            b2 = math.asin(mr * x * math.sin(b3))
        if not (low <= b2 <= high and low <= b3 <= high):
            continue
        d2, d3, a2 = z2 / math.cos(b2), z3 / mr / math.cos(b3), sums[0] / math.cos(b2)
        if a2 * math.sin(math.pi / k) <= max(d2, d3):
            continue
        found.append((z1, z2, z3, z4, float(i), d2 / d3, b2, b3, a2 + max(d2, d3)))
    return found


# rings that would be smaller than what is in them, and a wheel 1 that never turns
SMALL_RINGS = {
    "scheme": "II", "ratio": -0.5, "ratio_tolerance": 1.5, "satellites": 3,
    "z1": (20, 40), "z2": (15, 30), "z3": (15, 30), "z4": (20, 40), "helix": (0, 1.4),
}  # fmt: skip
EVERY = [CATALOGUE, AA, II, AI, SMALL_RINGS]


@pytest.mark.parametrize("asked", EVERY, ids=lambda a: a["scheme"])
def test_it_finds_what_four_loops_find(asked):
    found, expected = designs(**asked), by_loops(asked)
    assert len(expected) > 20
    teeth = found[["z1", "z2", "z3", "z4"]].to_numpy()
    np.testing.assert_array_equal(teeth, [row[:4] for row in expected])
    numbers = found[["ratio", "D", "helix_2", "helix_3", "size"]].to_numpy()
    np.testing.assert_allclose(numbers, [row[4:] for row in expected], atol=1e-12)


def test_the_catalogue():
    found = designs(**CATALOGUE)
    assert len(found) == 200
    left = list(found.attrs["left"].values())
    assert left[2:] == [204, 200]  # without neighbouring condition, and with it
    first = found.iloc[0]
    assert list(first[["z1", "z2", "z3", "z4"]]) == [17, 28, 18, 66]
    assert round(first["ratio"], 6) == 7.039216 and round(first["D"], 6) == 1.659259
    assert round(math.degrees(first["helix_2"]), 6) == 25.854067
    assert round(math.degrees(first["helix_3"]), 6) == 16.280346
    # the same condition whatever the module is called
    scaled = designs(**CATALOGUE, module=2e-3)
    np.testing.assert_allclose(scaled["size"], 2e-3 * found["size"])
    assert found.attrs["units"]["size"] == "1" and scaled.attrs["units"]["size"] == "m"


def test_columns_have_their_declared_meaning():
    found = designs(**AA, module=3e-3, addendum=1.2)
    m = 3e-3
    d2, d3 = m * found.z2 / np.cos(found.helix_2), m * found.z3 / np.cos(found.helix_3)
    centres = m * (found.z1 + found.z2) / np.cos(found.helix_2)
    other = m * (found.z3 + found.z4) / np.cos(found.helix_3)
    np.testing.assert_allclose(centres, other)  # coaxial
    apart = centres * np.sin(np.pi / 3)
    widest = np.maximum(d2, d3)
    np.testing.assert_allclose(found["neighbouring"], apart - widest)
    np.testing.assert_allclose(found["tip_gap"], apart - widest - 2 * 1.2 * m)
    np.testing.assert_allclose(found["size"], centres + widest)
    np.testing.assert_allclose(found["ratio_error"], found["ratio"] + 1)
    gcd = np.gcd(found.z2, found.z3)
    np.testing.assert_array_equal(
        found["assembly"] * 3 * gcd, found.z1 * found.z3 - found.z2 * found.z4
    )
    step = 1e-6
    moved = [
        (np.tan(found.helix_2 + db2) - found.D * np.tan(found.helix_3 + db3)) / step
        for db2, db3 in ((step, 0.0), (0.0, step))
    ]
    np.testing.assert_allclose(found["balance"], np.hypot(*moved), rtol=1e-5)
    assert set(found.attrs["units"]) == set(found)


@pytest.mark.parametrize("order", ["ratio_error", "size", "balance"])
def test_orders(order):
    by_teeth, found = designs(**AI), designs(**AI, order=order)
    values = found[order].abs().to_numpy()
    assert len(found) > 50 and np.all(np.diff(values) >= -1e-12)
    again = found.sort_values(["z1", "z2", "z3", "z4"], ignore_index=True)
    pd.testing.assert_frame_equal(again, by_teeth)
    ties = np.diff(values) <= 1e-12
    then = found["size" if order == "ratio_error" else "ratio_error"].abs().to_numpy()
    assert np.all(np.diff(then)[ties] >= -1e-12)


def test_slices_do_not_change_the_result(monkeypatch):
    whole = designs(**CATALOGUE)
    monkeypatch.setattr(synthesis, "SLICE", 300)
    pd.testing.assert_frame_equal(designs(**CATALOGUE), whole)


def test_wide_ranges_are_worked_through_in_slices():
    wide = dict.fromkeys(("z1", "z2", "z3", "z4"), Range(17, 200))
    asked = Settings(**wide, ratio_tolerance=0.5)
    sizes = []
    for teeth in synthesis._candidates(asked, SCHEMES["AI"], 7.0):
        sizes.append(len(teeth[0]))
        if len(sizes) == 40:
            break
    assert max(sizes) <= synthesis.SLICE + 184
    assert np.mean(sizes) > synthesis.SLICE / 10


def test_ends_belong_to_their_ranges():
    """With an angle of a gear as the end, or its ratio, it is found."""
    for row in designs(**CATALOGUE).iloc[::20].to_dict("records"):
        alone = {f"z{n}": (int(row[f"z{n}"]),) * 2 for n in (1, 2, 3, 4)}
        narrow = {
            **CATALOGUE, **alone, "ratio": row["ratio"], "ratio_tolerance": 0.0,
            "helix": (row["helix_3"], row["helix_2"]),
        }  # fmt: skip
        if row["helix_3"] > row["helix_2"]:
            narrow["helix"] = narrow["helix"][::-1]
        assert len(designs(**narrow)) == 1
        narrow["helix"] = narrow["helix"][0] + 1e-9, narrow["helix"][1]
        assert len(designs(**narrow)) == 0
    # sin b2 is 1/2, and its angle some digits more than 30 deg
    half = {**CATALOGUE, "ratio": 1 + 31 * 83 / (31 * 13), "satellites": 2}
    for wheel, z in zip(("z1", "z2", "z3", "z4"), (31, 31, 13, 83), strict=True):
        half[wheel] = z, z
    assert len(designs(**half)) == 1
    # and ratios that are 1 % off, but for rounding
    found = designs(**{**AI, "ratio": 6.0})["ratio"].round(12).to_numpy()
    assert {5.94, 6.06} <= set(found)


@pytest.mark.parametrize("module_ratio", [1.0, 1.1, 0.9])
def test_satellites_that_touch_exactly_have_no_room(module_ratio):
    """Six, sin(pi/6) = 1/2: touching with 2a = 2 dw2, or 2 dw3, in whole numbers."""
    wide = {"z1": (10, 40), "z2": (10, 40), "z3": (10, 40), "z4": (20, 110)}
    six = {**CATALOGUE, **wide, "ratio": 4, "ratio_tolerance": 0.5, "satellites": 6}
    found = designs(**{**six, "helix": (0, 1.4)}, module_ratio=module_ratio)
    assert len(found) > 10_000 and found["neighbouring"].min() > 1e-3
    twice = found.z1 + found.z2, found.z4 - found.z3
    assert np.all(twice[0] > 2 * found.z2) and np.all(twice[1] > 2 * found.z3)


def test_spur_wheels_where_the_range_begins_at_0():
    """z1 + z2 = z4 - z3: kap = 1."""
    asked = {**CATALOGUE, "helix": (0.0, 0.0)}
    found = designs(**asked)
    assert len(found) > 20
    assert np.all(found.z1 + found.z2 == found.z4 - found.z3)
    assert not found[["helix_2", "helix_3"]].to_numpy().any()
    np.testing.assert_allclose(found["D"], found.z2 / found.z3)


def test_an_empty_result_is_a_table_with_all_columns():
    found = designs(**{**CATALOGUE, "helix": (1.45, 1.5)})
    assert len(found) == 0 and list(found) == list(designs(**CATALOGUE))
    assert found.attrs["left"]["have the ratio"] > 1000


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"scheme": "IA"}, "scheme = 'IA': .*AA"),
        ({"ratio": 0.5}, "ratio 0.5: the scheme AI has ratios above 1"),
        ({"scheme": "AA"}, "ratio 7: the scheme AA has ratios below 1 and not 0"),
        ({"scheme": "II", "ratio": 0}, "below 1 and not 0"),
        ({"ratio": math.nan}, "ratio = nan"),
        ({"ratio": 300}, "ratio 300: .* from 1.6.* to 27.*; widen them"),
        ({"ratio_tolerance": -0.1}, "ratio_tolerance = -0.1: it must be at least 0"),
        ({"z1": (26, 17)}, r"z1 = \(26, 17\): the lower end comes first"),
        ({"z2": (17.5, 20)}, "z2 = "),
        ({"z3": 20}, "z3 = 20: 1 numbers; 2 are expected"),
        ({"z4": (0, 20)}, "z4 = "),
        ({"z4": (17, math.inf)}, "z4 = "),
        ({"helix": (8, 30)}, r"helix = \(8, 30\): .* in rad"),
        ({"helix": (0.5, 0.1)}, "helix = "),
        ({"helix": (-0.1, 0.1)}, "helix = "),
        ({"satellites": 1}, "satellites = 1: it must be at least 2"),
        ({"satellites": 2.5}, "satellites = 2.5"),
        ({"module": 0.0}, "module = 0.0: it must be above 0"),
        ({"module_ratio": -1}, "module_ratio = -1"),
        ({"order": "ratio"}, "order = 'ratio': did you mean 'ratio_error'"),
        ({"z1": (5, 1005), "z2": (5, 1005), "z3": (5, 1005)}, "are too many"),
    ],
)
def test_impossible_ranges_are_refused(change, words):
    with pytest.raises(ModelError, match=words):
        designs(**{**CATALOGUE, **change})


def test_too_many_results_are_refused(monkeypatch):
    monkeypatch.setattr(synthesis, "MOST_DESIGNS", 100)
    with pytest.raises(ModelError, match="more than 100 gears fit: narrow"):
        designs(**CATALOGUE)
