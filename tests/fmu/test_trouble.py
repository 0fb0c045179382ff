"""FMUs that crash, hang, print, end early or forget: each costs its trial alone."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import tolstat
from tolstat import catalogue

KINDS = {  # how trials end that misbehave
    "crash": "crashed",
    "hang": "took too long",
    "leak": "done",
    "print": "done",
    "exit": "crashed",
    "abort": "crashed",
    "end_early": "ended early",
    "error": "FMU error",
    "nan": "not finite",
    "stack": "crashed",
    "discard": "step refused",
    "sleep": "took too long",
    "fatal": "crashed",
}
LIMITED = ("hang", "sleep")  # that need a limit
# two of them misbehave; the others come before, between and after
ROWS = np.array([0.0, -1.5, 2.5, 1.0, 1.9, -0.3, 3.0, 0.4])


def study(kind, trials, above, **more):
    return {
        "model": "Trouble",
        "trials": trials,
        "seed": 1,
        "longest_trial": "1 s",
        "settings": {"how": kind, "above": above, **more},
        "deviations": {"x": "+-3"},
        "limits": {"y": "<= 20"},
    }


def closed_form(x):
    return (2 * x + 1) * (1 - math.exp(-1.0))


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_costs_its_trials_alone(model, kind, capfd):
    loaded = catalogue.isolated(model("Trouble"), 1.0 if kind in LIMITED else 0.0)
    frame = tolstat.evaluate(loaded, {"x": ROWS}, {"how": kind, "above": 2.0})
    expected = np.where(ROWS > 2.0, KINDS[kind], "done")
    assert frame["status"].tolist() == expected.tolist()
    y = np.where(expected == "done", closed_form(ROWS), np.nan)
    assert frame["y"].to_numpy() == pytest.approx(y, rel=1e-9, nan_ok=True)
    assert "noise" not in capfd.readouterr().out


def test_crashes_hangs_and_a_leak_together_twice_with_the_same_bits(built, tmp_path):
    """A small version of tests.studies.fmus.trouble, of both versions of FMI."""
    frames = []
    for fmi, workers in ((2, 2), (2, 1), (3, 2)):
        tolstat.catalogue.load(str(built("Trouble", fmi)))
        # no worst case, which would hang, too
        mixed = {**study("mixed", 60, 1.5, hang=2.4), "limits": {}}
        path = tmp_path / f"{len(frames)}.h5"
        done = tolstat.run(mixed, output=path, workers=workers)
        assert done.complete
        frames.append(done.frame())
    first, second, third = frames
    x = first["x"].to_numpy()
    expected = np.where(x > 2.4, "took too long", np.where(x > 1.5, "crashed", "done"))
    assert {*expected} == {"done", "crashed", "took too long"}
    assert first["status"].tolist() == expected.tolist()
    assert first.equals(second)
    assert first.equals(third)


def test_the_reason_is_stored(model, tmp_path):
    model("Trouble")
    run = tolstat.run(study("error", 12, 1.0), output=tmp_path / "run.h5")
    guilty = int(np.flatnonzero(run.frame()["status"] == "FMU error")[0])
    assert "the step failed" in run.isolation.output[guilty]


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu_that_forgets_to_reset_has_new_instances(model, fmi):
    forces = {"F": np.linspace(6.0, -6.0, 12)}
    peaks = []
    for name in ("Backlash", "ForgetfulBacklash"):
        loaded = catalogue.find(model(name, fmi))
        frame = tolstat.evaluate(loaded, forces, {"max_step": 0.1})
        peaks.append(frame["peak"].tolist())
        forgets = any("forgets to reset" in note for note in loaded.notes())
        assert forgets == (name == "ForgetfulBacklash")
    assert peaks[0] == peaks[1]


def test_a_run_says_that_an_fmu_forgets(model):
    short = {"stop": "0.1 s", "max_step": "0.1 s"}
    asked = {"trials": 10, "seed": 1, "settings": short, "deviations": {"F": "+-6 N"}}
    run = tolstat.run({"model": "ForgetfulBacklash", **asked},
                      model=model("ForgetfulBacklash"))  # fmt: skip
    assert any("forgets to reset" in note for note in run.notes)


def test_the_library_is_never_in_this_process(model, tmp_path):
    model("Backlash")
    tolstat.evaluate("Backlash", {"F": [0.0, 1.0]})
    tolstat.trajectory("Backlash")
    assert "Backlash.so" not in Path("/proc/self/maps").read_text()
