"""Ctrl-C and kill -9 in the middle of a run."""

from __future__ import annotations

import random
import signal
import subprocess
import time

import numpy as np
import pytest

import tolstat
from tests.cli.test_commands import TOLSTAT


def start(file, *options, command="run"):
    return subprocess.Popen(
        [TOLSTAT, command, file, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for_trials(path, process, trials):
    while process.poll() is None:
        if path.exists() and tolstat.open(path).counts["done"] >= trials:
            return
        time.sleep(0.05)
    raise AssertionError(process.communicate())


def test_ctrl_c_stops_in_two_seconds_and_keeps_what_is_done(small_study):
    path = small_study.with_suffix(".h5")
    process = start(small_study, "--trials", "100000")
    wait_for_trials(path, process, 100)
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, shown = process.communicate(timeout=30)
    assert time.monotonic() - began < 2.0
    assert process.returncode == 130
    run = tolstat.open(path)
    assert f"{run.counts['done']} of 100000 trials are stored" in " ".join(
        shown.split()
    )
    assert run.provenance["trials_done"] == run.counts["done"] >= 100
    done = run.status == 1
    assert np.all(np.isfinite(run.column("extra_loss")[done]))
    assert np.all(np.isnan(run.column("extra_loss")[~done]))


def test_ctrl_c_during_one_endless_trial(small_study):
    """Even a single trial that would take minutes ends at once."""
    text = small_study.read_text().replace("cycles = 2", "cycles = 200000")
    small_study.write_text(text)
    process = start(small_study)
    time.sleep(4.0)
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    process.communicate(timeout=30)
    assert time.monotonic() - began < 2.0
    assert process.returncode == 130


def test_ctrl_c_during_a_report_leaves_nothing(small_study):
    path = small_study.with_suffix(".h5")
    run = tolstat.run(small_study, trials=400)
    # all of its responses: enough to draw for a while
    chosen = [w for each in run.responses for w in ("--response", each.name)]
    process = start(path, *chosen, command="report")
    time.sleep(6.0)
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, shown = process.communicate(timeout=30)
    assert time.monotonic() - began < 2.0
    assert process.returncode == 130 and "nothing is written" in shown
    assert not path.with_suffix(".html").exists()


@pytest.mark.long
def test_kill_loses_no_more_than_the_blocks_in_flight(small_study):
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
