"""Responses of custom models that jump: what the report says, and what it withholds."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tolstat
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.statistics.limits.yields import JUMP

TURN = 2 * math.pi


class Angle(Model):
    """An angle that is wrapped, and responses beside it."""

    name = "angle"

    def describe(self, settings):
        parts = tuple(Contributor(f"part_{i}", "m") for i in (1, 2))
        return Description(parts, (
            Response("angle", "rad"), Response("degrees", "1", shown="1"),
            Response("branch", "m"), Response("jam", "N", range=(0, math.inf)),
            Response("count", "1", shown="count"),
        ))  # fmt: skip

    def evaluate(self, deviations, settings):
        first, second = deviations.T / 0.1e-3  # three sigma are 1
        angle = 0.03 * first + 0.01 * second + (math.pi - self.before)
        angle = (angle + math.pi) % TURN - math.pi
        branch = 1e-3 * first + 20e-3 * (first + second > 0.5)
        jam = np.where(first + second > 0.9, 500 + 100 * second**2, 0.0)
        responses = angle, np.degrees(angle), branch, jam, np.round(3 * first)
        return Outcome(np.stack(responses, axis=1))

    def __init__(self, before=0.0):
        self.before = before


LIMITS = {
    "angle": ">= 175 deg", "degrees": ">= 175", "branch": "<= 10 mm",
    "jam": "<= 10 N", "count": "<= 2",
}  # fmt: skip


def reported(folder, model, trials=2000):
    study = {
        "model": "angle", "trials": trials, "seed": 1, "limits": LIMITS,
        "deviations": {"part": "+-0.1 mm"},
    }  # fmt: skip
    run = tolstat.run(study, model=model, output=folder / "angle.h5", force=True)
    return tolstat.report(run)


# share of trials behind the cut, by the distance of the nominal angle before it
@pytest.mark.parametrize("before", [0.0, 0.02, -0.015, 0.03])
def test_an_angle_that_wraps_has_neither_verdict_nor_advice(tmp_path, before):
    report = reported(tmp_path, Angle(before))
    jumps = {each.response: each.clusters for each in report.warnings}
    assert set(jumps) >= {"branch"} and set(jumps) <= {"angle", "degrees", "branch"}
    behind = np.sum(report.stored_run.column("angle") < 0)
    assert ("angle" in jumps) == (behind > 0) and ("degrees" in jumps) == (behind >= 5)
    for name in jumps:
        each = report.responses[name]
        assert each.causes.main is None and report.findings.remedy is None
        if name != "branch":
            assert jumps[name].turn and jumps[name].below == behind
            assert each.limited.yields.verdict == "undecided"
            assert each.limited.yields.reason == JUMP
    # a branch of the model may be meant: its verdict stands, with the warning
    assert not jumps["branch"].turn
    assert jumps["branch"].step == pytest.approx(20e-3, rel=1e-6)
    assert report.verdicts["branch"] == "not met"
    for name in ("jam", "count"):
        assert not report.responses[name].limited.yields.reason


def test_warnings_are_in_json_and_in_front(tmp_path):
    report = reported(tmp_path, Angle(), trials=300)
    assert '"kind": "jump"' in report.json()
    page = report.html()
    assert page.index("jumps by a whole turn") < page.index("Yield, all limits")
