"""An event shorter than a step: the audit finds it, and the verdict says so."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import tolstat
from tolstat import Contributor, Description, Model, Outcome, Response, setting
from tolstat.moving import (
    Accuracy,
    System,
    compiled,
    integrate,
    rates_signature,
    rows,
    write,
)

AT, LASTS, HORIZON = 5.0, 1e-3, 10.0  # s


@compiled(rates_signature)
def rates(moment, y, p, out):
    """A mass of 1 kg on a spring: it is hit once, between two marks."""
    time, state, machine = rows(moment)[0], rows(y), rows(p)
    x, v, stiffness, force = state[0], state[1], machine[0], machine[1]
    hit = np.where((time >= AT) & (time < AT + LASTS), force, 0.0)
    write(out, 0, (v, hit - stiffness * x - 0.2 * v, x))


SYSTEM = System(rates, np.array([1.0, 1.0]), n_extremes=1)


@dataclass(frozen=True)
class Settings:
    rtol: float = setting(1e-6, "integration tolerance", above=0.0)
    max_step: float = setting(0.1, "longest step", unit="s", above=0.0)
    start: float = setting(0.01, "displacement at the start", unit="m")


class Hit(Model):
    name = "hit"
    settings = Settings

    def describe(self, settings):
        part = Contributor("stiffness", "1")
        return Description((part,), (Response("peak", "m"),))

    def evaluate(self, deviations, settings):
        n = len(deviations)
        p = np.column_stack([1.0 + deviations[:, 0], np.full(n, 1000.0)])
        found = integrate(
            SYSTEM, np.tile([settings.start, 0.0], (n, 1)), p,
            np.tile([0.0, HORIZON], (n, 1)), Accuracy(settings.rtol, settings.max_step),
        )  # fmt: skip
        return Outcome(found.peak, found.status, found.steps)


class Unsettled(Hit):
    """The same without a setting for the longest step."""

    def tightened(self, settings):
        return None


@dataclass(frozen=True)
class Amplitude:
    amplitude: float = setting(1.0, "how far it swings", unit="m")


class Swinging(Hit):
    """It moves, and how it is integrated is its own affair."""

    settings = Amplitude

    def evaluate(self, deviations, settings):
        return Outcome(settings.amplitude * (1.0 + deviations))

    def history(self, deviations, settings, step):
        raise NotImplementedError


STUDY = {
    "model": "hit", "trials": 2000, "seed": 1, "settings": {},
    "deviations": {"stiffness": "+-5 %"}, "limits": {"peak": "<= 0.2 m"},
}  # fmt: skip


def notes_of(run):
    return tolstat.summary(run).trials.notes


def ran(folder, model=Hit, **settings):
    study = {**STUDY, "settings": settings}
    folder.mkdir(exist_ok=True)
    return tolstat.run(study, model=model(), output=folder / "hit.h5", progress=None)


@pytest.mark.parametrize("start", ["0 m", "10 mm"])
def test_an_event_shorter_than_a_step_is_found(tmp_path, start):
    """At rest steps are the longest, and equal in all trials: all miss the hit."""
    run = ran(tmp_path, start=start)
    found = tolstat.summary(run).limits["peak"].yields
    truth = LASTS * 1000.0  # the speed it has then, so nearly the amplitude, m
    assert run.audited.responses["peak"].max() == pytest.approx(truth, rel=0.15)
    assert found.verdict == "undecided" and found.reason == "integration error"


def test_steps_that_meet_the_event_decide(tmp_path):
    run = ran(tmp_path, max_step="0.5 ms")
    found = tolstat.summary(run).limits["peak"].yields
    assert found.verdict == "not met" and found.reason == ""
    assert run.audited.settings == pytest.approx({"rtol": 1e-9, "max_step": 1.25e-4})


def test_a_model_without_tighter_settings_is_not_audited(tmp_path):
    (said,) = [n for n in notes_of(ran(tmp_path, Unsettled)) if "not audited" in n]
    assert said == (
        "integration errors are not audited: the model has no tighter settings"
    )
    assert not any("not audited" in n for n in notes_of(ran(tmp_path / "a")))


def test_a_model_that_moves_without_rtol_is_not_audited(tmp_path):
    run = ran(tmp_path, Swinging, amplitude="1 m")
    (said,) = [n for n in notes_of(run) if "not audited" in n]
    assert said.endswith("the model moves, but has no setting rtol")


def test_a_closed_form_needs_no_audit(tmp_path):
    run = tolstat.run("runs/stack-up.toml", trials=100, output=tmp_path / "gap.h5")
    assert not any("audit" in n for n in notes_of(run))
