"""Views of planetary gears: the requested gears, and where they exist."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import tolstat
from tests.machines.planetary_catalogue import CATALOGUE, EIGHT_TO_THIRTY
from tolstat.errors import TolstatError
from tolstat.machines.planetary import designs, existence


def view_of(**settings):
    return tolstat.view("planetary", "designs", settings=settings)


def test_the_view_lists_gears_in_the_requested_order():
    found = view_of(
        wanted_ratio=7.0, z1=(17, 26), z4=(61, 130), helix=EIGHT_TO_THIRTY, order="size"
    ).frame()
    expected = designs(**CATALOGUE, order="size", module=2.5e-3)
    pd.testing.assert_frame_equal(found, expected)
    assert found.attrs["units"] == expected.attrs["units"]


def test_the_view_uses_the_ratio_of_the_teeth_by_default():
    settings = {"scheme": "II", "teeth": (75, 20, 24, 79), "satellites": 5}
    ranges = {"z1": (60, 80), "z2": (17, 30), "z3": (17, 30), "z4": (60, 90)}
    found = view_of(**settings, **ranges).frame()
    assert np.abs(found["ratio"] * 1800 / 220 - 1).max() <= 0.01
    # kap = 1: spur wheels are not among gears of 8 to 30 deg, and nothing is said
    assert not (found[["z1", "z2", "z3", "z4"]] == [75, 20, 24, 79]).all(axis=1).any()


def test_the_view_reports_an_empty_result():
    with pytest.raises(TolstatError, match=r"no gear found. Of the sets of teeth \d+ "):
        view_of(helix=(1.45, 1.5))


@pytest.mark.parametrize(
    ("scheme", "teeth", "k"),
    [
        ("AI", (24, 36, 21, 84), 3),
        ("AI", (24, 36, 21, 84), 2),
        ("AA", (30, 21, 25, 25), 3),
        ("II", (78, 26, 30, 81), 3),
    ],
)
def test_the_view_of_existence(scheme, teeth, k):
    settings = {"scheme": scheme, "teeth": teeth, "satellites": k}
    chart = tolstat.view("planetary", "existence", settings=settings)
    frame = chart.frame()
    lower, upper = existence(scheme, frame.index.to_numpy(), k)
    shown = frame.to_numpy().T
    for values, drawn in zip((lower, upper), shown, strict=True):
        there = np.isfinite(drawn)
        np.testing.assert_array_equal(drawn[there], values[there])
        assert there.all() or k == 2
    (gear,) = (curve for curve in chart.curves if curve.points)
    lower, upper = existence(scheme, gear.at, k)
    assert lower < gear.values < upper
    assert np.isfinite(chart.regions[0].values).all()
