"""Play in the joints of the rods, against limits in which it is known."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.machines.reference import D58, MORE
from tolstat.machines.stand.declarations import END, WINDOW, Settings
from tolstat.machines.stand.machine import marks_of

TIGHT = {"rtol": 1e-8, "max_step": 2e-4}


def test_play_of_a_micrometre_changes_as_little():
    deviations = {"crank_difference": 1e-3, "joint_clearance": [0.0, 1e-6]}
    found = tolstat.evaluate("stand", deviations, {**D58, **TIGHT})["extra_loss"]
    assert found[1] / found[0] - 1 == pytest.approx(1.5e-4, rel=0.05)


def test_rods_that_are_never_free_are_longer_or_shorter():
    settings = {"settle": 2, "cycles": 1, **TIGHT}
    play = {"rod_difference": 4e-3, "joint_clearance_1": 0.5e-3}
    play["joint_clearance_2"] = 0.3e-3
    found = tolstat.evaluate("stand", play, settings).iloc[0]
    assert found["extra_loss"] == pytest.approx(0.42230845, abs=2e-8)
    assert found["rod_force_1"] == pytest.approx(298817.1, rel=4e-7)
    assert found["rod_force_2"] == pytest.approx(331546.3, rel=4e-7)
    assert found["contacts_1"] == found["free_share_1"] == found["approach_2"] == 0
    same = {"rod_length_1": 3.75e-3, "rod_length_2": -3.85e-3}
    known = tolstat.evaluate("stand", same, settings).iloc[0]
    for name in ("extra_loss", "rod_force_1", "rod_force_2", "shaft_9_moment"):
        assert found[name] == pytest.approx(known[name], rel=1e-6)


def test_trials_without_play_are_the_same_beside_others_with_it():
    deviations = {"crank_difference": 1e-3, "joint_clearance_1": [0.0, 3e-4, 0.0]}
    mixed = tolstat.evaluate("stand", deviations)
    alone = tolstat.evaluate("stand", {"crank_difference": 1e-3}).iloc[0]
    one = {"crank_difference": 1e-3, "joint_clearance_1": 3e-4}
    loose = tolstat.evaluate("stand", one).iloc[0]
    for name in alone.index:
        assert mixed[name][0] == mixed[name][2] == alone[name]
        assert mixed[name][1] == loose[name]


@pytest.mark.parametrize("case", ["L2", "L3"])
def test_a_history_shows_the_play(case):
    """Free where the force is zero; closings counted where it comes back."""
    deviations, settings = MORE[case]
    moved = tolstat.trajectory("stand", deviations, settings)
    marks = marks_of(Settings())
    window = moved[(moved.index >= marks[WINDOW]) & (moved.index <= marks[END])]
    for rod in (1, 2):
        free = window[f"rod_force_{rod}"].to_numpy() == 0.0
        told = moved.attrs["responses"]
        assert free.mean() == pytest.approx(told[f"free_share_{rod}"], abs=2e-4)
        closes = np.count_nonzero(free[:-1] & ~free[1:])
        assert closes == told[f"contacts_{rod}"]


def test_a_stand_that_starts_loaded_touches():
    """At rest the force is that of the rod without play, less k c/2."""
    turned, c = {"crank_angle_1": 0.02}, 1e-6
    without, loose = (
        tolstat.trajectory("stand", each)["rod_force_1"].iloc[0]
        for each in (turned, turned | {"joint_clearance": c})
    )
    play = Settings().k * c / 2
    assert abs(without) > 2 * play
    assert abs(loose) == pytest.approx(abs(without) - play, rel=1e-6)


def test_play_is_never_negative():
    found = tolstat.evaluate("stand", {"joint_clearance_2": -1e-6})
    assert found["status"][0] == "no part left"
