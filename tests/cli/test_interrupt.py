"""Ctrl-C and kill -9 in the middle of a run."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import tolstat
from tests.cli.command_line import TOLSTAT, chain, wait_for_trials
from tests.execution.rare_chain import CHAIN as RARE

SOON = 6.0  # s: two where no other process runs; what is stopped would take far longer


def start(file, *options, command="run"):
    return subprocess.Popen(
        [TOLSTAT, command, file, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_stop_in_two_seconds_and_keep_done_trials(small_study, number):
    path = small_study.with_suffix(".h5")
    process = start(small_study, "--trials", "20000")
    wait_for_trials(path, process, 30)
    process.send_signal(number)
    began = time.monotonic()
    _, shown = process.communicate(timeout=30)
    assert time.monotonic() - began < SOON
    assert process.returncode == 130
    run = tolstat.open(path)
    assert f"{run.counts['done']} of 20000 trials are stored" in " ".join(shown.split())
    assert shown.splitlines()[-1].strip() == f"tolstat resume {path}"
    assert run.provenance["trials_done"] == run.counts["done"] >= 30
    done = run.status == 1
    assert np.all(np.isfinite(run.column("extra_loss")[done]))
    assert np.all(np.isnan(run.column("extra_loss")[~done]))
    assert not list(path.parent.glob("*.lock"))


def test_ctrl_c_while_tolstat_is_loaded(small_study):
    for seconds in (0.3, 0.6):
        process = start(small_study)
        time.sleep(seconds)
        process.send_signal(signal.SIGINT)
        _, shown = process.communicate(timeout=30)
        assert process.returncode == 130 and "Traceback" not in shown, shown


def test_ignored_signals_stay_ignored(small_study):
    """As `nohup` has it."""
    code = "import signal, os, sys; signal.signal(signal.SIGHUP, signal.SIG_IGN);"
    code += "os.execv(sys.argv[1], sys.argv[1:])"
    path = small_study.with_suffix(".h5")
    command = [sys.executable, "-c", code, TOLSTAT, "run", small_study]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    wait_for_trials(path, process, 0)
    process.send_signal(signal.SIGHUP)
    assert "stored in" in process.communicate(timeout=60)[1]
    assert process.returncode == 0


def test_ctrl_c_in_python_does_not_wait_for_the_nominal_trial(small_study):
    """A machine that takes minutes, and knows no interruption."""
    text = small_study.read_text().replace("cycles = 2", "cycles = 2000")
    small_study.write_text(text)
    code = (
        "import sys, tolstat\n"
        "try:\n    tolstat.run(sys.argv[1], workers=1)\n"
        "except KeyboardInterrupt:\n    print('interrupted', flush=True)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, small_study], stdout=subprocess.PIPE, text=True
    )
    while process.poll() is None and not small_study.with_suffix(".h5").exists():
        time.sleep(0.05)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=30)[0] == "interrupted\n"
    assert process.returncode == 0
    run = tolstat.open(small_study.with_suffix(".h5"))
    assert run.ended == 0 and run.nominal["status"] == "not run"


def test_ctrl_c_during_one_endless_trial(small_study):
    """Even a single trial that would take minutes ends at once."""
    text = small_study.read_text().replace("cycles = 2", "cycles = 20000")
    small_study.write_text(text)
    process = start(small_study)
    time.sleep(4.0)
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    process.communicate(timeout=30)
    assert time.monotonic() - began < SOON
    assert process.returncode == 130


def test_ctrl_c_while_the_command_line_still_loads(tmp_path):
    (tmp_path / "click.py").write_text(
        "import time\nprint('loading', flush=True)\ntime.sleep(30)\n"
    )
    begin = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); "
    process = subprocess.Popen(
        [sys.executable, "-c", begin + "from tolstat.cli.entry import entry; entry()"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "loading\n"
    process.send_signal(signal.SIGINT)
    _, shown = process.communicate(timeout=30)
    assert process.returncode == 130 and shown == "stopped: nothing is written\n"


def test_ctrl_c_during_a_report_leaves_no_file(small_run):
    """While its third picture is drawn."""
    code = (
        "import time\n"
        "from tolstat.cli.entry import entry\n"
        "from tolstat.render import drawing\n"
        "drawn, plain = [], drawing.as_svg\n"
        "def as_svg(*arguments):\n"
        "    drawn.append(arguments)\n"
        "    if len(drawn) == 3:\n"
        "        print('drawing', flush=True)\n"
        "        time.sleep(5)\n"
        "    return plain(*arguments)\n"
        "drawing.as_svg = as_svg\n"
        "entry()\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, "report", small_run],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "drawing\n"
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, shown = process.communicate(timeout=30)
    assert time.monotonic() - began < SOON
    assert process.returncode == 130 and "nothing is written" in shown
    assert not small_run.with_suffix(".html").exists()


FITTING = """\
import time
from tolstat.deviations import rare_search as rare
from tolstat.cli.entry import entry
fitted = rare.fitted
def for_long(*arguments):
    print("fitting", flush=True)
    end = time.monotonic() + 30
    while time.monotonic() < end:
        fitted(*arguments)
    return fitted(*arguments)
rare.fitted = for_long
entry()
"""


def interrupted_while_fitting(*arguments):
    """Return what a command has shown, and its exit code, within two seconds."""
    process = subprocess.Popen(
        [sys.executable, "-c", FITTING, *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "fitting\n"
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, shown = process.communicate(timeout=60)
    assert time.monotonic() - began < SOON, shown
    assert "Traceback" not in shown
    return " ".join(shown.split()), process.returncode


def test_ctrl_c_while_a_rare_run_fits(tmp_path):
    """Among a hundred directions a fit takes many seconds; here each takes 30."""
    study, other = tmp_path / "chain.toml", tmp_path / "whole.h5"
    study.write_text(RARE)
    path = study.with_suffix(".h5")
    shown, code = interrupted_while_fitting("run", str(study))
    assert code == 130 and shown.endswith(f"continue with: tolstat resume {path}")
    found = tolstat.open(path)
    assert f"{found.ended} of 5000 trials are stored" in shown
    # what was answered is drawn again first, and fitted
    before = path.read_bytes()
    shown, code = interrupted_while_fitting("resume", str(path))
    assert code == 130 and shown.endswith(
        f"is unchanged; `tolstat resume {path}` continues it"
    )
    assert path.read_bytes() == before
    whole = tolstat.run(study, output=other)
    assert tolstat.resume(path).frame().equals(whole.frame())
    # of a finished study of a queue, too
    before = path.read_bytes()
    shown, code = interrupted_while_fitting("batch", str(study))
    assert code == 130 and "stopped; the same command continues" in shown
    assert ",stopped," in (tmp_path / "batch.csv").read_text()
    assert path.read_bytes() == before


SUMMING = """\
import time
from tolstat.cli import {command}
from tolstat.cli.entry import entry
def for_long(*arguments):
    print("summing", flush=True)
    time.sleep(60)
{command}.{answer} = for_long
entry()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ("command", "answer", "words"),
    [
        ("run", "summary", "what is stored is in {path}; `tolstat resume` completes"),
        ("batch", "report", "stopped; the same command continues"),
    ],
)
def test_signals_end_what_does_not_look_at_them(
    tmp_path, number, command, answer, words
):
    """A summary or a report of a large run."""
    study = chain(tmp_path, "chain", trials=100)
    process = subprocess.Popen(
        [sys.executable, "-c", SUMMING.format(command=command, answer=answer),
         command, str(study)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "summing\n"
    process.send_signal(number)
    _, shown = process.communicate(timeout=30)  # of the 60 s that it takes
    path = study.with_suffix(".h5")
    assert process.returncode == 130 and words.format(path=path) in shown
    assert tolstat.open(path).complete


LOOKING = """\
import os, signal, time
from tolstat.cli.entry import stop_on_interrupt
with stop_on_interrupt() as stop:
    os.kill(os.getpid(), signal.SIGINT)
    while not stop.is_set():
        time.sleep(0.01)
    time.sleep(2.5)
    print("the index is written")
"""


def test_work_that_has_looked_comes_to_its_end():
    """A busy machine needs longer than the patience to write what was stored."""
    ended = subprocess.run(
        [sys.executable, "-c", LOOKING], capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == 0 and ended.stdout == "the index is written\n"


@pytest.mark.long
def test_sigkill_loses_at_most_the_running_blocks(small_study):
    """Kill -9 at 40 random moments: the file opens, status never runs ahead of data."""
    path = small_study.with_suffix(".h5")
    rng = random.Random(12)
    for _ in range(40):
        path.unlink(missing_ok=True)
        process = start(small_study, "--trials", "20000")
        wait_for_trials(path, process, 1)
        time.sleep(rng.uniform(0.0, 1.5))
        seen = tolstat.open(path).counts["done"]
        process.kill()
        process.communicate()
        run = tolstat.open(path)
        assert run.counts["done"] >= seen
        done = run.status == 1
        for response in run.responses:
            assert np.all(np.isfinite(run.column(response.name)[done]))
        for contributor in run.contributors:
            assert np.all(np.isfinite(run.column(contributor.name)))
