"""A model in processes that may end: the guilty trials are found, others unchanged."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from click.testing import CliRunner

import tolstat
from tests.isolation.trouble import ABOVE
from tests.isolation.trouble import TroubleSettings as Settings
from tolstat import catalogue, operating_system
from tolstat.cli.main import main
from tolstat.errors import ModelError, StudyError
from tolstat.execution.workers import block_scheduler
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.isolation import isolated_model, nursery_process, processes
from tolstat.isolation.isolated_model import processes_of
from tolstat.model.checked import described, simulate
from tolstat.status import Status
from tolstat.study.given_points import Case

FILE = Path(__file__).with_name("trouble.py")
ROWS = np.random.default_rng(1).normal(0, 1, (60, 1))
GUILTY = np.flatnonzero(ROWS[:, 0] > ABOVE)
STUDY = {
    "model": "trouble", "trials": 60, "seed": 3, "settings": {"how": "crash"},
    "deviations": {"x": "+-3 m"}, "limits": {"y": "<= 6 m"},
}  # fmt: skip


@pytest.fixture(autouse=True, scope="module")
def _no_process_stays():
    """The processes of this file: tests share them, which may grow by 200 MB."""
    before = {*psutil.Process().children()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(isolated_model, "_processes", isolated_model.OrderedDict())
        patch.setattr(nursery_process, "GROWTH", 200 << 20)
        yield
        for of_model in isolated_model._processes.values():
            of_model.close()
    assert {*psutil.Process().children()} <= before


def found(kind, longest=0.0):
    return catalogue.isolated(catalogue.load(f"{FILE}:{kind}"), longest)


def check(answers, status):
    """The guilty have this status and their output; the others their bits."""
    assert GUILTY.tolist() == np.flatnonzero(answers.status != Status.DONE).tolist()
    assert {*answers.status[GUILTY].tolist()} == {status}
    others = np.setdiff1d(np.arange(len(ROWS)), GUILTY)
    assert answers.responses[others].tobytes() == (2 * ROWS[others] + 1).tobytes()
    assert [*answers.output] == GUILTY.tolist()


@pytest.mark.parametrize("kind", ["Trouble", "RowByRow"])
@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("crash", "SIGSEGV"),
        ("exit", "exit code 0"),
        ("abort", "SIGABRT"),
        ("sys.exit", "exit code 3"),
    ],
)
def test_a_crash_costs_its_trial(kind, how, words):
    answers = simulate(found(kind), ROWS, Settings(how))
    check(answers, Status.CRASHED)
    for text in answers.output.values():
        assert words in text
        assert f"about to {how}" in text


def test_another_exception_is_a_fault_of_the_model():
    with pytest.raises(ModelError, match="evaluate fails: ValueError: error"):
        simulate(found("RowByRow"), ROWS, Settings("error"))


@pytest.mark.parametrize("kind", ["Trouble", "RowByRow"])
def test_a_hang_costs_its_trial(kind):
    answers = simulate(found(kind, longest=0.3), ROWS, Settings("hang"))
    check(answers, Status.TOOK_TOO_LONG)
    assert "longer than 0.3 s" in answers.output[GUILTY[0]]


def test_a_leak_costs_its_trial():
    check(simulate(found("RowByRow"), ROWS, Settings("leak")), Status.CRASHED)


def test_a_model_that_kills_itself_is_guilty_after_some_times():
    check(simulate(found("RowByRow"), ROWS, Settings("kill")), Status.CRASHED)


def test_a_worker_that_is_killed_is_replaced_and_no_trial_is_guilty():
    model = found("Trouble")
    simulate(model, ROWS, Settings())
    of_model = processes_of(model.load)
    for number in [of_model._idle[-1].number, of_model._nursery._process.pid]:
        os.kill(number, signal.SIGKILL)
        time.sleep(0.1)
        assert (simulate(model, ROWS, Settings()).status == Status.DONE).all()


def test_a_grown_worker_is_replaced_between_blocks(monkeypatch):
    monkeypatch.setattr(processes, "REPLACED", -1)
    model = found("Trouble")
    of_model = processes_of(model.load)
    before = len(of_model._idle)
    simulate(model, ROWS, Settings())
    assert len(of_model._idle) == max(0, before - 1)


def test_a_run_stores_limits_and_output_and_its_trials_repeat(tmp_path):
    model = catalogue.load(f"{FILE}:Trouble")
    run = tolstat.run(STUDY, output=tmp_path / "a.h5", workers=2)
    crashed = np.flatnonzero(run.column("x") > ABOVE)
    assert len(crashed) > 0
    assert np.flatnonzero(run.status == Status.CRASHED).tolist() == crashed.tolist()
    assert run.isolation.longest_trial == 60
    assert [*run.isolation.output] == crashed.tolist()
    replay = tolstat.replay(run, int(crashed[0]))
    assert (replay.status, replay.differences) == ("crashed", ())
    assert "about to crash" in replay.output
    assert tolstat.verify(tmp_path / "a.h5").whole
    assert "SIGSEGV" in " ".join(tolstat.report(run).trials.notes)
    assert model is not None


def test_a_stop_keeps_the_trials_that_have_ended(monkeypatch):
    """A block is handed back up to the trial that hangs."""
    written = []

    def memory_file():
        file = operating_system.memory_file()
        written.append(os.dup(file.fileno()))
        return file

    def stopping():
        return any(os.lseek(file, 0, os.SEEK_CUR) for file in written)

    model, case = found("RowByRow", longest=60.0), Case(0, len(ROWS), Settings("hang"))
    processes_of(model.load).close()
    monkeypatch.setattr(processes, "memory_file", memory_file)
    monkeypatch.setattr(block_scheduler, "GRACE", 0.5)
    with Workers(1, stopping, block=len(ROWS)) as crew:
        blocks = [*crew.blocks(model, [case], ROWS)]
    (((first, answers),),) = blocks
    assert first == 0
    assert 0 < len(answers.status) <= GUILTY[0]
    done = ROWS[: len(answers.status)]
    assert answers.responses.tobytes() == (2 * done + 1).tobytes()


def test_a_nominal_trial_that_crashes_is_a_fault_of_the_model(tmp_path):
    text = FILE.read_text().replace("ABOVE = 2.0", "ABOVE = -1.0")
    (tmp_path / "always.py").write_text(text)
    catalogue.load(f"{tmp_path / 'always.py'}:Trouble")
    with pytest.raises(ModelError, match=r"nominal trial crashed: ended by SIGSEGV"):
        tolstat.run(STUDY)


def test_a_longest_trial_isolates_any_model_and_is_kept():
    study = {
        "model": "dimension_chain", "trials": 200, "seed": 1, "longest_trial": "7 s",
        "settings": {"gap": "A"}, "limits": {"gap": "<= 1.05 mm"},
        "links": {"A": {"nominal": "1 mm", "tolerance": "+-0.1 mm"}},
    }  # fmt: skip
    run = tolstat.run(study)
    assert run.isolation.longest_trial == 7
    plain = tolstat.run({k: v for k, v in study.items() if k != "longest_trial"})
    assert plain.isolation is None
    for name in ("A", "gap"):
        assert run.column(name).tobytes() == plain.column(name).tobytes()
    assert run.source_digest == plain.source_digest
    with pytest.raises(StudyError, match="longest_trial"):
        tolstat.run({**study, "longest_trial": "0 s"})


def test_no_process_survives_a_killed_parent(tmp_path):
    code = (
        f"import tolstat; from tolstat import catalogue\n"
        f"catalogue.load({str(FILE)!r} + ':RowByRow')\n"
        f"tolstat.run({ {**STUDY, 'model': 'trouble_by_row'}!r}"
        " | {'settings': {'how': 'hang'}})"
    )
    parent = subprocess.Popen([sys.executable, "-c", code])
    try:
        end = time.monotonic() + 60
        while len(family := psutil.Process(parent.pid).children(recursive=True)) < 2:
            assert time.monotonic() < end
            time.sleep(0.05)
        time.sleep(0.5)
    finally:
        parent.kill()
        parent.wait()
    gone, alive = psutil.wait_procs(family, timeout=10)
    assert len(gone) >= 2
    assert not alive


FALLING = """
import ctypes, os
from tolstat import Contributor, Description, Model, Outcome, Response

def fall(name):
    if name == {where!r}:
        print("falling in", name)
        ctypes.string_at(0)

fall("import")

class Falling(Model):
    name = "falling"
    failures = {{"late": "x is small"}}

    def preload(self):
        fall("preload")

    def describe(self, settings):
        fall("describe")
        return Description((Contributor("x", "m"),), (Response("y", "m"),))

    def impossible(self, deviations, settings):
        fall("impossible")
        return {{"late": deviations[:, 0] > 1}}

    def evaluate(self, deviations, settings):
        return Outcome(deviations + os.getpid())
"""


@pytest.mark.parametrize("where", ["import", "preload", "describe", "impossible"])
def test_a_crash_outside_of_trials_is_an_error(tmp_path, where):
    path = tmp_path / "falling.py"
    path.write_text(FALLING.format(where=where))
    with catalogue.isolating(), pytest.raises(ModelError) as error:
        model = catalogue.find(catalogue.load(f"{path}:Falling"))
        described(model, None)
        simulate(model, np.zeros((1, 1)), None)
    assert "SIGSEGV" in str(error.value)
    assert f"falling in {where}" in str(error.value)


def test_the_doctor_survives_a_crash(tmp_path):
    path = tmp_path / "falling.py"
    code = FALLING.format(where="evaluate").replace(
        "        return Outcome", '        fall("evaluate")\n        return Outcome'
    )
    path.write_text(code)
    done = CliRunner().invoke(main, ["doctor", f"{path}:Falling", "--isolate"])
    assert done.exit_code == 3, done.output
    assert "3 crashed" in done.stdout
    assert "falling in evaluate" in done.stdout


def test_a_source_that_has_changed_is_refused(tmp_path):
    path = tmp_path / "falling.py"
    path.write_text(FALLING.format(where=""))
    model = catalogue.isolated(catalogue.load(f"{path}:Falling"))
    answers = simulate(model, np.array([[0.0], [2.0]]), None)
    assert answers.responses[0, 0] != os.getpid()
    assert answers.status.tolist() == [Status.DONE, 100]
    of_model = processes_of(model.load)
    path.write_text(FALLING.format(where="").replace("> 1", "> 0"))
    of_model.close()  # another one is started
    with pytest.raises(ModelError, match="source has changed"):
        simulate(model, np.zeros((1, 1)), None)


def test_an_object_of_this_process_is_refused():
    class Here(tolstat.Model):
        name, isolated = "here", True

        def describe(self, settings):
            """Nothing."""

        def evaluate(self, deviations, settings):
            """Nothing."""

    with pytest.raises(ModelError, match="an object of this process"):
        catalogue.find(Here())


def test_a_system_without_such_processes_says_so(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(ModelError, match="need Linux"):
        catalogue.isolated(catalogue.find("stand"))
