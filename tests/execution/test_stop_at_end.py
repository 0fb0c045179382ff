"""A run that is stopped in its end phase stops at once, and is completed by resume."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

import tolstat
from tolstat.errors import StoppedError
from tolstat.execution import execute as execution
from tolstat.execution import run_loop
from tolstat.execution.workers import block_scheduler
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.store import layout
from tolstat.study.study import load

STUDY = {
    "model": "dimension_chain",
    "trials": 400,
    "seed": 1,
    "settings": {"gap": "A - B"},
    "links": {
        "A": {"nominal": "2 mm", "tolerance": "+-0.1 mm"},
        "B": {"nominal": "1 mm", "tolerance": "+-0.1 mm"},
    },
    "limits": {"gap": "0.9..1.1 mm"},
}


@pytest.fixture
def endless(monkeypatch):
    """Return what makes a function endless, and the event that says that it began."""
    began, end = threading.Event(), threading.Event()

    def replace(place, name):
        def function(*arguments):
            began.set()
            end.wait(60)

        monkeypatch.setattr(place, name, function)
        return began

    yield replace
    end.set()


@pytest.mark.parametrize("name", ["audit", "_diagnostics"])
def test_diagnostics_are_not_awaited(endless, monkeypatch, tmp_path, name):
    began = endless(run_loop, name)
    path = tmp_path / "run.h5"
    start = time.monotonic()
    with Workers(1, began.is_set) as crew:
        run = execution.execute(load(STUDY), path, crew)
    assert time.monotonic() - start < 30  # of the 60 s that the function takes
    assert not run.complete and run.ended == 400
    monkeypatch.undo()
    complete = tolstat.resume(path)
    assert complete.complete and complete.diagnostics.slopes
    again = tolstat.run(STUDY)
    assert repr(complete.diagnostics) == repr(again.diagnostics)


def test_the_last_file_is_not_awaited(monkeypatch, tmp_path):
    path, drafts, stop = tmp_path / "run.h5", [], threading.Event()
    first = layout.draft_of

    def draft_of(run, place):
        drafts.append(run)
        if run.complete:
            stop.set()
        return first(run, place)

    monkeypatch.setattr(layout, "draft_of", draft_of)
    monkeypatch.setattr(block_scheduler, "PATIENCE", -1.0)
    with Workers(1, stop.is_set) as crew:
        run = execution.execute(load(STUDY), path, crew)
    assert len(drafts) == 2 and not run.complete and run.ended == 400
    assert [file.name for file in tmp_path.iterdir()] == ["run.h5"]
    assert tolstat.resume(path).complete


def test_sampling_is_not_awaited(endless, tmp_path):
    began = endless(execution, "SampledStages")
    with (
        Workers(1, began.is_set) as crew,
        pytest.raises(StoppedError, match="before any trial ran"),
    ):
        execution.execute(load(STUDY), tmp_path / "run.h5", crew)
    assert not [*tmp_path.iterdir()]


def test_a_large_file_is_not_written_to_its_end(monkeypatch, tmp_path):
    stop, columns = threading.Event(), []
    write = layout.Rows.write

    def stopping(rows, name, values, first=0):
        columns.append(name)
        stop.set()
        write(rows, name, values, first)

    monkeypatch.setattr(layout.Rows, "write", stopping)
    monkeypatch.setattr(block_scheduler, "PATIENCE", -1.0)
    with Workers(1, stop.is_set) as crew, pytest.raises(StoppedError):
        execution.execute(load(STUDY), tmp_path / "run.h5", crew)
    assert len(columns) == 1 and not [*tmp_path.iterdir()]


def test_a_small_file_is_written_all_the_same(tmp_path):
    """It takes less than the patience, and can be resumed."""
    with Workers(1, lambda: True) as crew:
        run = execution.execute(load(STUDY), tmp_path / "run.h5", crew)
    assert run.ended == 0 and tolstat.resume(run.path).complete


def test_worst_cases_are_searched_in_parts(monkeypatch):
    from tolstat.execution.diagnostics import worst_cases

    ends = np.array([-np.ones(6), np.ones(6)])
    targets = [
        worst_cases.Target(i, sign, np.zeros((1, 6)))
        for i in (0, 1)
        for sign in (1, -1)
    ]
    rows = []

    def respond(deviations):
        rows.append(len(deviations))
        return np.stack([deviations.sum(1), deviations[:, 0]], axis=1)

    groups = [[i] for i in range(6)]
    together = worst_cases.worst_corners(respond, ends, groups, targets)
    most = max(rows)
    monkeypatch.setattr(worst_cases, "AT_ONCE", 1)
    rows.clear()
    alone = worst_cases.worst_corners(respond, ends, groups, targets)
    assert max(rows) == most / 4
    assert [c.value for c in alone] == [c.value for c in together] == [6, -6, 1, -1]
