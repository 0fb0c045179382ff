"""`tolstat doctor` of a model: healthy ones, and what it finds in others."""

from __future__ import annotations

import contextlib
import re

import pytest
from click.testing import CliRunner

from tests.conftest import ROOT
from tolstat.cli.main import main

BAD = """
from dataclasses import dataclass
import numpy as np
from tolstat import Contributor, Description, Model, Outcome, Response, setting
from tolstat.moving import Accuracy, System, compiled, integrate, rates_signature
from tolstat.moving import rows, write

@compiled(rates_signature)
def rates(moment, y, p, out):
    x, v = rows(y)[0], rows(y)[1]
    write(out, 0, (v, v * v * v, x))

SYSTEM = System(rates, np.array([1.0, 1.0]), n_extremes=1)

class Shared(Model):
    name, title = "shared", "depends on the block"
    def describe(self, settings):
        return Description((Contributor("a", "m", "a"),), (Response("x", "m", "x"),))
    def evaluate(self, deviations, settings):
        return Outcome(deviations - deviations.mean(axis=0))

@dataclass(frozen=True)
class Settings:
    rtol: float = setting(1e-6, "integration tolerance", above=0.0)

class Explodes(Shared):
    name, title, settings = "explodes", "has no answer after 0.5 s", Settings
    def evaluate(self, deviations, settings):
        n = len(deviations)
        ends = np.tile([0.0, 1.0], (n, 1))  # of state and of time
        found = integrate(SYSTEM, ends, deviations, ends, Accuracy(settings.rtol, 0.1))
        return Outcome(found.peak, found.status, found.steps)

@compiled(rates_signature)
def relaxing(moment, y, p, out):
    write(out, 0, (np.cos(rows(moment)[0]) - 1e6 * rows(y)[0],))

class Stiff(Shared):
    name, title, settings = "stiff", "relaxes in 1 us", Settings
    def evaluate(self, deviations, settings):
        n = len(deviations)
        ends = np.tile([0.0, 1.0], (n, 1))
        accuracy = Accuracy(settings.rtol, 0.1, 2000)
        system = System(relaxing, np.array([1e-6]))
        found = integrate(system, ends[:, :1], deviations, ends, accuracy)
        return Outcome(found.states[:, -1], found.status, found.steps)

@compiled(rates_signature)
def beside(moment, y, p, out):
    x, turns = rows(y), rows(moment)[0] / 0.137
    write(out, 0, (-0.1 * x[0], np.where(turns - np.floor(turns) < 0.07, 1e4, 0.0)))

class Beside(Model):
    name, title, settings = "beside", "pushes of what is no response", Settings
    def describe(self, settings):
        d, end = Contributor("d", "1", "d"), Response("end", "1", shown="1")
        return Description((d,), (end,))
    def evaluate(self, deviations, settings):
        n = len(deviations)
        ends = np.tile([0.0, 20.0], (n, 1))
        accuracy = Accuracy(settings.rtol, 0.1)
        starts = np.hstack([1.0 + deviations, 0.0 * deviations])
        system = System(beside, np.array([1.0, 1.0]))
        found = integrate(system, starts, deviations, ends, accuracy)
        return Outcome(found.states[:, -1, :1], found.status, found.steps)
"""


MODELS = ROOT / "tests" / "execution" / "short_events.py"
STUDY = """
model = "{}"
trials = 100
seed = 1
[settings]
{}
[deviations]
d = "+-10 %"
[limits]
end = "{}"
"""


@pytest.fixture
def call(tmp_path):
    (tmp_path / "bad.py").write_text(BAD)

    def called(*words, code=0):
        with contextlib.chdir(tmp_path):
            done = CliRunner().invoke(main, words)
        assert done.exit_code == code, done.output
        return " ".join(done.output.split())

    return called


def test_an_answer_that_depends_on_its_block(call):
    found = call("doctor", "bad.py:Shared", code=3)
    assert "alone and in a block: different" in found and "none are integrated" in found


def test_where_an_integration_ends(call, tmp_path):
    found = call("doctor", "bad.py:Explodes", code=3)
    assert "3 step too small" in found
    assert "A trial ended at 0.5 s by the error of state 2 of 2" in found
    (tmp_path / "bad.toml").write_text(
        'model = "explodes"\ntrials = 4\nseed = 1\n[deviations]\na = "+-1 mm"\n'
    )
    machine = ("--machine", "bad.py:Explodes")
    said = call("run", "bad.toml", *machine, code=1)
    assert "all trials of the first block fail (4; step too small)" in said
    assert "ended at 0.5 s by the error of state 2 of 2" in said
    found = call("trial", "bad.h5", "2", *machine)
    assert "ended at 0.5 s by the error of state 2 of 2" in found


def test_a_run_that_stops_says_that_the_equations_are_stiff(call, tmp_path):
    (tmp_path / "stiff.toml").write_text(
        'model = "stiff"\ntrials = 4\nseed = 1\n[deviations]\na = "+-1 mm"\n'
    )
    said = call("run", "stiff.toml", "--machine", "bad.py:Stiff", code=1)
    assert "all trials of the first block fail (4; too many steps)" in said
    assert "The equations are stiff: state 1 relaxes at 1e+06 1/s" in said


def test_of_a_new_model_and_a_study(call, tmp_path):
    call("new", "--model", "crank.py")
    found = call("doctor", "crank.py:Crank")
    assert "3 done" in found and "Accuracy decides" in found
    assert "a branch" not in found
    assert re.search(r"largest error, in units of rtol: \w+ [\d.e-]+, \w+ ", found)
    call("new", "crank", "--machine", "crank.py:Crank", "-o", "crank.toml")
    study = tmp_path / "crank.toml"
    short = re.sub('max_step = "[^"]*"', 'max_step = "1 ms"', study.read_text())
    study.write_text(short)
    found = call("doctor", "crank.toml", "--machine", "crank.py:Crank")
    assert "3 done" in found and "The longest step decides" in found
    assert "no model is called 'crunk'" in call("doctor", "crunk", code=2)


@pytest.mark.parametrize(
    ("name", "limit"),
    [("Pulse", ">= 0.3"), ("Controller", "<= 0.5"), ("Tooth", ">= 0.5"),
     ("Brush", "<= 0.8")],
)  # fmt: skip
def test_an_event_that_steps_miss(call, tmp_path, name, limit):
    """It is not called stiff; what the audit would see is said."""
    study, machine = tmp_path / "study.toml", ("--machine", f"{MODELS}:{name}")
    study.write_text(STUDY.format(name.lower(), "", limit))
    said = call("doctor", "study.toml", *machine, code=1)
    assert "would leave end undecided" in said and "stiff" not in said
    assert "evaluated a third time" in said or "evaluated again moved" in said


def test_a_jump_that_the_response_does_not_see_leaves_it_undecided_too(call, tmp_path):
    """As in the report of a run."""
    (tmp_path / "study.toml").write_text(STUDY.format("beside", "", "<= 2"))
    said = call("doctor", "study.toml", "--machine", "bad.py:Beside", code=1)
    assert "would leave end undecided: rates jump inside steps" in said


def test_smooth_equations_are_healthy(call, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY.format("swing", "", "<= 1"))
    said = call("doctor", "study.toml", "--machine", f"{MODELS}:Swing")
    assert "undecided" not in said and "stiff" not in said


SAMPLED = """
from tolstat.moving import Motion, Part, Response, State, held

class Sampled(Motion):
    lasts = 1.0
    x = State("m", start=1.0)
    k = Part(2.0, "1/s")
    end = Response.end("m")

    def motion(self, t, y, p):
        return {"x": -p.k * held(y.x, every=2e-3), "end": y.x}
"""


def test_steps_that_samples_end_are_not_saved_by_rtol(call, tmp_path):
    (tmp_path / "sampled.py").write_text(SAMPLED)
    said = call("doctor", "sampled.py:Sampled")
    assert "a larger rtol saves steps" not in said and "end at samples" in said
    assert "x 1 1 100 event 1 1 1 100" in said
