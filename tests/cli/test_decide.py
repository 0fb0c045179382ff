"""`tolstat decide` and `tolstat run --decide`."""

from __future__ import annotations

import json
import re

import pytest

import tolstat
from tests.cli.command_line import call, chain

# missed by 7000 ppm, as sigma is 0.0471 mm: 1000 trials do not decide it
LIMIT = ">= 0.884 mm"


@pytest.fixture
def undecided(tmp_path):
    study = chain(tmp_path, "gap", trials=1000, limit=LIMIT)
    done = call("run", study)
    assert done.exit_code == 0 and "undecided" in done.output
    return study, done


def test_it_decides_what_a_run_leaves_undecided(undecided):
    study, done = undecided
    path = study.with_suffix(".h5")
    assert f"tolstat decide {path}" in done.output
    words = " ".join(done.output.split())
    assert re.search(r"less than a minute|about \d+ minutes", words)
    done = call("decide", path)
    run = tolstat.open(path)
    assert done.exit_code == 0 and run.stopped.reached and run.trials > 1000
    assert f"decided after {run.trials}" in done.output
    found = json.loads(tolstat.summary(run).json())["stopped"]
    assert found["reached"] and found["stages"] == [run.trials]
    assert call("check", path).exit_code in (0, 3)
    assert call("verify", path).exit_code == 0


@pytest.mark.parametrize("words", [["run", "--decide"], ["decide"]])
def test_a_study_is_run_until_it_is_decided(tmp_path, words):
    study = chain(tmp_path, "gap", trials=1000, limit=LIMIT)
    command, *options = words
    done = call(command, study, *options, "-o", tmp_path / "other.h5", "--check")
    assert done.exit_code in (0, 3)
    run = tolstat.open(tmp_path / "other.h5")
    assert run.stopped.reached and run.rules == ("decide",)


def test_a_budget_is_trials_or_a_time(undecided):
    path = undecided[0].with_suffix(".h5")
    done = call("decide", path, "--at-most", "1200", "--check")
    run = tolstat.open(path)
    assert done.exit_code == 4 and run.trials == 1200 and not run.stopped.reached
    done = call("decide", path, "--at-most", "1ms", "--not-slow")
    rules = ("decide, at most 1ms, not slow",)
    assert done.exit_code == 0 and tolstat.open(path).rules == rules


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["decide", "gap.h5", "-o", "other.h5"], "are for studies"),
        (["run", "gap.toml", "--decide", "--trials", "5"], "--trials or --decide"),
        (["decide", "gap.h5", "--at-most", "soon"], 'at_most = "soon"'),
        (["decide", "gap.h5", "--at-most", "0"], "whole number from 1"),
        (["decide", "gap.h5", "--at-most", "²"], 'at_most = "²"'),
    ],
)
def test_wrong_options_are_refused(undecided, monkeypatch, arguments, words):
    monkeypatch.chdir(undecided[0].parent)
    done = call(*arguments)
    assert done.exit_code == 2 and words in done.stderr
