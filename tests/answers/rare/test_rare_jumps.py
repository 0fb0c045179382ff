"""Rare runs of custom models that jump: a turn has no verdict, play keeps its own."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tolstat
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.answers.next_steps import StepKind
from tolstat.answers.run_entries import judged
from tolstat.cli.check import checked
from tolstat.deviations.samplers import DISTANCE
from tolstat.statistics.limits.yields import JUMP
from tolstat.status import Status

TURN = 2 * math.pi


class Phase(Model):
    """A phase of some mean and of sigma 0.01, wrapped in four ways; a play."""

    name = "phase"

    def describe(self, settings):
        parts = tuple(Contributor(f"part_{i}", "m") for i in (1, 2))
        angles = (Response(name, "rad") for name in ("turn", "half", "axis"))
        return Description(parts, (
            *angles, Response("degrees", "1", shown="1"), Response("play", "m"),
        ))  # fmt: skip

    def evaluate(self, deviations, settings):
        first, second = deviations.T / 0.1e-3 * 0.03
        x = 0.8 * first + 0.6 * second  # sigma 0.01
        phase = x + self.mean
        play = 0.1 * x + 0.05 * np.sign(x)
        return Outcome(np.stack([
            np.mod(phase, TURN), np.arctan(np.tan(phase + math.pi / 2)),
            0.5 * np.angle(-np.exp(2j * phase)), np.degrees(np.mod(phase, TURN)), play,
        ], axis=1))  # fmt: skip

    def __init__(self, mean=0.0):
        self.mean = mean


# a limit at which a phase that is not wrapped has no trial out of it
LIMITS = {
    "turn": ("<= 0.1 rad", 1.0), "half": (">= 1.4 rad", 0.5),
    "axis": (">= 1.4 rad", 0.5), "degrees": ("<= 6", 1.0),
}  # fmt: skip


def rare(folder, response, limit, mean=0.0):
    study = {
        "model": "phase", "trials": 6000, "seed": 1, "sampling": "rare",
        "deviations": {"part": "+-0.1 mm"},
        "limits": {response: {"limit": limit, "ppm": 100}},
    }  # fmt: skip
    return tolstat.run(study, model=Phase(mean), output=folder / "rare.h5")


@pytest.mark.parametrize("response", LIMITS)
def test_a_rare_response_that_jumps_by_a_turn_is_undecided(tmp_path, response):
    limit, turns = LIMITS[response]
    run = rare(tmp_path, response, limit)
    found = tolstat.report(run)
    (jump,) = (each for each in found.warnings if each.kind == "jump")
    beside = run.column(DISTANCE) > 0  # the median trial lies on the step
    values = run.column(response)[beside & (run.status == Status.DONE)]
    split = (jump.clusters.lower + jump.clusters.upper) / 2
    assert jump.clusters.turn == turns
    assert jump.clusters.below == np.sum(values < split)
    assert jump.clusters.step == pytest.approx(
        360 if response == "degrees" else TURN * turns, rel=1e-3
    )
    assert (found.verdict, found.reason) == ("undecided", JUMP)
    assert {n: x.words for n, x in judged(run).items()} == {response: found.words}
    check = checked([run])
    assert check.exit_code == 4 and "jumps by" in check.warnings[-1]
    assert '"kind": "jump"' in found.json()
    page = found.html()
    assert page.index("jumps by") < page.index("The limit is")


def test_a_phase_far_from_its_cut_keeps_its_verdict(tmp_path):
    found = tolstat.report(rare(tmp_path, "turn", "<= 1.045 rad", mean=1.0))
    assert found.verdict == "met" and not found.warnings


def test_play_may_be_physics(tmp_path):
    """Its step of 0.1 m is said; the verdict stands, and no word that it is wrong."""
    found = tolstat.report(rare(tmp_path, "play", "<= 0.04 m"))
    (jump,) = (each for each in found.warnings if each.kind == "jump")
    assert jump.clusters.turn == 0 and found.verdict == "not met"
    study = {
        "model": "phase", "trials": 500, "seed": 1,
        "deviations": {"part": "+-0.1 mm"}, "limits": {"play": "<= 40 mm"},
    }  # fmt: skip
    run = tolstat.run(study, model=Phase(), output=tmp_path / "plain.h5")
    plain = tolstat.report(run)
    assert plain.verdicts == {"play": "not met"}
    (jump,) = plain.warnings
    assert jump.clusters.step == pytest.approx(0.1, rel=1e-6)
    words = " ".join(plain.html().split())
    assert "no tolerance explains it" not in words
    assert "If the machine does not jump so" in words
    step, *_ = plain.findings.steps
    assert (step.kind, step.responses) == (StepKind.CHECK_FORMULA, ("play",))
