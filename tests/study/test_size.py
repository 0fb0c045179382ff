"""Memory of studies, and the part of a file that is read."""

from __future__ import annotations

import resource
import subprocess
import sys

import pytest

import tolstat
from tests.conftest import Toy
from tolstat.errors import DataError, StudyError
from tolstat.model.checked import described
from tolstat.study import data_files
from tolstat.study import memory_needed as size
from tolstat.study.data_files import read_data
from tolstat.study.files import content
from tolstat.study.study import load
from tolstat.study.study_schema import FileEntry

TOY = described(Toy(), None)  # 3 contributors, 2 responses: 96 bytes a trial


def test_studies_that_fit_the_memory(monkeypatch):
    monkeypatch.setattr(size, "memory", lambda: 96e6)
    assert size.too_large(1_000_000, TOY) == "" != size.too_large(1_000_001, TOY)
    assert size.large(250_000, TOY) == "" != size.large(250_001, TOY)
    said = size.too_large(2 * 10**8, TOY)
    assert (
        "200000000 trials take about 19.2 GB of memory and, at 1000 a second," in said
    )
    assert "2.31 days" in said and "may have 0.096 GB" in said
    assert "give at most about 1000000" in said


def test_large_studies_have_a_warning_or_are_refused(monkeypatch):
    monkeypatch.setattr(size, "memory", lambda: 96e3)
    study = {"model": "toy", "trials": 500, "seed": 1, "deviations": {"part": "+-1 mm"}}
    (warning,) = load(study, model=Toy()).warnings
    assert warning.startswith("500 trials take about 4.8e-05 GB of memory")
    with pytest.raises(StudyError, match="trials = 1001: 1001 trials take about"):
        tolstat.run(study, trials=1001, model=Toy(), output="never.h5")
    with pytest.raises(StudyError, match=r"seed = 18446744073709551616: .* from 0 to"):
        tolstat.run(study, seed=2**64, model=Toy(), output="never.h5")


def test_a_limit_of_the_process_counts():
    code = "from tolstat.operating_system import memory; print(memory())"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (2 * 10**9,) * 2),
    )  # fmt: skip
    assert float(done.stdout) <= 2e9


def test_files_are_read_up_to_the_largest_size(tmp_path, monkeypatch):
    path = tmp_path / "long.csv"
    path.write_bytes(b"1" * 1_000_001)
    with pytest.raises(DataError, match=r"long\.csv is larger than 1 MB"):
        content(path, 1)
    monkeypatch.setattr(data_files, "MOST_MEGABYTES", 1)
    with pytest.raises(DataError, match="larger than 1 MB"):
        read_data(tmp_path, FileEntry(data="long.csv"))
    path.write_bytes(b"\xef\xbb\xbfa [mm]\r\n1\r\n")
    assert read_data(tmp_path, FileEntry(data="long.csv")).column("a") == [1.0]
    below = tmp_path / "parts"
    below.mkdir()
    path.rename(below / "short.csv")
    assert [*read_data(tmp_path, FileEntry(data="parts/short.csv")).units] == ["a"]
    assert read_data(None, FileEntry(data=str(below / "short.csv"))).units == {
        "a": "mm"
    }
    with pytest.raises(DataError, match="outside the folder"):
        read_data(tmp_path / "parts", FileEntry(data=str(tmp_path / "other.csv")))
    with pytest.raises(DataError, match=r"no such file; did you mean 'short\.csv'"):
        read_data(below, FileEntry(data="shrt.csv"))
