"""A run file read by others: plain h5py, pandas, xarray; and files that are no runs."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import h5py
import numpy as np
import pandas as pd
import pytest
import xarray

import tolstat
from tests.conftest import Toy
from tolstat import Contributor
from tolstat.errors import BrokenError, RunFileError
from tolstat.store.files_beside import Lock
from tolstat.store.integrity import FORMAT
from tolstat.store.layout import Rows, extents_of


@pytest.fixture
def run(toy, toy_study):
    return tolstat.run(toy_study, model=toy)


def test_five_lines_of_h5py_and_pandas(run):
    with h5py.File(run.path) as file:
        columns = {
            name: item[...]
            for name, item in file.items()
            if isinstance(item, h5py.Dataset)
        }
        units = file["gap"].attrs["units"]
        meanings = file["status"].attrs["flag_meanings"].split()
    frame = pd.DataFrame(columns).set_index("trial")
    np.testing.assert_array_equal(frame["gap"], run.column("gap"))
    assert units == "m"
    assert [meanings[code] for code in frame["status"][:1]] == ["done"]


def test_xarray_reads_it(run):
    with xarray.open_dataset(run.path, engine="h5netcdf") as data:
        assert data["gap"].dims == ("trial",)
        assert data["gap"].attrs["long_name"] == "sum of the parts"
        np.testing.assert_array_equal(data["part_1"].values, run.column("part_1"))


def test_every_dataset_is_contiguous_and_allocated(run):
    with h5py.File(run.path) as file:
        for item in file.values():
            if isinstance(item, h5py.Dataset):
                assert item.chunks is None
                assert item.id.get_space_status() == h5py.h5d.SPACE_STATUS_ALLOCATED


def test_provenance(run):
    for name in ("numba", "numpy", "scipy", "h5py", "python", "tolstat"):
        assert run.provenance[f"version_{name}"]
    assert len(run.source_digest) == 16
    assert run.provenance["trials_done"] == run.counts["done"]
    assert run.provenance["trials_not_finite"] == run.counts["not finite"]
    assert run.provenance["seconds"] > 0
    assert run.provenance["started_at"] <= run.provenance["ended_at"]
    assert run.provenance["processor"]


def test_it_can_be_read_while_it_is_written(run):
    code = f"import tolstat; print(tolstat.open({str(run.path)!r}).trials)"
    with Lock(run.path), run.path.open("r+b"):
        found = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
    assert found.stdout.strip() == "1000"


def test_an_open_run_is_returned_unchanged(run):
    assert tolstat.open(run) is run


def test_files_that_are_no_runs(tmp_path, run):
    with pytest.raises(RunFileError, match="no such file"):
        tolstat.open(tmp_path / "nothing.h5")
    text = tmp_path / "text.h5"
    text.write_text("hello")
    with pytest.raises(RunFileError, match="cannot be read as HDF5"):
        tolstat.open(text)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = [1]
    with pytest.raises(RunFileError, match="not a run of tolstat"):
        tolstat.open(tmp_path / "other.h5")
    text = run.path.read_bytes()
    ours = f"seal, format {FORMAT}\n".encode()
    assert ours in text
    run.path.write_bytes(text.replace(ours, b"seal, format 99\n", 1))
    with pytest.raises(RunFileError, match="format 99"):
        tolstat.open(run.path)


def test_no_number_lies_across_two_pages(toy, toy_study):
    """A kill tears pages, not numbers."""
    run = tolstat.run(toy_study, model=toy)
    with h5py.File(run.path) as file:
        for extent in extents_of(file).values():
            assert extent.offset % extent.dtype.itemsize == 0


def test_status_comes_after_the_data_are_on_the_disk(toy, toy_study, monkeypatch):
    """Whatever ends the process before the data are safe, the trials have not run."""
    synced = []

    def power_cut(rows):
        if not np.isfinite(rows.read("gap")).any():
            return
        synced.append(rows.read("status"))
        raise OSError("power cut")

    monkeypatch.setattr(Rows, "sync", power_cut)
    with pytest.raises(BrokenError, match="power cut; 0 of 1000 trials are stored"):
        tolstat.run(toy_study, model=toy)
    assert not synced[0].any()
    assert tolstat.open(toy_study.with_suffix(".h5")).counts["not run"] == 1000


@pytest.mark.parametrize("parts", [1200, pytest.param(5000, marks=pytest.mark.long)])
def test_a_study_of_any_size(tmp_path, parts):
    """Its text and what is said of its columns lie before the rows."""

    class Many(Toy):
        def describe(self, settings):
            each = Contributor("", "m", "l", "a length", "sum")
            named = (replace(each, name=f"part_{i}") for i in range(parts))
            return super().describe(settings)._replace(contributors=tuple(named))

    study = tmp_path / "study.toml"
    study.write_text(f'model = "toy"\ntrials = 20\nseed = 1\n#{"x" * 990_000}\n')
    run = tolstat.run(study, model=Many())
    assert run.complete and len(run.study.text) > 990_000
    assert tolstat.extend(run.path, 30, model=Many()).trials == 30
