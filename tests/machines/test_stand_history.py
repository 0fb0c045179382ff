"""Histories of the stand, against the responses of its trials."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tolstat.errors import ModelError
from tolstat.machines.stand.declarations import WINDOW, Settings
from tolstat.machines.stand.machine import marks_of

CRANKS = {"crank_difference": 1e-3}
FIG4 = {"contact_yaw": 5.8e-4}


@pytest.fixture(scope="module")
def moved():
    return tolstat.trajectory("stand", CRANKS, FIG4)


@pytest.fixture(scope="module")
def window(moved):
    return moved[moved.index >= marks_of(Settings())[WINDOW]]


def test_the_trial_is_the_one_of_evaluate(moved):
    """Looking does not change the steps: bit for bit the same responses."""
    known = tolstat.evaluate("stand", CRANKS, FIG4).iloc[0]
    found = moved.attrs["responses"]
    assert moved.attrs["status"] == "done"
    assert all(known[name] == value for name, value in found.items())
    coarse = tolstat.trajectory("stand", CRANKS, FIG4, step=0.01)
    assert coarse.attrs["responses"] == found
    np.testing.assert_allclose(
        coarse["yaw"].iloc[::10], np.interp(coarse.index[::10], moved.index, moved.yaw),
        atol=1e-8,
    )  # fmt: skip


@pytest.mark.parametrize(
    "name",
    ["rod_force_1", "rod_force_2", "shaft_9_moment", "shaft_12_moment", "mesh_force_0",
     "mesh_force_1", "mesh_force_2", "drive_moment", "yaw"],
)  # fmt: skip
def test_peaks_of_the_curves_are_the_responses(window, moved, name):
    peak = moved.attrs["responses"][name]
    assert window[name].abs().max() == pytest.approx(peak, rel=1e-4)


def test_tension_and_compression(window, moved):
    for rod in ("1", "2"):
        force, peaks = window[f"rod_force_{rod}"], moved.attrs["responses"]
        assert force.max() == pytest.approx(peaks[f"rod_tension_{rod}"], rel=1e-4)
        assert -force.min() == pytest.approx(peaks[f"rod_compression_{rod}"], rel=1e-4)


@pytest.mark.parametrize(
    "name", ["drive", "slide", "guide", "roll", "spin", "damping", "contact"]
)
def test_powers_integrate_to_the_energies(window, moved, name):
    found = np.trapezoid(window[f"{name}_power"], window.index)
    drive = moved.attrs["responses"]["drive_energy"]
    known = moved.attrs["responses"][f"{name}_energy"]
    assert found == pytest.approx(known, abs=2e-4 * drive)


def test_speed_is_the_rate_of_the_position(moved):
    rate = np.gradient(moved["position"], moved.index)
    np.testing.assert_allclose(rate[1:-1], moved["speed"].iloc[1:-1], atol=2e-4)
    assert moved["position"].iloc[0] < moved["position"].min() + 1e-3  # leftmost
    assert moved["speed"].iloc[0] == 0.0


def test_the_contact_time_of_the_guides(window, moved):
    share = (window["yaw"].abs() > FIG4["contact_yaw"]).mean()
    assert share == pytest.approx(moved.attrs["responses"]["jam_share"], abs=1e-3)


def test_the_papers_figures_2_and_3():
    """Cranks 1 mm apart: shaft 9 fares best with both loops opened; equal rods."""
    peaks = {}
    for name, settings in {
        "indeterminate": {},
        "equalized": {"variant": "equalized"},
        "balanced": {"variant": "equalized", "drive": "balanced"},
    }.items():
        frame = tolstat.trajectory("stand", CRANKS, {**FIG4, **settings})
        window = frame[frame.index >= marks_of(Settings())[WINDOW]]
        peaks[name] = window["shaft_9_moment"].abs().max()
        if name == "indeterminate":
            opposite = (window["rod_force_1"] * window["rod_force_2"] < 0).mean()
            assert opposite == pytest.approx(0.0180, abs=2e-3)
        else:
            np.testing.assert_allclose(
                window["rod_force_1"], window["rod_force_2"], atol=0.05
            )
            assert not window["yaw"].any()
    assert peaks["indeterminate"] == pytest.approx(1834.5, rel=2e-3)
    assert peaks["equalized"] == pytest.approx(1991.5, rel=2e-3)
    assert peaks["balanced"] == pytest.approx(26.8, rel=2e-2)


def test_units_and_words(moved):
    units = moved.attrs["units"]
    assert units["time"] == "s" and units["drive_power"] == "W"
    assert set(units) == {"time", *moved.columns}


def test_an_impossible_trial_has_no_history():
    frame = tolstat.trajectory("stand", {"rod_stiffness_1": -2.0})
    assert frame.attrs["status"] == "no part left"
    assert frame["yaw"].iloc[1:].isna().all()


def test_wrong_requests_are_refused(toy):
    with pytest.raises(ModelError, match="does not move"):
        tolstat.trajectory(toy)
    with pytest.raises(ModelError, match="a view shows one trial, not 2"):
        tolstat.trajectory("stand", {"friction": [0.1, 0.2]})
    with pytest.raises(ModelError, match="did you mean 'friction'"):
        tolstat.trajectory("stand", {"frction": 0.1})
    with pytest.raises(ModelError, match="step = 0"):
        tolstat.trajectory("stand", step=0.0)
