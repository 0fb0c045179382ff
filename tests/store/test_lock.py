"""The lock of a run file on a disk that fails."""

from __future__ import annotations

import errno
import io
import os

import h5py
import pytest

import tolstat
from tolstat.errors import BrokenError
from tolstat.store import files_beside
from tolstat.store.files_beside import Lock
from tolstat.store.run_writer import TO_THE_END, RunWriter


class Unreadable(io.FileIO):
    """An open file; reading from it fails."""

    def read(self, *_):
        raise OSError(errno.EIO, os.strerror(errno.EIO))


@pytest.fixture
def failing(monkeypatch):
    opened = files_beside.opened_for_writing

    def open_again(path):
        with opened(path) as file:
            return Unreadable(os.dup(file.fileno()), "r+b")

    monkeypatch.setattr(files_beside, "opened_for_writing", open_again)


def test_a_new_lock_is_not_read_and_none_is_left(failing, tmp_path):
    with Lock(tmp_path / "run.h5"):
        words = (tmp_path / "run.h5.lock").read_text()
        assert words.startswith(f"process {os.getpid()} on ")
    assert [*tmp_path.iterdir()] == []


def test_a_lock_that_cannot_be_read_is_named_and_kept(failing, tmp_path):
    """It may be the file of somebody else."""
    lock = tmp_path / "run.h5.lock"
    lock.write_text("process 1 on another computer since yesterday")
    with pytest.raises(BrokenError, match=r"run\.h5 cannot be written: .*Input/output"):
        Lock(tmp_path / "run.h5")
    assert lock.exists()


def test_a_run_that_cannot_be_opened_again_is_a_sentence(toy, tmp_path, monkeypatch):
    """It was just read whole, and then the disk fails."""
    study = {"model": "toy", "trials": 9, "seed": 1, "deviations": {"part": "+-1 mm"}}
    run = tolstat.run(study, model=toy, output=tmp_path / "run.h5")

    def fail(*_, **__):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with Lock(run.path) as lock:
        monkeypatch.setattr(h5py, "File", fail)
        with pytest.raises(BrokenError, match="cannot be written"):
            RunWriter.opened(lock, run, run.columns["status"], by=TO_THE_END)
