"""Studies of FMUs: from `tolstat new` to a report."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.conftest import ROOT
from tolstat import catalogue
from tolstat.errors import StudyError


def test_a_new_study_runs(model, tmp_path):
    loaded = model("Backlash")
    text = tolstat.new_study(loaded)
    assert 'peak = "end peak"' in text
    assert "# tolstat run STUDY.toml --machine " in text
    path = tmp_path / "drive.toml"
    path.write_text(text.replace("# gap", "gap").replace("4096", "16"))
    run = tolstat.run(path)
    assert (run.frame()["status"] == "done").all()
    again = tolstat.replay(run, 3)
    assert again.differences == ()
    assert "peak" in {curve.name for curve in again.history.curves}
    assert tolstat.report(run).responses


def test_the_study_of_the_gallery(model, tmp_path):
    model("Backlash")
    run = tolstat.run(
        ROOT / "runs" / "fmu" / "drive.toml", trials=8, output=tmp_path / "drive.h5"
    )
    assert {*run.frame()} >= {"force", "travel", "swing", "gap", "m1", "k"}
    assert (run.frame()["swing"] > 0.1).all()


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ({"settings": {"gap": "3 mm"}}, "at most 1 mm"),
        ({"settings": {"material": "wood"}}, "allowed: steel, nylon"),
        ({"settings": {"teeth": 23.5}}, "whole number"),
        ({"settings": {"F": "12 mm"}}, "another kind"),
        ({"responses": {"x": "max speed"}}, "no variable speed"),
        ({"responses": {"x": "largest peak"}}, "allowed: end, max"),
        ({"responses": {"x": "time peak above 3 mm"}}, "another kind"),
        ({"responses": {"gap": "max peak"}}, "gap is given twice"),
        ({"deviations": {"gap": "+-1 N"}}, "another kind"),
        ({"deviations": {"mass": "+-1 kg"}}, "mass"),
    ],
)
def test_wrong_studies_are_refused(model, section, words):
    model("Backlash")
    study = {"model": "Backlash", "trials": 10, "seed": 1, **section}
    with pytest.raises(StudyError, match=words):
        tolstat.run(study)


def test_trials_outside_min_and_max_are_not_run(model):
    model("Backlash")
    study = {
        "model": "Backlash", "trials": 200, "seed": 1,
        "settings": {"gap": "0.9 mm", "max_step": "0.5 s"},
        "deviations": {"gap": "+-0.2 mm"},
    }  # fmt: skip
    frame = tolstat.run(study).frame()
    outside = frame["gap"] > 1e-4
    assert 0 < outside.sum() < 100
    assert (frame["status"] == "outside its range").tolist() == outside.tolist()


def test_an_audit_by_model_exchange_finds_a_wrong_co_simulation(reference):
    """Inside, Dahlquist takes Euler steps of 0.1 s, whatever its caller's step is."""
    loaded = catalogue.load(str(reference("Dahlquist")))
    study = {
        "model": loaded.name, "trials": 100, "seed": 1,
        "settings": {"max_step": "0.1 s"},
        "deviations": {"k": "+-0.01"},
        "limits": {"x": "<= 4e-5"},  # right are 4.54e-5, co-simulation has 2.66e-5
    }  # fmt: skip
    run = tolstat.run(study)
    assert run.audited.settings["model_exchange"] == 1.0
    errors = run.audited.responses["x"] - run.column("x")[run.audited.trials]
    assert errors == pytest.approx(np.exp(-10) - 0.9**100, rel=0.1)
    assert "undecided" in tolstat.report(run).verdicts["x"]


def test_another_fmu_does_not_continue_a_run(model, built, tmp_path):
    model("Backlash")
    path = tmp_path / "run.h5"
    study = tmp_path / "s.toml"
    study.write_text(
        'model = "Backlash"\ntrials = 8\nseed = 1\ndeviations.F = "+-1 N"\n'
    )
    run = tolstat.run(study, output=path)
    other = catalogue.load(str(built("Backlash", 3)))
    with pytest.raises(tolstat.errors.TolstatError, match="source"):
        tolstat.extend(run, trials=16, model=other)
