"""The commands as a user types them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from tolstat.cli.main import main

TOLSTAT = Path(sys.executable).with_name("tolstat")


def call(*arguments):
    return CliRunner().invoke(main, [str(each) for each in arguments])


def test_help_and_version():
    assert "Monte Carlo tolerance analysis" in call("--help").output
    assert "--workers" in call("run", "--help").output
    assert "tolstat" in call("--version").output


def test_models_and_one_of_them():
    assert "stand" in call("models").output
    shown = call("show", "stand").output
    for word in (
        "crank_speed",
        "rod_length_1",
        "extra_loss",
        "jam_share",
        "geometry",
        "rad/s",
    ):
        assert word in shown
    wrong = call("show", "stnad")
    assert wrong.exit_code == 2 and "did you mean 'stand'" in wrong.stderr


def test_run_show_and_refusal(small_study):
    done = call("run", small_study, "--trials", 80, "--workers", 1)
    assert done.exit_code == 0, done.output
    for word in ("extra_loss", "<= 3 %", "0 of 80 trials failed", "95 %", "kN"):
        assert word in done.output
    again = call("run", small_study)
    assert again.exit_code == 2 and "--force" in again.stderr
    table = [line for line in done.stdout.splitlines() if "shaft_9_moment" in line]
    shown = call("show", small_study.with_suffix(".h5")).stdout
    assert [line for line in shown.splitlines() if "shaft_9_moment" in line] == table
    assert call("show", "runs/nothing.h5").exit_code == 2
    study = call("show", small_study)
    assert study.exit_code == 2 and "is a study" in study.stderr


def test_too_few_trials_are_said_to_be(small_study):
    shown = call("run", small_study).output
    assert "needs 368" in shown  # the 99 % quantile


@pytest.mark.parametrize(
    "arguments", [["run"], ["run", "x.toml", "--trials", "0"], ["fly"]]
)
def test_wrong_usage(arguments):
    assert call(*arguments).exit_code == 2


def test_the_installed_command(small_study):
    found = subprocess.run(
        [TOLSTAT, "run", small_study, "--trials", "8"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert found.returncode == 0, found.stderr
    assert "stored in" in found.stderr
