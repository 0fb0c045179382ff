"""The Python interface: names, shapes, refusals, a custom model."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import tolstat
from tolstat.errors import ModelError


def test_names_without_number_and_missing_ones(toy):
    frame = tolstat.evaluate(toy, {"part": [1e-4, 2e-4]}, {"gain": 3})
    np.testing.assert_allclose(frame["gap"], [6e-4, 12e-4])
    assert list(frame.columns) == ["gap", "ratio", "status"]
    assert list(frame["status"]) == ["done", "done"]
    assert frame.attrs["units"] == {"gap": "m", "ratio": "1"}
    assert tolstat.evaluate(toy).shape == (1, 3)


def test_a_frame_keeps_its_index(toy):
    deviations = pd.DataFrame({"part_1": [1e-4, 1e-3]}, index=["good", "bad"])
    frame = tolstat.evaluate(toy, deviations)
    assert list(frame.index) == ["good", "bad"]
    assert frame.loc["bad", "status"] == "not finite"
    assert np.isnan(frame.loc["bad", "gap"])


@pytest.mark.parametrize(
    ("deviations", "settings", "words"),
    [
        ({"prat": 1.0}, {}, "did you mean 'part"),
        ({"part": 0.0, "part_1": 1.0}, {}, "twice"),
        (
            {"part_1": [1.0, 2.0], "part_2": [1.0, 2.0, 3.0]},
            {},
            "different lengths: 2, 3",
        ),
        ({"part": [1.0, np.nan]}, {}, "finite"),
        ({"part": "long"}, {}, "part"),
        ({"part": np.zeros((2, 2))}, {}, "give a list of finite numbers"),
        ({}, {"gian": 1.0}, "did you mean 'gain'"),
        ({}, {"gain": 0.0}, "above 0"),
        ({}, {"gain": float("inf")}, "finite"),
        ({}, {"gain": True}, "a number is expected"),
        ({}, {"mode": "even"}, "allowed: plain, odd"),
    ],
)
def test_refusals(toy, deviations, settings, words):
    with pytest.raises(ModelError, match=words):
        tolstat.evaluate(toy, deviations, settings)


def test_models():
    assert "stand" in tolstat.models()
    with pytest.raises(ModelError, match="did you mean 'stand'"):
        tolstat.evaluate("stend")


def test_the_name_of_a_family_is_exact():
    """Runout is runout_7 ... and not runout_phase_7."""
    frame = tolstat.evaluate("stand", {"runout": 5e-5, "runout_phase_7": 1.0})
    single = {f"runout_{i}": 5e-5 for i in (7, 8, 10, 11)}
    same = tolstat.evaluate("stand", {**single, "runout_phase_7": 1.0})
    pd.testing.assert_frame_equal(frame, same)
