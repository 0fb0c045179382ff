"""Assumptions and integration error in a run file."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

import tolstat


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("audit")
    study = folder / "study.toml"
    study.write_text(
        'model = "stand"\ntrials = 250\nseed = 3\n[deviations]\n'
        'rod_length = { tolerance = "+-1.2 mm", common = true }\n'
        'friction = { tolerance = "-20..+40 %", distribution = "triangular" }\n'
        'crank_radius_1 = { distribution = "constant", value = "0.1 mm" }\n'
    )
    return tolstat.run(study)


def test_audit_and_assumptions_in_plain_h5py(run):
    with h5py.File(run.path) as file:
        audit = file["audit"]
        trials = audit["trials"][:]
        assert audit["settings"].attrs["rtol"] == pytest.approx(1e-6)
        at_random = trials[audit["at_random"][:] == 1]
        assert list(at_random // 100) == [0, 1, 2]
        largest = np.argmax(file["rod_force_1"][:])
        by_force = audit["chosen_by/rod_force_1"]
        assert by_force[:][trials == largest] == by_force.attrs["flag_masks"][2]
        assert by_force.attrs["flag_meanings"].split()[2] == "spread"
        assert (audit["status"][:] == 1).all()
        difference = audit["responses/rod_force_1"][:] - file["rod_force_1"][:][trials]
        assert 0 < np.abs(difference).max() < 1e-2 * 1e5
        assert audit["responses/rod_force_1"].attrs["units"] == "N"
        rods = file["rod_length_1"].attrs
        np.testing.assert_allclose(rods["assumed_tolerance"], (-1.2e-3, 1.2e-3))
        assert rods["assumed_words"] == "normal, +-1.2 mm, cp 1, all parts alike"
        assert rods["assumed_batch"] == "rod_length" and rods["part"] == "rods"
        assert file["friction"].attrs["assumed_words"] == "triangular, -20..+40 %"
        assert "part" not in file["friction"].attrs
        assert "assumed_tolerance" not in file["crank_angle_1"].attrs


def test_audit_and_assumptions_of_a_run(run):
    assert (
        run.audited.settings == pytest.approx({"rtol": 1e-6, "max_step": 2.5e-4})
        and np.count_nonzero(run.audited.at_random) == 3
    )
    assert set(run.audited.responses) == {each.name for each in run.responses}
    assert run.assumed["rod_length_2"].batch == "rod_length"
    assert set(run.assumed) == {
        "rod_length_1", "rod_length_2", "friction", "crank_radius_1",
    }  # fmt: skip
    parts = {each.name: each.part for each in run.contributors}
    assert parts["runout_phase_7"] == "gears" and parts["guide_clearance"] == ""


def test_a_run_that_was_stopped_has_no_audit_yet(tmp_path):
    from tolstat.execution.execute import execute
    from tolstat.execution.workers.block_scheduler import Workers
    from tolstat.study.study import load

    asked = load("runs/khpt75.toml", trials=300)
    with Workers(stopping=lambda: True) as crew:
        run = execute(asked, tmp_path / "stopped.h5", crew)
    assert run.audited is None and run.counts["not run"] == 300
    assert run.diagnostics.missing == "the run did not come to its end"
