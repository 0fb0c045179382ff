"""Runs in memory: the same run as one in a file, and what needs a file."""

from __future__ import annotations

import json
from dataclasses import fields, replace

import numpy as np
import pytest

import tolstat
from tests.conftest import Toy
from tolstat.errors import ModelError, RunFileError
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.store.run_records import Plan
from tolstat.store.stored_run import IN_MEMORY, Run
from tolstat.study.study import load

STUDY = {
    "model": "toy", "trials": 300, "seed": 1, "deviations": {"part": "+-1 mm"},
    "limits": {"gap": "<= 2 mm"},
}  # fmt: skip
RARE = {
    "model": "toy", "sampling": "rare", "trials": 5000, "seed": 1,
    "deviations": {"part": "+-0.5 mm"}, "limits": {"gap": "<= 3.5 mm"},
}  # fmt: skip
GRID = {
    "model": "toy", "sampling": "grid",
    "grid": {
        "mode": ["plain", "odd"], "deviations": {
            "part_1": {"from": "0 mm", "to": "0.5 mm", "points": 5},
        },
    },
}  # fmt: skip


@pytest.mark.parametrize("study", [STUDY, RARE, GRID])
def test_a_run_in_memory_is_the_run_of_a_file(study, toy, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = tolstat.run(study, model=toy)
    assert run.path == IN_MEMORY and list(tmp_path.iterdir()) == []
    file = tolstat.run(study, model=toy, output="run.h5")
    assert run.complete and run.frame().equals(file.frame())
    same = {f.name for f in fields(Run)} - {"path", "made", "times", "columns"}
    for name in (*same, "nominal_values", "scales", "counts"):
        assert repr(getattr(run, name)) == repr(getattr(file, name)), name
    for name in (*run.input_names, "gap", "status"):
        assert run.column(name).dtype == file.column(name).dtype
        assert run.column(name).flags["C_CONTIGUOUS"]


def test_answers_are_those_of_a_file(toy, tmp_path):
    run = tolstat.run(STUDY, model=toy)
    file = tolstat.run(STUDY, model=toy, output=tmp_path / "run.h5")
    ours, stored = (json.loads(tolstat.report(x).json()) for x in (run, file))
    assert ours["responses"] == stored["responses"]
    assert "run in memory" in tolstat.report(run).html()
    found = tolstat.summary(run)
    commands = [f"{x}" for step in found.findings.steps for x in step.commands]
    assert commands and all("run.h5" in command for command in commands[::2])
    assert not any("memory" in command for command in commands)
    assert any("tolstat.save" in note for note in found.trials.notes)
    change = {"part_1": "+-0.5 mm"}
    ours, stored = (tolstat.what_if(x, change, model=toy) for x in (run, file))
    assert ours.responses == stored.responses
    assert tolstat.replay(run, 7, model=toy).differences == ()


def test_a_run_in_memory_is_saved_and_then_extended(toy, tmp_path):
    run, path = tolstat.run(STUDY, model=toy), tmp_path / "saved.h5"
    saved = tolstat.save(run, path)
    assert saved.path == path and tolstat.verify(saved, every=True, model=toy).whole
    stored = tolstat.open(path)
    assert stored.frame().equals(run.frame()) and stored.complete
    assert stored.provenance["seconds"] >= run.provenance["seconds"]
    whole = tolstat.run({**STUDY, "trials": 500}, model=toy)
    assert tolstat.extend(saved, 500, model=toy).frame().equals(whole.frame())
    with pytest.raises(RunFileError, match="exists already"):
        tolstat.save(run, path)
    assert tolstat.save(run, path, force=True).trials == 300
    assert [each.name for each in tmp_path.iterdir()] == ["saved.h5"]
    with pytest.raises(RunFileError, match=r"saved\.h5 is a file already; copy it"):
        tolstat.save(saved, tmp_path / "again.h5")


def test_a_run_in_memory_that_stopped_is_saved_and_resumed(toy, tmp_path):
    seen = []
    with Workers(1, lambda: bool(seen), block=50) as crew:
        part = execute(load(STUDY, model=toy), None, crew, progress=seen.append)
    assert 0 < part.ended < 300 and not part.complete
    saved = tolstat.save(part, tmp_path / "part.h5")
    assert tolstat.open(saved.path).ended == part.ended
    whole = tolstat.run(STUDY, model=toy)
    assert tolstat.resume(saved, model=toy).frame().equals(whole.frame())


def test_what_needs_a_file_says_so(toy, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = tolstat.run(STUDY, model=toy)
    for source in (run, run.path):
        with pytest.raises(RunFileError, match=r"in memory has no file.*tolstat\.save"):
            tolstat.extend(source, 500, model=toy)
    for refused in (tolstat.resume, tolstat.verify):
        with pytest.raises(RunFileError, match="in memory has no file"):
            refused(run, model=toy)
    assert list(tmp_path.iterdir()) == []


def test_a_model_that_fails_leaves_no_run():
    class Failing(Toy):
        def evaluate(self, deviations, settings):
            raise ZeroDivisionError("broken")

    with pytest.raises(ModelError, match="broken"):
        tolstat.run(STUDY, model=Failing())


def test_a_plan_is_data_and_part_of_a_run(toy, tmp_path):
    run = tolstat.run(STUDY, model=toy)
    file = tolstat.run(STUDY, model=toy, output=tmp_path / "run.h5")
    assert type(run.plan) is Plan and not hasattr(run.plan, "columns")
    made = run.plan.made
    assert run.plan == replace(file.plan, made=made)
    other = tolstat.run({**STUDY, "limits": {"gap": "<= 1 mm"}}, model=toy).plan
    assert replace(other, made=made) != run.plan
    assert np.all(run.status[:1] == 1)
