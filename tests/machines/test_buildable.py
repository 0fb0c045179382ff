"""Impossible trials: each has a status and no numbers; studies are warned."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

import tolstat
from tests.conftest import ROOT, Toy
from tolstat import (
    Axis,
    Chart,
    Curve,
    History,
    Listing,
    Mark,
    Offer,
    Outcome,
    catalogue,
)
from tolstat.cli.main import main
from tolstat.errors import ModelError, StudyError
from tolstat.execution.execute import Progress
from tolstat.model.checked import check_model, described, impossible, simulate
from tolstat.model.checked_views import checked_view, history_of
from tolstat.model.settings import make
from tolstat.status import words_of

LENGTH = 2.45 - 0.35  # m, of the stand's rods less its cranks

# machine, deviations, and the word that its trial ends with
CANNOT_BE = [
    ("stand", {"carriage_mass": -1.5}, "no part left"),
    ("stand", {"carriage_mass": -1.0}, "no part left"),
    ("stand", {"rod_length_2": -2.5}, "no part left"),
    ("stand", {"friction": -1.01}, "no part left"),
    ("stand", {"rolling_force": -1.01}, "no part left"),
    ("stand", {"guide_clearance": -2.5e-3}, "no part left"),
    ("stand", {"crank_radius": 4.0}, "rod too short"),
    ("stand", {"crank_radius": LENGTH - 0.279}, "rod too short"),
    ("stand", {"rod_length_1": 0.9}, "does not fit"),
    ("stand", {"runout_7": 512.0}, "off its axis"),
    ("stand", {"runout_11": -0.22}, "off its axis"),
    ("planetary", {"helix_error_2": 1.4}, "does not mesh"),
    ("planetary", {"centre_distance": 6e-3}, "does not mesh"),
    ("planetary", {"position_error_1": 0.1}, "does not mesh"),
    ("planetary", {"tooth_thickness_3": -5e-3}, "no tooth left"),
    ("elastic_machine", {"inertia_1": -1.0}, "cannot exist"),
    ("rolling_block", {"stiffness_46": -1.5}, "cannot exist"),
    ("rolling_block", {"damping": -1.5}, "cannot exist"),
]
CAN_BE = [
    ("stand", {"crank_radius": LENGTH - 0.281}),
    ("stand", {"friction": -1.0, "rolling_force": -1.0, "shaft_12_stiffness": -1.0}),
    ("stand", {"carriage_mass": -0.99, "runout_7": -0.5}),
    ("planetary", {"centre_distance": 4e-3, "tooth_thickness": -1e-3}),
    ("elastic_machine", {"inertia": -0.99, "damping": -1.0}),
    ("rolling_block", {"damping": -1.0, "stiffness": 20.0}),
]


def table_of(name, deviations):
    machine = catalogue.find(name)
    settings = make(machine)
    names = [each.name for each in described(machine, settings).contributors]
    row = np.zeros((1, len(names)))
    for given, value in deviations.items():
        row[0, [n == given or n.rpartition("_")[0] == given for n in names]] = value
    assert np.any(row)
    return machine, settings, row


@pytest.mark.parametrize(("name", "deviations", "word"), CANNOT_BE)
def test_impossible_trials_have_a_status(name, deviations, word):
    machine, settings, row = table_of(name, deviations)
    answers = simulate(machine, row, settings)
    assert words_of(machine.failures)[int(answers.status[0])] == word
    assert np.isnan(answers.responses).all()
    assert answers.steps is None or answers.steps[0] == 0
    assert word in machine.failures


@pytest.mark.parametrize(("name", "deviations"), CAN_BE)
def test_possible_trials_are_not_ruled_out(name, deviations):
    machine, settings, row = table_of(name, deviations)
    assert impossible(machine, row, settings).tolist() == [0]


@pytest.mark.parametrize("name", catalogue.names())
def test_every_model_declares_its_possible_parts(name):
    machine = catalogue.find(name)
    assert machine.failures
    page = CliRunner().invoke(main, ["show", name]).output.replace("\n", " ")
    for word in machine.failures:
        assert f"a trial may end as: {word} (required: " in page


def test_a_chain_that_does_not_close():
    links = {
        n: {"nominal": (x, "m")} for n, x in {"hypotenuse": 0.05, "leg": 0.04}.items()
    }
    given = {"links": links, "gap": "sqrt(hypotenuse**2 - leg**2)"}
    rows = tolstat.evaluate("dimension_chain", {"leg": [0.0, 0.011]}, given)
    assert list(rows["status"]) == ["done", "the formula has no value"]


def test_impossible_trials_do_not_change_others_and_are_replayed(tmp_path):
    """Deviations of 150 %: some carriages weigh less than nothing."""
    study = {
        "model": "stand", "trials": 150, "seed": 3,
        "deviations": {"carriage_mass": "+-150 %"},
        "settings": {"settle": 0, "cycles": 1},
    }  # fmt: skip
    told: list[Progress] = []
    run = tolstat.run(study, output=tmp_path / "light.h5", progress=told.append)
    mass = run.column("carriage_mass")
    word = "no part left"
    count = np.count_nonzero(mass <= -1)
    assert run.failures[word] == count > 0
    np.testing.assert_array_equal(run.frame()["status"] == word, mass <= -1)
    # told before any trial has run; what is kept are the trials that failed
    first = told[0]
    assert first.over == 0 and f"{count} of 150 trials (" in first.warning
    assert f"{word} (rods, cranks" in first.warning and not run.notes
    assert all(not progress.warning for progress in told[1:])
    # a machine that can be is as it is alone
    heavy = mass > -1
    some = np.flatnonzero(heavy)[:3]
    alone = tolstat.evaluate(
        "stand", {"carriage_mass": mass[some]}, {"settle": 0, "cycles": 1}
    )
    np.testing.assert_array_equal(alone["yaw"], run.column("yaw")[some])
    light = int(np.flatnonzero(~heavy)[0])
    assert tolstat.replay(run, light).differences == ()


def test_a_study_without_possible_trials_is_refused(tmp_path):
    study = tmp_path / "long.toml"
    study.write_text(
        'model = "stand"\ntrials = 8\nseed = 1\n[deviations]\n'
        'crank_radius = { distribution = "constant", value = "+4 m" }\n'
    )
    said = CliRunner().invoke(main, ["run", str(study)])
    assert said.exit_code == 2 and not study.with_suffix(".h5").exists()
    assert "long.toml: none of the 8 trials can be built: rod too short (each" in (
        said.stderr
    )


def test_the_share_is_printed_on_the_command_line(tmp_path):
    study = tmp_path / "light.toml"
    study.write_text(
        'model = "oscillator"\ntrials = 300\nseed = 1\n[deviations]\nmass = "+-150 %"\n'
    )
    place = f"{ROOT / 'runs' / 'own' / 'oscillator.py'}:Oscillator"
    said = CliRunner().invoke(main, ["run", str(study), "--machine", place])
    assert "of 300 trials (" in said.stderr and "%) cannot be built" in said.stderr
    assert "cannot be built (mass and stiffness are above 0" in said.stderr


def test_a_stand_that_loses_more_than_it_is_driven_with():
    """Rods 0.6 m apart: the start-up releases what mounting took."""
    found = tolstat.evaluate("stand", {"rod_length_1": 0.6})
    assert found["status"][0] == "loses too much"
    assert np.isnan(found["extra_loss_run"][0])


def test_a_history_that_is_not_requested():
    with pytest.raises(
        ModelError, match="more than 2000000 points; give a longer step"
    ):
        tolstat.trajectory("stand", step=1e-6)


class Nominal(Toy):
    """A machine that cannot be built without deviations."""

    failures = {"too short": "its parts are longer than 0.1 mm together"}

    def impossible(self, deviations, settings):
        return {"too short": deviations[:, :2].sum(axis=1) < 1e-4}

    def evaluate(self, deviations, settings):
        assert not self.impossible(deviations, settings)["too short"].any()
        return Outcome(np.stack([deviations[:, 0], deviations[:, 1]], axis=1))


def test_an_impossible_nominal_is_refused(toy_study):
    text = toy_study.read_text()
    with pytest.raises(StudyError, match=r"nominal trial .* too short \(its parts"):
        tolstat.run(toy_study, model=Nominal())
    assert toy_study.read_text() == text


def test_impossible_trials_are_never_evaluated():
    rows = tolstat.evaluate(Nominal(), {"part_1": [0.0, 1e-3, 0.0], "part_2": 1e-5})
    assert list(rows["status"]) == ["too short", "done", "too short"]
    assert rows["gap"].tolist()[1] == 1e-3 and rows["gap"].isna().tolist()[0]


def first_part(deviations, settings):
    """List what it is given."""
    return Listing.of("a machine", ("part_1", "m", "", deviations[:, 0]))


ROWS = Offer("rows", "deviations of the first part", first_part, 4)


class Shown(Nominal):
    """A machine that moves."""

    def impossible(self, deviations, settings):
        return {"too short": deviations[:, 0] < -1e-4}

    def history(self, deviations, settings, step):
        curve = Curve("gap", "m", "", "", np.full(3, deviations[0]))
        marks = (Mark("gap", 0.0, 0.0),)
        chart = Chart(Axis("time", "s"), np.arange(3.0), (curve,), marks=marks)
        return History(chart, self.evaluate(deviations[None], settings))


def test_impossible_trials_are_in_no_view():
    rows = np.zeros((4, 2))
    rows[:, 0] = 1e-3, -2e-3, 3e-3, -4e-3
    (found,) = checked_view(Shown(), ROWS, rows, None).values
    assert found.tolist() == [1e-3, 3e-3]
    with pytest.raises(ModelError, match="cannot be built: too short"):
        checked_view(Shown(), ROWS, rows[1:], None)


def test_the_history_of_an_impossible_trial_is_empty():
    chart, answers = history_of(Shown(), np.array([-2e-3, 0.0]), None, 0.1)
    assert np.isnan(chart.curves[0].values).all() and not chart.marks
    assert words_of(Shown.failures)[int(answers.status[0])] == "too short"
    chart, answers = history_of(Shown(), np.array([2e-3, 0.0]), None, 0.1)
    assert chart.curves[0].values.tolist() == 3 * [2e-3] and chart.marks
    assert answers.responses[0, 0] == 2e-3


@pytest.mark.parametrize("failures", [{"too long": ""}, {"too long": None}, ("x",)])
def test_each_failure_has_a_sentence(failures):
    class Wrong(Toy):
        pass

    Wrong.failures = failures
    with pytest.raises(ModelError, match="to the sentence that has to be true"):
        check_model(Wrong())


def test_impossible_trials_are_named_as_failures():
    class Unknown(Nominal):
        def impossible(self, deviations, settings):
            return {"too long": deviations[:, 0] > 0}

    with pytest.raises(ModelError, match="'too long' is not in its failures"):
        tolstat.evaluate(Unknown(), {"part_1": 1e-3})
