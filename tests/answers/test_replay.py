"""Replay of a stored trial, bit for bit; differences are detected."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tolstat
from tests.store.tampering import resealed
from tolstat.answers.views.replay import replay
from tolstat.errors import ModelError


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    return tolstat.run(
        "runs/khpt75.toml",
        trials=20,
        output=tmp_path_factory.mktemp("replay") / "run.h5",
    )


@pytest.mark.parametrize("index", [0, 7, 8, 19, None])
def test_a_replay_is_bitwise_equal(stored, index):
    found = replay(stored, index)
    assert found.differences == () and found.reason == ""
    if index is not None:
        for name, value in found.deviations.items():
            assert stored.column(name)[index] == value
    assert found.history is not None


def test_a_difference_of_one_ulp_is_detected(stored, tmp_path):
    path = tmp_path / "tampered.h5"
    path.write_bytes(stored.path.read_bytes())
    with resealed(path) as file:
        file["yaw"][5] = np.nextafter(file["yaw"][5], 1.0)
        file["steps"][6] += 1
        file.attrs["source_digest"] = "0123"
    run = tolstat.open(path)
    assert replay(run, 5).differences == ("yaw",)
    assert "another source (0123" in replay(run, 5).reason
    assert replay(run, 6).differences == ("steps",)
    assert replay(run, 4).differences == ()


def test_a_failed_trial_fails_again(toy, toy_study):
    run = tolstat.run(toy_study, model=toy)
    failed = int(np.flatnonzero(run.status != 1)[0])
    found = replay(run, failed, toy)
    assert found.differences == () and found.history is None
    assert replay(run, None, toy).differences == ()


def test_a_different_failure_status_is_detected(toy, toy_study):
    """Not a number both times, but for another reason."""
    run = tolstat.run(toy_study, model=toy)
    failed = int(np.flatnonzero(run.status != 1)[0])
    with resealed(run.path) as file:
        file["status"][failed] = 3
    assert replay(tolstat.open(run.path), failed, toy).differences == ("status",)


def test_an_unknown_trial_is_refused(stored):
    with pytest.raises(ModelError, match="trials 0 to 19"):
        replay(stored, 20)
    with pytest.raises(ModelError, match="trials 0 to 19"):
        replay(stored, -1)


def test_a_grid_point_is_replayed_with_its_settings(tmp_path):
    study = tmp_path / "grid.toml"
    study.write_text(
        'model = "stand"\nsampling = "grid"\n[settings]\nvariant = "indeterminate"\n'
        '[grid]\ncrank_difference = ["1 mm", "2 mm"]\n'
        'contact_yaw = ["geometry", "fig4"]\ncrank_speed = ["6 rad/s", "7 rad/s"]\n'
    )
    run = tolstat.run(study)
    for index in range(8):
        assert replay(run, index).differences == ()
    assert replay(run, None).differences == ()


def test_a_swept_setting_has_the_name_that_is_typed(tmp_path):
    """A contributor has the same name; both stand in the answer."""
    text = Path("runs/elastic-machine-rule.toml").read_text()
    study = tmp_path / "rule.toml"
    study.write_text(text.replace("points = 192", "points = 3"))
    found = replay(tolstat.run(study), 1)
    assert "start_up_time" in found.settings
    assert "start_up_time" in found.contributors and "settings." not in str(
        found.json()
    )
