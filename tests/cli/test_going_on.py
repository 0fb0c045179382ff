"""resume, extend, verify as a user types them; exit codes."""

from __future__ import annotations

import json
import re
import shlex

import h5py

import tolstat
from tests.cli.command_line import call
from tests.store.tampering import resealed

NEVER = """\
from tolstat import Contributor, Description, Model, Outcome, Response

class Never(Model):
    name = "never"
    failures = {"cannot be mounted": "the parts leave a gap"}

    def describe(self, settings):
        return Description(
            (Contributor("part", "m", "l", "a part"),),
            (Response("gap", "m", "g", "a gap"), Response("play", "m", "p", "play")),
        )

    def evaluate(self, deviations, settings):
        both = deviations[:, [0, 0]]
        return Outcome(both, failed={"cannot be mounted": both[:, 0] != 0})
"""


def without_times(text):
    """Return what `show` prints without the times that it predicts."""
    return re.sub(r"\(about .*?\)|less than a minute", "", text)


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
    assert f"Repair it with: tolstat resume {run}" in " ".join(done.stdout.split())
    assert call("resume", run).exit_code == 0
    assert without_times(call("show", run).stdout) == without_times(shown)
    assert call("verify", run, "--all").exit_code == 0
    data = bytearray(run.read_bytes())
    data[100] ^= 1  # in the seal
    run.write_bytes(data)
    for command in ("verify", "resume", "show"):
        done = call(command, run)
        assert done.exit_code == 1 and "damaged outside its trials" in done.stderr


def test_more_trials(small_study, small_run, tmp_path):
    run, other = small_run, tmp_path / "other.h5"
    done = call("extend", run, "--trials", 40)
    assert done.exit_code == 0 and "40 trials done" in done.stdout
    call("run", small_study, "--trials", 40, "-o", other)
    assert tolstat.open(run).frame().equals(tolstat.open(other).frame())
    done = call("extend", run, "--trials", 40)
    assert done.exit_code == 2 and "has 40 trials already; give" in done.stderr
    done = call("resume", tmp_path / "none.h5")
    assert done.exit_code == 2 and "no such file" in done.stderr
    assert {each.suffix for each in tmp_path.iterdir()} == {".toml", ".h5"}


def advised(done):
    """The commands that a refusal names, as a shell reads them."""
    found = re.findall(r"`tolstat ([^`]+)`", done.stderr)
    return [shlex.split(each) for each in found]


def test_the_resume_command_of_a_refusal_works(half):
    assert 0 < half.ended < 1000
    study = half.path.with_suffix(".toml")
    again = call("run", study)
    assert again.exit_code == 2 and "exists already" in again.stderr
    (command,) = advised(again)
    assert command == ["resume", str(half.path)]
    assert call(*command).exit_code == 0 and tolstat.open(half.path).complete
    # what is complete is not gone on with
    again = call("run", study)
    assert "exists already" in again.stderr and advised(again) == []


def test_both_commands_of_a_changed_run_refusal_work(half):
    with resealed(half.path) as file:
        file.attrs["source_digest"] = "0123"
    study = half.path.with_suffix(".toml")
    anew = ["run", str(study), "--force"]
    refused = call("resume", half.path)
    assert advised(refused) == [anew, ["resume", str(half.path), "--regardless"]]
    refused = call("extend", half.path, "--trials", 1200)
    regardless = ["extend", str(half.path), "--trials", "1200", "--regardless"]
    assert advised(refused) == [anew, regardless]
    assert call(*regardless).exit_code == 0
    assert tolstat.open(half.path).ended == 1200
    # as many trials as the run has, and in its place
    other = half.path.rename(half.path.with_name("other.h5"))
    study.write_text(study.read_text().replace("A = ", "C = "))
    (anew, _) = advised(call("resume", other))
    assert anew == ["run", str(study), "--trials", "1200", "-o", str(other), "--force"]
    study.unlink()
    assert "run its study again, with --force" in call("resume", other).stderr


def test_exit_codes_match_the_documentation():
    shown = call("--help").output
    for line in (
        "0    done", "3    a limit is not met", "4    a limit is undecided",
        "130  stopped by",
    ):  # fmt: skip
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
    assert done.exit_code == 0, done.output
    assert call("check", study.with_suffix(".h5")).exit_code == 3
    (line, worst) = [x for x in done.stdout.splitlines() if "<= 1 mm" in x]
    assert worst == "Worst case of the tolerances, out of limit: gap failed (<= 1 mm)."
    assert "not met" in line and "100" in line
    assert "300 of 300 trials failed" in done.stdout
    assert "300 cannot be mounted; they count as out of every limit" in done.stdout
    run = study.with_suffix(".h5")
    assert call("report", run).exit_code == 0
    page = run.with_suffix(".html").read_text()
    assert "not met" in page and "No trial is done" in page
    assert "300 cannot be mounted" in page
    found = json.loads(call("report", run, "--json").stdout)
    assert found["responses"]["gap"]["limited"]["yields"]["verdict"] == "not met"
    refused = call("resume", run, "--rerun-failed")
    assert refused.exit_code == 2 and "no tighter settings" in refused.stderr
