"""`tolstat allocate` as a user types it."""

from __future__ import annotations

import json
import shlex
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

import tolstat
from tests.conftest import ROOT
from tolstat.catalogue import load as machine
from tolstat.cli.main import main

MACHINE = f"{ROOT}/runs/own/stack.py:Stack"
STUDY = """\
model = "stack"
trials = 2000
seed = 4
[deviations.housing]
tolerance = "+-0.05 mm"
cost = { "+-0.1 mm" = 2, "+-0.05 mm" = 5 }
[deviations.part]
tolerance = "IT8"
cost = { IT8 = 4, IT9 = 2, IT7 = 7 }
[limits]
gap = { limit = "0.02..0.18 mm", yield = "95 %" }
"""


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "stack.toml"
    path.write_text(STUDY)
    return path


def call(*arguments):
    words = [str(each) for each in arguments]
    return CliRunner().invoke(main, ["allocate", *words, "--machine", MACHINE])


def test_a_study_that_runs_tables_and_a_picture(study):
    new, picture = study.with_name("new.toml"), study.with_name("curve.csv")
    done = call(study, "-o", new, "--plot", picture)
    assert done.exit_code == 0, done.output
    for word in ("housing", "IT8", "All limits are met", "worst case"):
        assert word in done.output
    text = new.read_text()
    made, proved = (shlex.split(line[2:]) for line in text.splitlines()[1:4:2])
    assert made == ["tolstat", "allocate", str(study), "--machine", MACHINE]
    assert proved == ["tolstat", "run", str(new), *made[-2:]]
    run = tolstat.run(new, model=machine(MACHINE), workers=1)
    low, high = 0.02e-3, 0.18e-3
    gap = run.column("gap")
    ppm = 1e6 * (1 - ((gap >= low) & (gap <= high)).mean())
    # as the proof had it; the screen shows the figures that its interval leaves
    assert f" {float(format(ppm, '.3g')):.0f} " in done.output
    found = tolstat.allocate(study, model=machine(MACHINE))
    assert found.proof.fraction_out_of_limit["gap"].value == pytest.approx(
        1e-6 * ppm, rel=1e-12
    )
    assert "tolstat run" not in found.study_file()  # it is in no file
    assert "found" in picture.read_text()
    assert "Verdicts rest on the proof" in done.output
    assert "note: gap permits 50000 ppm out of limit" in done.stderr
    assert f"repeat the proof: tolstat run {new}" in done.output
    # the run says what the proof said, of the same trials
    proof, report = found.proof, tolstat.report(run)
    judged = report.responses["gap"].limited.yields
    assert judged.verdict == found.verdicts["gap"] == "met"
    assert judged.fraction_out_of_limit == proof.fraction_out_of_limit["gap"]
    assert (run.trials, run.sampled.seed) == (proof.trials, proof.seed)
    assert done.output.split("repeat the proof: ")[1].splitlines()[0].endswith(MACHINE)
    again = call(study, "-o", new)
    assert again.exit_code == 2 and "--force" in again.stderr
    itself = call(study, "-o", study, "--force")
    assert itself.exit_code == 2 and study.read_text() == STUDY


def test_a_study_is_written_only_if_it_finds_its_measured_parts(study, tmp_path):
    text = STUDY.replace("[deviations.part]", "[deviations.part_2]") + (
        '[deviations.part_1]\ndata = "parts.csv"\ncolumn = "length"\n'
    )
    study.write_text(text)
    parts, other = tmp_path / "parts.csv", tmp_path / "a folder" / "parts.csv"
    parts.write_text("length [mm]\n" + "0.01\n-0.01\n0.002\n" * 20)
    new = other.with_name("new.toml")
    new.parent.mkdir()
    missing = call(study, "-o", new)
    assert missing.exit_code == 2 and "no such file" in missing.stderr
    other.write_text("length [mm]\n0.03\n-0.01\n")
    others = call(study, "-o", new)
    assert others.exit_code == 2 and "data of that name differ" in others.stderr
    assert f"write it beside {study}" in others.stderr and not new.exists()
    other.write_bytes(parts.read_bytes())
    done = call(study, "-o", new)
    assert done.exit_code == 0, done.output
    again = shlex.split(done.output.split("repeat the proof: ")[1].splitlines()[0])
    run = CliRunner().invoke(main, again[1:])
    assert run.exit_code == 0 and new.with_suffix(".h5").exists(), run.output


def test_a_proof_is_a_run_of_random_trials(study):
    study.write_text(STUDY.replace("seed = 4", 'seed = 4\nsampling = "sobol"'))
    new = study.with_name("new.toml")
    done = call(study, "-o", new, "--trials", "1024")
    assert done.exit_code == 0, done.output
    written = tomllib.loads(new.read_text())
    proof = tolstat.allocate(study, model=machine(MACHINE), trials=1024).proof
    assert written["sampling"] == "random"
    assert (written["trials"], written["seed"]) == (proof.trials, proof.seed)
    made = new.read_text().splitlines()[1]
    assert made == f"# tolstat allocate {study} --trials 1024 --machine {MACHINE}"


def test_json_for_other_tools(study):
    done = call(study, "--json", "--trials", "1000")
    found = json.loads(done.stdout)
    assert done.exit_code == 0 and found["met"]
    assert list(found)[:4] == ["schema", "answer", "cost", "half_widths"]
    assert set(found["half_widths"]) == {"housing", "part"}
    assert found["half_widths"]["housing"] in (0.1e-3, 0.05e-3)
    assert found["cost"] == sum(entry["cost"] for entry in found["entries"])
    assert {"fraction_out_of_any_limit", "cost"} == set(found["trade_off"][0])


def test_an_infeasible_allocation_writes_no_study(study):
    study.write_text(STUDY.replace("0.02..0.18", "0.09..0.11"))
    new = study.with_name("new.toml")
    done = call(study, "-o", new)
    assert done.exit_code == 3, done.output
    assert "no tolerances were shown to meet all limits" in done.output
    assert "gap: not met" in done.output and not new.exists()


def test_errors_are_reported_before_the_run(study):
    assert "the name of a study ends in .toml" in call(study, "-o", "new.txt").stderr
    assert "a view ends in" in call(study, "--plot", "curve.doc").stderr
    study.write_text(STUDY.replace("IT9 = 2", "IT99 = 2"))
    assert "IT99" in call(study).stderr and call(study).exit_code == 2


SIGN = """\
        __import__("pathlib").Path(__file__).with_name("begun").touch()
        __import__("time").sleep(0.1)
"""


def test_ctrl_c_leaves_no_file(study):
    new, slow = study.with_name("new.toml"), study.with_name("slow.py")
    begun, first = study.with_name("begun"), "        housing, *parts"
    own = Path(ROOT, "runs", "own", "stack.py").read_text()
    assert first in own
    slow.write_text(own.replace(first, SIGN + first))
    tolstat_ = Path(sys.executable).with_name("tolstat")
    words = ["allocate", study, "-o", new, "--machine", f"{slow}:Stack"]
    process = subprocess.Popen(
        [tolstat_, *words, "--trials", "100000"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while not begun.exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, shown = process.communicate(timeout=30)
    assert process.returncode == 130 and "nothing is written" in shown
    assert not new.exists()
    assert tomllib.loads(study.read_text()) == tomllib.loads(STUDY)
