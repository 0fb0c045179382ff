"""resume, extend, verify as a user types them; exit codes."""

from __future__ import annotations

import json

import h5py

import tolstat
from tests.cli.test_commands import call

NEVER = """\
from tolstat import Contributor, Description, Model, Outcome, Response

class Never(Model):
    name = "never"
    failures = ("cannot be mounted",)

    def describe(self, settings):
        return Description(
            (Contributor("part", "m", "l", "a part"),),
            (Response("gap", "m", "g", "a gap"), Response("play", "m", "p", "play")),
        )

    def evaluate(self, deviations, settings):
        both = deviations[:, [0, 0]]
        return Outcome(both, failed={"cannot be mounted": both[:, 0] != 0})
"""


def test_a_damaged_run_is_refused_named_and_repaired(small_run):
    run = small_run
    shown = call("show", run).stdout
    whole = call("verify", run)
    assert whole.exit_code == 0 and "is as it was written" in whole.stdout
    with h5py.File(run, "r+") as file:
        file["yaw"][[5, 7]] *= 2
    for command in ("show", "report", ("compare", run)):
        words = (command, run) if isinstance(command, str) else (*command, run)
        done = call(*words)
        assert done.exit_code == 1 and "is damaged: trials 5, 7;" in done.stderr
    done = call("trial", run, 5)
    assert (
        done.exit_code == 1 and "bit for bit as stored; different: yaw" in done.stdout
    )
    assert "the run is damaged: trials 5, 7" in call("trial", run, 6).stdout
    done = call("verify", run, "--all")
    assert done.exit_code == 1 and "trials 5, 7" in done.stdout
    assert "24 trials, evaluated again: different in 5, 7" in done.stdout
    assert f"`tolstat resume {run}` repairs it" in " ".join(done.stdout.split())
    assert call("resume", run).exit_code == 0
    assert call("show", run).stdout == shown
    assert call("verify", run, "--all").exit_code == 0
    data = bytearray(run.read_bytes())
    data[3000] ^= 1
    run.write_bytes(data)
    for command in ("verify", "resume", "show"):
        done = call(command, run)
        assert done.exit_code == 1 and "where all of it hangs on" in done.stderr


def test_more_trials(small_study, small_run, tmp_path):
    run, other = small_run, tmp_path / "other.h5"
    done = call("extend", run, "--trials", 40)
    assert done.exit_code == 0 and "40 trials of stand" in done.stdout
    call("run", small_study, "--trials", 40, "-o", other)
    assert tolstat.open(run).frame().equals(tolstat.open(other).frame())
    done = call("extend", run, "--trials", 40)
    assert done.exit_code == 2 and "has 40 trials; more than that" in done.stderr
    done = call("resume", tmp_path / "none.h5")
    assert done.exit_code == 2 and "there is no such file" in done.stderr
    assert {each.suffix for each in tmp_path.iterdir()} == {".toml", ".h5"}


def test_exit_codes_are_written_down():
    shown = call("--help").output
    for line in ("0    done", "3    done, and a limit is not met", "130  stopped by"):
        assert line in shown


def test_all_trials_failed(tmp_path):
    """Not met, and why: the table, the page, and the numbers for other tools."""
    (tmp_path / "never.py").write_text(NEVER)
    study, machine = tmp_path / "never.toml", f"{tmp_path / 'never.py'}:Never"
    study.write_text(
        'model = "never"\ntrials = 300\nseed = 1\n[deviations]\npart = "+-1 mm"\n'
        '[limits]\ngap = "<= 1 mm"\n'
    )
    done = call("run", study, "--machine", machine)
    assert done.exit_code == 3, done.output
    (line,) = [x for x in done.stdout.splitlines() if "<= 1 mm" in x]
    assert "not met" in line and "100" in line
    assert "300 of 300 trials failed" in done.stdout
    assert "300 cannot be mounted; they count as beyond" in done.stdout
    run = study.with_suffix(".h5")
    assert call("report", run).exit_code == 0
    page = run.with_suffix(".html").read_text()
    assert "not met" in page and "No trial is done" in page
    assert "300 cannot be mounted" in page
    found = json.loads(call("report", run, "--json").stdout)
    assert found["responses"]["gap"]["limited"]["yields"]["verdict"] == "not met"
    refused = call("resume", run, "--rerun-failed")
    assert refused.exit_code == 2 and "no tighter settings" in refused.stderr
