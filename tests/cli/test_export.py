"""Tables for other programs, following a run, and `tolstat doctor`."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import time
from threading import Thread

import numpy as np
import openpyxl
import pandas as pd
import pyarrow
import pytest

import tolstat
from tests.cli.command_line import TOLSTAT, call, chain
from tests.conftest import Toy
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.store.files_beside import Lock
from tolstat.study.study import load

GRID = """\
model = "toy"
sampling = "grid"
[grid]
part_1 = ["0.1 mm", "1 mm"]
mode = ["plain", "odd"]
"""


class Formula(Toy):
    """A machine whose words a spreadsheet would calculate."""

    failures = {"=1+1": "2"}

    def evaluate(self, deviations, settings):
        found = super().evaluate(deviations, settings)
        bad = deviations[:, 0] > 0.9e-3
        return found._replace(status=None, failed={"=1+1": bad})


@pytest.fixture
def grid(tmp_path):
    study = tmp_path / "grid.toml"
    study.write_text(GRID)
    return tolstat.run(study, model=Formula())


def test_a_table_holds_every_bit_and_no_formula(grid, tmp_path):
    path = tmp_path / "table.csv"
    done = call("export", grid.path, "-o", path)
    assert done.exit_code == 0 and "4 trials" in done.output
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        "trial", "mode", "part_1 [m]", "part_2 [m]", "angle [rad]", "gap [m]", "ratio",
        "status",
    ]  # fmt: skip
    shown = [(row["mode"], row["status"]) for row in rows]
    assert sorted(shown) == [
        ("odd", "'=1+1"), ("odd", "done"), ("plain", "'=1+1"), ("plain", "done"),
    ]  # fmt: skip
    for head, name in (("part_1 [m]", "part_1"), ("gap [m]", "gap")):
        told = np.array([float(row[head] or "nan") for row in rows])
        np.testing.assert_array_equal(told, grid.column(name))
    assert all((row["gap [m]"] == "") == (row["status"] != "done") for row in rows)


def test_parquet_holds_the_same(grid, tmp_path):
    path = tmp_path / "table.parquet"
    assert call("export", grid.path, "-o", path).exit_code == 0
    found = pd.read_parquet(path)
    np.testing.assert_array_equal(found["gap [m]"], grid.column("gap"))
    assert list(found["status"]) == list(grid.frame()["status"])
    assert found.index.name == "trial"


def test_a_table_replaces_no_file_without_a_flag(grid, tmp_path):
    path = tmp_path / "rods.csv"
    path.write_text("my own\n")
    refused = call("export", grid.path, "-o", path)
    assert refused.exit_code == 2 and "--force" in refused.stderr
    assert path.read_text() == "my own\n"
    assert call("export", grid.path, "-o", path, "--force").exit_code == 0
    assert path.read_text().startswith("trial,")
    for other in ("table.xls", "grid.h5", "nowhere/table.csv"):
        assert call("export", grid.path, "-o", tmp_path / other).exit_code == 2
    assert call("export", grid.path).exit_code == 2
    assert sorted(each.suffix for each in tmp_path.iterdir()) == [
        ".csv",
        ".h5",
        ".toml",
    ]


def test_a_missing_pyarrow_is_a_message(grid, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert pyarrow
    refused = call("export", grid.path, "-o", tmp_path / "table.parquet")
    assert refused.exit_code == 2 and "tolstat[parquet]" in refused.stderr


def test_a_full_disk_leaves_no_file(grid, tmp_path):
    study = chain(tmp_path, "many", trials=20000)
    run = tolstat.run(study)
    path = tmp_path / "table.csv"
    command = f"ulimit -f 100; '{TOLSTAT}' export '{run.path}' -o '{path}'"
    found = subprocess.run(
        ["bash", "-c", command], capture_output=True, text=True, check=False
    )
    assert found.returncode == 1 and "cannot be written" in found.stderr, found
    assert "Traceback" not in found.stderr
    assert not list(tmp_path.glob("table*"))


def test_a_run_is_followed_until_it_ends(tmp_path):
    study = load(chain(tmp_path, "study"))
    path, seen = tmp_path / "study.h5", []

    def write():
        with Workers(1, block=50) as crew:
            execute(study, path, crew, progress=lambda progress: time.sleep(0.1))

    writer = Thread(target=write)
    writer.start()
    while not path.exists():
        time.sleep(0.01)
    seen.append(tolstat.open(path).ended)
    followed = call("show", path, "--follow")
    writer.join()
    assert followed.exit_code == 0 and seen[0] < 1000
    assert "1000 trials" in followed.stdout and "have not run" not in followed.stdout
    assert "no process writes" not in followed.stderr
    # into a pipe a line for each change, and no other
    lines = followed.stderr.splitlines()
    assert len(lines) == len(set(lines)) > 1
    assert lines[-1] == f"{path}: 1000 of 1000 trials, 0 failed"


def test_following_a_run_without_writer_ends(tmp_path):
    study = chain(tmp_path, "study")
    path, looked = study.with_suffix(".h5"), []
    with Workers(1, lambda: len(looked) > 20 or looked.append(0), block=50) as crew:
        execute(load(study), path, crew)
    killed = subprocess.Popen([sys.executable, "-c", ""])
    killed.wait()
    left = path.with_name(path.name + ".lock")
    for words in (None, f"process {killed.pid} on {os.uname().nodename} since then"):
        if words:
            left.write_text(words)  # as a kill leaves it
        followed = call("show", path, "--follow")
        assert followed.exit_code == 0
        assert f"tolstat resume {path}" in followed.stderr
    with Lock(path):  # who looks keeps no writer waiting
        assert call("show", path).exit_code == 0
    assert call("show", path, path, "--follow").exit_code == 2


def test_doctor(monkeypatch):
    monkeypatch.setattr("tolstat.execution.self_check.LASTING", 0.1)
    found = call("doctor")
    assert found.exit_code == 0, found.output
    for word in ("numba", "processor", "cores", "compiled code", "trials/s", "pyarrow"):
        assert word in found.stdout
    assert "the same responses" in found.stdout


def test_doctor_finds_answers_that_differ(monkeypatch):
    monkeypatch.setattr("tolstat.execution.self_check.LASTING", 0.1)
    plain, calls = Workers.simulate, []

    def one_bit_off(self, *arguments):
        found = plain(self, *arguments)
        calls.append(found)
        if len(calls) > 2:
            found.responses.view(np.uint64)[0, 0] ^= 1
        return found

    monkeypatch.setattr(Workers, "simulate", one_bit_off)
    found = call("doctor")
    assert found.exit_code == 1 and "different responses" in found.stdout


def test_a_grid_with_settings_in_words_is_a_workbook(grid, tmp_path):
    path = tmp_path / "grid.xlsx"
    assert call("export", grid.path, "-o", path).exit_code == 0
    sheet = openpyxl.load_workbook(path)["trials"]
    assert sheet.max_row == 1 + grid.trials
