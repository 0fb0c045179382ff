"""A run in Python: its description, and runs without a file."""

from __future__ import annotations

import gc
import tracemalloc

import pytest

import tolstat
from tolstat.errors import RunFileError, StudyError

STUDY = {
    "title": "toy <1>", "model": "toy", "trials": 300, "seed": 1,
    "deviations": {"part": "+-1 mm"}, "limits": {"gap": "<= 2 mm"},
}  # fmt: skip


@pytest.fixture
def run(toy, tmp_path):
    return tolstat.run(STUDY, model=toy, output=tmp_path / "toy.h5")


def test_a_line_in_a_console_and_a_table_in_a_notebook(run):
    failed = run.counts["not finite"]
    assert repr(run) == (
        f"<tolstat run {str(run.path)!r}: 'toy <1>', 300 of 300 trials of toy, "
        f"{failed} failed>"
    )
    shown = run._repr_html_()
    assert (
        "toy &lt;1&gt;" in shown and shown.count("<tr") == 6 + 1
    )  # heads, index, five


def test_a_study_in_python_equals_its_study_file(toy, run, tmp_path):
    path = tmp_path / "again.toml"
    path.write_text(run.study.text)
    assert tolstat.run(path, model=toy).frame().equals(run.frame())
    assert run.study.table == STUDY
    with pytest.raises(StudyError, match="the study has a value that is not TOML"):
        tolstat.run({**STUDY, "seed": object()}, model=toy, output=run.path)
    with pytest.raises(RunFileError, match="replaced only by force"):
        tolstat.run(STUDY, model=toy, output=run.path)


def test_progress_is_reported(toy, tmp_path):
    seen = []
    run = tolstat.run(STUDY, model=toy, output=tmp_path / "p.h5", progress=seen.append)
    trials = [each for each in seen if each.doing == "trials"]
    assert [each.doing for each in seen[-2:]] == ["audit", "diagnostics"]
    assert trials[-1].over == trials[-1].asked == 300
    assert trials[-1].failed == run.counts["not finite"]
    assert sorted(each.over for each in trials) == [each.over for each in trials]


def test_version_and_names():
    assert tolstat.__version__.count(".") == 2
    for name in tolstat.__all__:
        assert getattr(tolstat, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'runs'"):
        _ = tolstat.runs


def test_reading_runs_keeps_no_memory(toy, toy_study):
    path = tolstat.run(toy_study, model=toy).path
    kept = []
    tracemalloc.start()
    try:
        for _ in range(2):
            for _ in range(20):
                tolstat.open(path)
            gc.collect()
            kept.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert kept[1] - kept[0] < 20_000  # one run has 70 000 bytes


def test_units_of_a_table_are_a_copy(run):
    """Who converts a column notes its unit in the table."""
    for table in (run.frame(), run.nominal):
        table.attrs["units"]["gap"] = "um"
    assert run.units["gap"] == run.frame().attrs["units"]["gap"] == "m"
