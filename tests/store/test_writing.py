"""Failures while a run is written: stored data are safe."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import warnings

import numpy as np
import pytest

import tolstat
from tests.conftest import TOY_STUDY, Toy
from tolstat.errors import BrokenError, ModelError, RunFileError
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.store import files_beside, run_writer
from tolstat.store.files_beside import Lock
from tolstat.study.study import load


@pytest.fixture(autouse=True)
def _commit_each_block(monkeypatch):
    monkeypatch.setattr(run_writer, "SAFE_EVERY", 0.0)


def watched(study, path, tell, *, force=False, stopping=lambda: False, model=None):
    with Workers(1, stopping, block=100) as crew:
        asked = load(study, model=model or Toy())
        return execute(asked, path, crew, force=force, progress=tell)


@pytest.mark.parametrize("after", [0, 500, 1000])
def test_a_disk_that_fills_up_is_a_message(toy_study, tmp_path, after):
    """A file may not grow any more, from some moment on: its end does not fit."""
    path, before = tmp_path / "r.h5", resource.getrlimit(resource.RLIMIT_FSIZE)
    whole = tolstat.run(toy_study, model=Toy(), output=tmp_path / "whole.h5")

    def tell(progress):
        if progress.over >= after:
            size = 10_000 if after == 500 else path.stat().st_size
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))

    try:
        with pytest.raises(
            BrokenError, match=r"File too large; \d+ of 1000 trials are"
        ):
            watched(toy_study, path, tell)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "r.h5",
        "toy.toml",
        "whole.h5",
    ]
    stored = tolstat.open(path)
    assert not stored.complete and stored.ended >= after
    assert tolstat.resume(path, model=Toy()).frame().equals(whole.frame())


@pytest.mark.parametrize("size", [0, 100, 5_000, 20_000, 60_000])
def test_a_full_disk_leaves_no_file(toy_study, tmp_path, monkeypatch, size):
    # somebody else has taken the room since it was looked at
    monkeypatch.setattr(files_beside, "check_room", lambda *_: None)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        with pytest.raises(BrokenError, match=r"cannot be written: File too large"):
            tolstat.run(toy_study, model=Toy())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert [path.name for path in tmp_path.iterdir()] == ["toy.toml"]


@pytest.mark.parametrize("how", ["removed", "moved", "replaced"])
def test_a_run_whose_file_vanishes_continues_in_another(toy_study, tmp_path, how):
    path, whole = tmp_path / "r.h5", tolstat.run(toy_study, model=Toy())
    precious, seen = whole.path.read_bytes(), []

    def tell(progress):
        if progress.over >= 300 and not seen:
            seen.append(progress.over)
            if how == "removed":
                path.unlink()
            else:
                path.rename(tmp_path / "moved.h5")
            if how == "replaced":
                path.write_bytes(precious)

    with pytest.warns(RuntimeWarning, match=r"continues in .*r\.rescued\.h5"):
        run = watched(toy_study, path, tell)
    assert run.path.name == "r.rescued.h5" and run.frame().equals(whole.frame())
    assert path.exists() == (how == "replaced")
    if how == "replaced":
        assert path.read_bytes() == precious
    if how != "removed":
        assert tolstat.open(tmp_path / "moved.h5").ended == seen[0]


def test_a_folder_that_vanishes(toy_study, tmp_path, monkeypatch):
    folder, seen = tmp_path / "folder", []
    monkeypatch.chdir(tmp_path)

    def tell(progress):
        if progress.over >= 300 and not seen:
            seen.append(progress.over)
            for each in folder.iterdir():
                each.unlink()
            folder.rmdir()

    with pytest.warns(RuntimeWarning, match=r"continues in .*r\.rescued\.h5"):
        run = watched(toy_study, folder / "r.h5", tell)
    assert run.complete and run.path.parent == folder  # made again


class Broken(Toy):
    """Breaks from some trial on."""

    at = 0.0

    def evaluate(self, deviations, settings):
        if np.any(deviations[:, 0] > self.at):
            raise ZeroDivisionError("broken")
        return super().evaluate(deviations, settings)


@pytest.mark.parametrize("how", ["force", "resume"])
def test_the_old_run_is_kept_until_the_new_one_is_complete(toy_study, tmp_path, how):
    path = tmp_path / "r.h5"
    before = tolstat.run(toy_study, model=Toy(), output=path)
    data = path.read_bytes()
    with pytest.raises(ModelError, match="ZeroDivisionError"):
        watched(toy_study, path, lambda progress: None, force=True, model=Broken())
    assert path.read_bytes() == data  # nothing of the new one ran
    over = [0]

    def tell(progress):
        over[0] = progress.over
        assert (tmp_path / "r.h5.before").read_bytes() == data

    def in_part(stop):
        with pytest.warns(RuntimeWarning, match=r"is kept as .*r\.h5\.before until"):
            return watched(
                toy_study, path, tell, force=True, stopping=lambda: over[0] >= stop
            )

    for stop in (300, 100):  # the one that is complete is kept, not the one in part
        part, over[0] = in_part(stop), 0
        assert stop <= part.ended < 1000
        assert tolstat.open(tmp_path / "r.h5.before").frame().equals(before.frame())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        if how == "force":
            done = tolstat.run(toy_study, model=Toy(), output=path, force=True)
        else:
            done = tolstat.resume(path, model=Toy())
    assert done.complete
    assert {each.name for each in tmp_path.iterdir()} == {"toy.toml", "r.h5"}


def test_a_device_and_the_study_itself_are_not_replaced(toy_study, tmp_path):
    for path in ("/dev/null", toy_study):
        with pytest.raises(RunFileError, match="is not a run; it is not replaced"):
            tolstat.run(toy_study, model=Toy(), output=path, force=True)
    assert toy_study.read_text() == TOY_STUDY


def test_one_writer(toy_study, tmp_path):
    path = tmp_path / "r.h5"
    with Lock(path):
        for force in (False, True):
            with pytest.raises(
                RunFileError, match=f"is being written by process {os.getpid()} on "
            ):
                tolstat.run(toy_study, model=Toy(), output=path, force=force)
    run = tolstat.run(toy_study, model=Toy(), output=path)
    (tmp_path / "link.h5").symlink_to(path)
    with Lock(tmp_path / "link.h5"):
        for go_on in (tolstat.resume, lambda p, model: tolstat.extend(p, 2000)):
            with pytest.raises(RunFileError, match="is being written by process"):
                go_on(path, model=Toy())
    assert tolstat.verify(run.path, model=Toy()).whole
    assert not list(tmp_path.glob("*.lock"))


def test_two_runs_started_together(toy_study, tmp_path):
    """One runs, the other is refused: whichever; nothing of either is lost."""
    code = (
        "import sys; from tests.conftest import Toy; import tolstat;"
        f"study = {str(toy_study)!r}; seed = int(sys.argv[1]); sys.stdin.readline();"
        "tolstat.run(study, model=Toy(), trials=40000, seed=seed)"
    )
    pair = [
        subprocess.Popen(
            [sys.executable, "-c", code, str(seed)],
            stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        for seed in (5, 6)
    ]  # fmt: skip
    for each in pair:
        each.stdin.write("go\n")
        each.stdin.flush()
    said = [each.communicate()[1] for each in pair]
    codes = [each.returncode for each in pair]
    assert sorted(codes) == [0, 1]
    loser, winner = codes.index(1), codes.index(0)
    words = said[loser].splitlines()[-1]
    assert "is being written by" in words or "exists already" in words
    run = tolstat.open(toy_study.with_suffix(".h5"))
    assert run.sampled.seed == 5 + winner and run.ended == 40000


def test_a_file_of_ones_own_that_is_called_before_is_kept(toy_study, tmp_path):
    path, own = tmp_path / "r.h5", tmp_path / "r.h5.before"
    tolstat.run(toy_study, model=Toy(), output=path)
    own.write_bytes(path.read_bytes())
    tolstat.extend(path, 1100, model=Toy())
    assert own.exists()
    with pytest.raises(RunFileError, match="is in the way"):
        tolstat.run(toy_study, model=Toy(), output=path, force=True)
    path.unlink()
    tolstat.run(toy_study, model=Toy(), output=path)
    assert own.exists() and tolstat.open(path).complete


def test_the_run_before_is_said_to_stay_where_it_cannot_be_read(
    toy_study, tmp_path, monkeypatch
):
    path, opened = tmp_path / "r.h5", files_beside.opened
    tolstat.run(toy_study, model=Toy(), output=path)

    def failing(path):
        if path.name.endswith(".before") and path.exists():
            raise OSError(5, "Input/output error")
        return opened(path)

    monkeypatch.setattr(files_beside, "opened", failing)
    with pytest.warns(RuntimeWarning, match=r"r\.h5\.before as it is unreadable"):
        tolstat.run(toy_study, model=Toy(), output=path, force=True)
    assert tolstat.open(path).complete and (tmp_path / "r.h5.before").exists()


def test_what_stood_there_is_put_back_though_it_was_in_part(toy_study, tmp_path):
    """A run in part that replaces another, replaced by one that stops at once."""
    path, over = tmp_path / "r.h5", [0]
    before = tolstat.run(toy_study, model=Toy(), output=path)

    def tell(progress):
        over[0] = progress.over

    with pytest.warns(RuntimeWarning, match="is kept as"):
        part = watched(
            toy_study, path, tell, force=True, stopping=lambda: over[0] >= 100
        )
    data = path.read_bytes()
    with pytest.raises(ModelError, match="ZeroDivisionError"):
        watched(toy_study, path, lambda progress: None, force=True, model=Broken())
    assert path.read_bytes() == data and 0 < part.ended < 1000
    assert tolstat.open(f"{path}.before").frame().equals(before.frame())


def test_a_complete_run_takes_the_place_of_an_older_one_that_was_left(
    toy_study, tmp_path
):
    path, kept = tmp_path / "r.h5", tmp_path / "r.h5.before"
    over = [0]

    def tell(progress):
        over[0] = progress.over

    tolstat.run(toy_study, model=Toy(), output=path)
    with pytest.warns(RuntimeWarning, match="is kept as"):
        watched(toy_study, path, tell, force=True, stopping=lambda: over[0] >= 100)
    older = kept.read_bytes()
    done = tolstat.resume(path, model=Toy())
    kept.write_bytes(older)  # killed between the end and its removal
    over[0] = 0
    with pytest.warns(RuntimeWarning, match="is kept as"):
        watched(toy_study, path, tell, force=True, stopping=lambda: over[0] >= 100)
    assert tolstat.open(kept).made == done.made


def test_a_replacement_that_cannot_begin_leaves_the_run_alone(
    toy_study, tmp_path, monkeypatch
):
    path = tmp_path / "r.h5"
    tolstat.run(toy_study, model=Toy(), output=path)
    data = path.read_bytes()

    def full(*_):
        raise BrokenError("no room")

    with monkeypatch.context() as patched:
        patched.setattr("tolstat.store.files_beside.check_room", full)
        with pytest.raises(BrokenError, match="no room"):
            tolstat.run(toy_study, model=Toy(), output=path, force=True)
    assert path.read_bytes() == data
    assert {each.name for each in tmp_path.iterdir()} == {"toy.toml", "r.h5"}
    (tmp_path / "r.h5.before").write_bytes(data)
    with pytest.raises(RunFileError, match="is in the way"):
        tolstat.run(toy_study, model=Toy(), output=path, force=True)
    left = {each.name for each in tmp_path.iterdir()}
    assert left == {"toy.toml", "r.h5", "r.h5.before"}


def test_a_replacement_killed_before_its_file_was_made_can_begin_again(
    toy_study, tmp_path
):
    path = tmp_path / "r.h5"
    tolstat.run(toy_study, model=Toy(), output=path)
    (tmp_path / "r.h5.before").hardlink_to(path)
    assert tolstat.run(toy_study, model=Toy(), output=path, force=True).complete
    assert {each.name for each in tmp_path.iterdir()} == {"toy.toml", "r.h5"}
