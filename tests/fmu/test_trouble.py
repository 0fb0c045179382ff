"""FMUs that crash, hang, print, end early or forget: each costs its trial alone."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import tolstat

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
LIMITED = ("hang", "sleep", "mixed")  # that need a limit


def study(kind, trials=80, above=2.0, **more):
    return {
        "model": "Trouble",
        "trials": trials,
        "seed": 1,
        **({"longest_trial": "1 s"} if kind in LIMITED else {}),
        "settings": {"how": kind, "above": above, **more},
        "deviations": {"x": "+-3"},
        "limits": {"y": "<= 20"},
    }


def closed_form(x):
    return (2 * x + 1) * (1 - math.exp(-1.0))


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_costs_its_trials_alone(model, tmp_path, kind, capfd):
    model("Trouble")
    run = tolstat.run(study(kind), output=tmp_path / "run.h5", workers=2)
    frame = run.frame()
    guilty = frame["x"] > 2.0
    assert 0 < guilty.sum() < 10
    assert (frame["status"][guilty] == KINDS[kind]).all()
    assert (frame["status"][~guilty] == "done").all()
    right = frame["status"] == "done"
    y = closed_form(frame["x"][right])
    assert frame["y"][right].to_numpy() == pytest.approx(y.to_numpy(), rel=1e-9)
    assert frame["y"][~right].isna().all()
    assert "noise" not in capfd.readouterr().out


@pytest.mark.parametrize("fmi", [2, 3])
def test_crashes_hangs_and_a_leak_together_twice_with_the_same_bits(
    built, tmp_path, fmi
):
    """A small version of tests.studies.fmus.trouble."""
    source = str(built("Trouble", fmi))
    frames = []
    for name, workers in (("a", 2), ("b", 1)):
        tolstat.catalogue.load(source)
        done = tolstat.run(
            study("mixed", 400), output=tmp_path / f"{name}.h5", workers=workers
        )
        assert done.complete
        frames.append(done.frame())
    first, second = frames
    x = first["x"].to_numpy()
    expected = np.where(x > 4.0, "took too long", np.where(x > 2.0, "crashed", "done"))
    assert first["status"].tolist() == expected.tolist()
    assert first.equals(second)


def test_the_reason_is_stored(model, tmp_path):
    model("Trouble")
    run = tolstat.run(study("error"), output=tmp_path / "run.h5")
    guilty = int(np.flatnonzero(run.frame()["status"] == "FMU error")[0])
    assert "the step failed" in run.isolation.output[guilty]


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu_that_forgets_to_reset_has_new_instances(model, tmp_path, fmi):
    clean, forgetful = (
        tolstat.run(
            {
                "model": name, "trials": 16, "seed": 1,
                "settings": {"max_step": "0.1 s"},
                "deviations": {"F": "+-6 N"},
            },
            model=model(name, fmi), output=tmp_path / f"{name}.h5", workers=1,
        )
        for name in ("Backlash", "ForgetfulBacklash")
    )  # fmt: skip
    assert clean.frame()["peak"].tolist() == forgetful.frame()["peak"].tolist()
    assert not any("forgets" in note for note in clean.notes)
    assert any("forgets to reset" in note for note in forgetful.notes)


def test_the_library_is_never_in_this_process(model, tmp_path):
    model("Backlash")
    tolstat.evaluate("Backlash", {"F": [0.0, 1.0]})
    tolstat.trajectory("Backlash")
    assert "Backlash.so" not in Path("/proc/self/maps").read_text()
