"""Files that a run may replace; a full disk is detected before."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

import tolstat
from tests.conftest import Toy
from tests.store.tampering import resealed
from tolstat.errors import BrokenError, ModelError, Remedy, RunFileError, StudyError
from tolstat.store.files_beside import aside_of, check_room

STUDY = {
    "model": "toy", "trials": 300, "seed": 1, "deviations": {"part": "+-1 mm"},
    "limits": {"gap": "<= 2 mm"},
}  # fmt: skip


def test_only_a_run_is_replaced(toy, tmp_path):
    for name, content in (("study.toml", "seed = 1"), ("notes.h5", "hello")):
        path = tmp_path / name
        path.write_text(content)
        with pytest.raises(RunFileError, match="is not a run; it is not replaced"):
            tolstat.run(STUDY, model=toy, output=path, force=True)
        assert path.read_text() == content
    os.mkfifo(tmp_path / "fifo.h5")
    with pytest.raises(RunFileError, match="is not a run"):
        tolstat.run(STUDY, model=toy, output=tmp_path / "fifo.h5", force=True)
    run = tolstat.run(STUDY, model=toy, output=tmp_path / "run.h5")
    (tmp_path / "link.h5").symlink_to(run.path)
    tolstat.run(STUDY, model=toy, seed=9, output=tmp_path / "link.h5", force=True)
    assert (tmp_path / "link.h5").is_symlink()
    assert tolstat.open(run.path).sampled.seed == 9


def test_a_run_under_way_is_not_replaced(toy, tmp_path):
    run = tolstat.run(STUDY, model=toy, output=tmp_path / "run.h5")
    code = (
        "import sys; from pathlib import Path;"
        "from tolstat.store.files_beside import Lock;"
        "lock = Lock(Path(sys.argv[1])); print('open', flush=True); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", code, run.path],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        other.stdout.readline()
        with pytest.raises(RunFileError, match=f"written by process {other.pid} on"):
            tolstat.run(STUDY, model=toy, output=run.path, force=True)
    finally:
        other.communicate("")
    tolstat.run(STUDY, model=toy, output=run.path, force=True)


def test_only_files_of_killed_runs_are_removed(toy, tmp_path):
    path = tmp_path / "run.h5"
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    dead, alive = (tmp_path / f"run.h5.{n}-0.part" for n in (gone.pid, os.getppid()))
    precious = tmp_path / "run.h5.part"
    for each in (dead, alive, precious):
        each.write_text("x")
    tolstat.run(STUDY, model=toy, output=path)
    assert not dead.exists() and alive.exists() and precious.read_text() == "x"
    assert aside_of(path) != aside_of(path)


def test_files_of_other_names_are_kept(toy, tmp_path):
    """Nothing that is not exactly ours is removed, or stumbled over."""
    for name in ("4000000-mine", "\u00b2-0", "99999999999999999999-0"):
        (tmp_path / f"run.h5.{name}.part").write_text("mine")
    notes = tmp_path / "notes.h5"
    notes.write_text("how a tolstat seal, format 9 is found")
    tolstat.run(STUDY, model=toy, output=tmp_path / "run.h5")
    assert len(list(tmp_path.glob("*.part"))) == 3
    with pytest.raises(RunFileError, match="is not a run; it is not replaced"):
        tolstat.run(STUDY, model=toy, output=notes, force=True)


@pytest.mark.parametrize("linked", [False, True])
def test_a_foreign_lock_is_kept(linked, toy, tmp_path):
    mine, lock = tmp_path / "mine.txt", tmp_path / "run.h5.lock"
    mine.write_text("precious")
    lock.symlink_to(mine) if linked else mine.rename(lock)
    with pytest.raises(RunFileError, match=r"not a lock of tolstat|cannot be written"):
        tolstat.run(STUDY, model=toy, output=tmp_path / "run.h5")
    assert lock.read_text() == "precious" and not (tmp_path / "run.h5").exists()


def test_a_title_that_reads_like_a_seal(toy, tmp_path):
    text = "tolstat seal, format 9\nsize 9\nsha256 " + 64 * "0" + "\nrows 1 2\n"
    for title in ("tolstat seal, format 9", text):
        study = STUDY | {"title": title}
        run = tolstat.run(study, model=toy, output=tmp_path / "run.h5", force=True)
        assert tolstat.open(run.path).title == title


class Failing(Toy):
    def evaluate(self, deviations, settings):
        if deviations.any() and self.after <= 0:
            raise ZeroDivisionError("late")
        self.after -= len(deviations)
        return super().evaluate(deviations, settings)


def test_a_failing_model_leaves_done_trials_or_no_file(tmp_path):
    machine, path = Failing(), tmp_path / "run.h5"
    machine.after = 0
    with pytest.raises(ModelError, match="late") as refused:
        tolstat.run(STUDY, model=machine, output=path)
    assert refused.value.exit_code == 2 and list(tmp_path.iterdir()) == []
    machine.after = 100
    with pytest.raises(BrokenError, match=r"late.*of 300 trials are stored") as said:
        tolstat.run(STUDY, model=machine, output=path, workers=1)
    (advice,) = said.value.advice
    assert advice.remedy is Remedy.RESUME and advice.path == path
    assert 0 < tolstat.open(path).ended < 300


def test_a_full_disk_is_reported_before_the_run(toy, tmp_path, monkeypatch):
    check_room(tmp_path / "run.h5", 1000)
    with pytest.raises(RunFileError, match=r"needs 2000000000000\.000 MB for its"):
        check_room(tmp_path / "run.h5", 10**18)
    once_and_a_half = shutil.disk_usage(tmp_path)._replace(free=1500)
    with monkeypatch.context() as patch:
        patch.setattr(shutil, "disk_usage", lambda folder: once_and_a_half)
        with pytest.raises(RunFileError, match="its file and a copy"):
            check_room(tmp_path / "run.h5", 1000)
    resource = pytest.importorskip("resource")
    free, files = (resource.RLIM_INFINITY,) * 2, resource.RLIMIT_FSIZE
    monkeypatch.setattr(
        resource, "getrlimit", lambda what: (1000, 1000) if what == files else free
    )
    with pytest.raises(RunFileError, match=r"0\.\d{3} MB, and 0\.\d{3} MB are allowed"):
        tolstat.run(STUDY, model=toy, output=tmp_path / "run.h5")
    assert list(tmp_path.iterdir()) == []


class Writing(Toy):
    def evaluate(self, deviations, settings):
        deviations *= 1000.0
        return super().evaluate(deviations, settings)


class Bare(Toy):
    failures = "broken"


class Sighing(Toy):
    assumptions = ("a\0b",)


@pytest.mark.parametrize(
    ("machine", "words"),
    [
        (Writing, "evaluate fails: ValueError: .*read-only"),
        (Bare, "failures must map a word"),
        (Sighing, "assumptions must be a tuple of texts"),
    ],
)
def test_models_that_would_corrupt_a_run_are_refused(machine, words, tmp_path):
    with pytest.raises((ModelError, StudyError), match=words):
        tolstat.run(STUDY, model=machine(), output=tmp_path / "run.h5")


def test_a_model_class_is_accepted_like_its_object(tmp_path):
    assert tolstat.run(STUDY, model=Toy, output=tmp_path / "run.h5").trials == 300


def test_a_text_that_no_file_can_hold(toy, tmp_path):
    with pytest.raises(StudyError, match="character NUL"):
        tolstat.run({**STUDY, "title": "a\0b"}, model=toy, output=tmp_path / "a.h5")


class Moody(Toy):
    """Answers every trial, and then not even itself."""

    def tightened(self, settings):
        raise ZeroDivisionError("no more")


def test_failing_diagnostics_keep_the_trials(toy, tmp_path):
    run = tolstat.run(STUDY, model=Moody(), output=tmp_path / "run.h5")
    assert run.ended == 300 and np.isfinite(run.column("gap")).any()
    assert "tightened fails: ZeroDivisionError: no more" in run.diagnostics.missing
    page = tolstat.report(run).html()
    assert "ZeroDivisionError: no more" in page


def test_a_model_without_contributors(tmp_path):
    class Fixed(Toy):
        def describe(self, settings):
            return super().describe(settings)._replace(contributors=())

        def evaluate(self, deviations, settings):
            return tolstat.Outcome(np.ones((len(deviations), 2)))

    study = {k: v for k, v in STUDY.items() if k != "deviations"}
    run = tolstat.run(study, model=Fixed(), output=tmp_path / "run.h5")
    assert run.ended == 300 and run.failed == 0


def test_columns_of_other_lengths_are_no_run(toy, tmp_path):
    run = tolstat.run(STUDY, model=toy, output=tmp_path / "run.h5")
    with resealed(run.path) as file:
        del file["gap"]
        file["gap"] = np.ones(3)
    with pytest.raises(RunFileError, match="is not a complete run"):
        tolstat.open(run.path)
