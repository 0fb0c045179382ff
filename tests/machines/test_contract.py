"""The contract: every model of the catalogue keeps it; violations are named."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

import h5py
import numpy as np
import pytest

import tolstat
from tests.conftest import ROOT, Toy
from tests.model.rich import Rich
from tolstat import Contributor, Description, Model, Outcome, Response, catalogue
from tolstat.errors import ModelError, StudyError
from tolstat.model.checked import described, simulate
from tolstat.model.checked_views import offers
from tolstat.model.settings import make, settings_of
from tolstat.status import Status, words_of

# the model of results evaluates nothing: tests/study/test_results.py
MACHINES = [*(n for n in catalogue.names() if n != "results"), Toy(), Rich()]


@pytest.fixture(params=MACHINES, ids=lambda one: getattr(one, "name", one))
def machine(request):
    return catalogue.find(request.param)


def usual(machine, trials):
    """Deviations far smaller than any part."""
    n = len(described(machine, make(machine)).contributors)
    found = 1e-6 * np.random.default_rng(5).uniform(-1, 1, (trials, n))
    # play is never negative
    names = [each.name for each in described(machine, make(machine)).contributors]
    loose = [name.startswith("joint_clearance") for name in names]
    return np.where(loose, np.abs(found), found)


def test_a_model_describes_itself(machine):
    assert machine.title and machine.name.isidentifier()
    description = described(machine, make(machine))
    for each in (*description.contributors, *description.responses):
        assert each.unit
    for each in settings_of(machine).values():
        assert each.sentence and each.kind.words(each.default) and each.kind.allowed


def test_the_nominal_and_nearby_trials_have_responses(machine):
    settings = make(machine)
    deviations = usual(machine, 20)
    deviations[0] = 0.0
    outcome = simulate(machine, deviations, settings)
    n = len(described(machine, settings).responses)
    assert outcome.responses.shape == (20, n)
    assert (outcome.status == Status.DONE).all()
    assert np.isfinite(outcome.responses).all()
    assert (outcome.steps is not None) == machine.integrates


def test_a_trial_does_not_depend_on_its_neighbours(machine):
    settings, deviations = make(machine), usual(machine, 13)
    whole = simulate(machine, deviations, settings)
    for rows in (slice(0, 1), slice(3, 12), slice(None, None, -1)):
        part = simulate(machine, deviations[rows], settings)
        np.testing.assert_array_equal(part.responses, whole.responses[rows])
        np.testing.assert_array_equal(part.status, whole.status[rows])


def test_declared_views_are_shown(machine):
    for name in offers(machine):
        frame = tolstat.view(machine, name).frame()
        assert len(frame) > 1 and frame.attrs["units"]


def test_tightened_settings_differ_or_are_none(machine):
    settings = make(machine)
    tight = machine.tightened(settings)
    assert tight is None or (type(tight) is type(settings) and tight != settings)


def test_the_digest_is_of_the_source_of_this_model_only(tmp_path):
    """A word in another machine must not orphan stored runs."""
    shutil.copytree(ROOT / "tolstat", tmp_path / "tolstat")
    shutil.copy(ROOT / "runs" / "own" / "stack.py", tmp_path)
    other = tmp_path / "tolstat" / "machines" / "another" / "machine.py"
    other.parent.mkdir()
    other.write_text("")

    code = (
        "import sys\n"
        "from tolstat import catalogue\n"
        "from tolstat.lanes import digest\n"
        "stand, stack = catalogue.find('stand'), catalogue.load('stack.py:Stack')\n"
        "for _ in sys.stdin:\n"
        "    digest.digest.cache_clear()\n"  # as if started anew
        "    print(stand.source_digest, stack.source_digest, flush=True)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )  # fmt: skip

    def digests():
        process.stdin.write("\n")
        process.stdin.flush()
        return process.stdout.readline().split()

    def changed(path, before="\n\n\n", after="\n\n\n# a word\n"):
        text = path.read_text()
        assert before in text
        path.write_text(text.replace(before, after))
        return digests()

    before = digests()
    assert before[0] != before[1]
    package = tmp_path / "tolstat"
    assert changed(other, "", "x = 1\n") == before
    assert changed(package / "render" / "picture.py") == before
    assert changed(package / "integrator" / "step.py") == before
    stand = changed(package / "machines" / "stand" / "declarations.py", "7.5", "7.6")
    assert stand[0] != before[0] and stand[1] == before[1]
    stack = changed(tmp_path / "stack.py", "gap < 0", "gap <= 0")
    assert stack[0] == stand[0] and stack[1] != stand[1]
    integrator = changed(package / "integrator" / "step.py", "SAFETY = ", "SAFETY = -")
    assert integrator[0] != stack[0] and integrator[1] == stack[1]  # it does not move
    engine = changed(package / "model" / "checked.py", "status == 0)", "status < 1)")
    assert engine[0] != integrator[0] and engine[1] != integrator[1]
    process.communicate()
    assert process.returncode == 0


class Liar(Model):
    """Answers whatever it is told to."""

    name = "liar"

    def __init__(self, answer, responses=("y", "z")):
        self.answer, self.names = answer, responses

    def describe(self, settings):
        names = self.names
        return Description(
            (Contributor("x", "m"),), tuple(Response(n, "m") for n in names)
        )

    def evaluate(self, deviations, settings):
        return self.answer(len(deviations))


LIES = [
    (lambda n: Outcome(np.zeros((3, 2))), "18 x 2 numbers are expected, .* these are 3 x 2"),
    (lambda n: Outcome(np.zeros(n)), "18 x 2 numbers are expected"),
    (lambda n: Outcome(np.zeros((n, 3))), "these are 18 x 3"),
    (lambda n: Outcome([["a", "b"]] * n), "responses are not real numbers"),
    (lambda n: np.zeros((n, 2)), "returns ndarray, not Outcome"),
    (lambda n: None, "returns NoneType, not Outcome"),
    (lambda n: Outcome(np.full((n, 2), np.nan), np.ones(n)), "y is nan in a trial whose"),
    (lambda n: Outcome(np.full((n, 2), np.inf), np.ones(n)), "y is inf in a trial whose"),
    (lambda n: Outcome(np.zeros((n, 2)), np.ones(3)), "status of 18 numbers"),
    (lambda n: Outcome(np.zeros((n, 2)), np.full(n, 7)), r"cannot end with status \[7\]"),
    (lambda n: Outcome(np.zeros((n, 2)), np.zeros(n)), "0, not run"),
    (lambda n: Outcome(np.zeros((n, 2)), np.ones(n), np.ones(n)), "returns steps; this needs a setting rtol"),
    (lambda n: Outcome(np.zeros((n, 2)), failed={"tired": np.ones(n)}), "'tired' is not in"),
]  # fmt: skip


@pytest.mark.parametrize(("answer", "words"), LIES)
def test_a_model_that_breaks_the_contract_is_named(answer, words, tmp_path):
    with pytest.raises(ModelError, match=f"model 'liar'.*{words}"):
        simulate(Liar(answer), np.zeros((18, 1)), None)
    study = {"model": "liar", "trials": 18, "seed": 1}
    with pytest.raises(ModelError, match="model 'liar'"):
        tolstat.run(study, model=Liar(answer), output=tmp_path / "liar.h5")


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (("gap width",), "'gap width' cannot be typed"),
        (("1st",), "'1st' cannot be typed"),
        (("",), "cannot be typed"),
        (("trial",), "name trial is reserved"),
        (("status", "y"), "name status is reserved"),
        (("diagnostics",), "name diagnostics is reserved"),
        (("y", "y"), "y is given twice"),
        (("x",), "x is given twice"),
        ((), "no response"),
    ],
)
def test_names_are_checked_before_anything_runs(names, words):
    study = {"model": "liar", "trials": 18, "seed": 1}
    with pytest.raises(StudyError, match=words):
        tolstat.run(study, model=Liar(None, names), output="never.h5")


def test_units_are_checked_too():
    class Odd(Toy):
        def describe(self, settings):
            return Description((), (Response("y", "m", shown="kN"),))

    with pytest.raises(ModelError, match="response y: 'kN' is of another kind"):
        described(Odd(), None)


class Share(Toy):
    """Declares a range."""

    def __init__(self, ends, value=0.5):
        self.ends, self.value = ends, value

    def describe(self, settings):
        return Description((), (Response("y", "1", range=self.ends),))

    def evaluate(self, deviations, settings):
        return Outcome(np.full((len(deviations), 1), self.value))


@pytest.mark.parametrize("ends", [(1.0, 0.0), (0.0,), "0..1", (0.0, np.nan), 3])
def test_a_range_is_two_numbers(ends):
    with pytest.raises(ModelError, match=r"y: the range .* must be two numbers"):
        described(Share(ends), None)


def test_a_declared_range_is_stored(tmp_path):
    study = {"model": "toy", "trials": 40, "seed": 1}
    run = tolstat.run(study, model=Share((0.0, np.inf)), output=tmp_path / "r.h5")
    assert tolstat.open(run.path).responses[0].range == (0.0, np.inf)
    with h5py.File(run.path) as file:
        assert file["y"].attrs["valid_range"].tolist() == [0.0, np.inf]


def test_a_declared_range_is_kept():
    rows = np.zeros((7, 0))
    for value in (0.0, 1.0):
        assert simulate(Share((0.0, 1.0), value), rows, None).responses[0, 0] == value
    with pytest.raises(ModelError, match=r"y is 1\.0000000000000\d* in 7 of 7 trials"):
        simulate(Share((0.0, 1.0), 1 + 4e-16), rows, None)
    assert simulate(Share((0.0, np.inf), 9e9), rows, None).status[0] == Status.DONE


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        (object(), "not a model; a class that inherits from tolstat.Model"),
        (type("Half", (Model,), {"name": "half"}), "describe|evaluate"),
        (type("Nameless", (Toy,), {"name": ""}), "needs a name"),
        (
            type("Done", (Toy,), {"failures": {"done": "always"}}),
            "is a word of tolstat",
        ),
    ],
)
def test_objects_that_are_no_models_are_refused(thing, words):
    with pytest.raises(ModelError, match=words):
        catalogue.find(thing)


def test_a_model_may_declare_failure_messages(tmp_path):
    study = {
        "model": "rich", "trials": 2000, "seed": 3,
        "deviations": {
            name: {"tolerance": "+-0.2 mm", "distribution": "uniform"}
            for name in ("A1", "A2")
        },
    }  # fmt: skip
    run = tolstat.run(study, model=Rich(), output=tmp_path / "words.h5")
    first, second = run.column("A1"), run.column("A2")
    with np.errstate(invalid="ignore"):
        mounted = ~(first < -1.4e-4)
    assert run.failures["cannot be mounted"] == np.count_nonzero(~mounted) > 100
    assert run.failures["cuts air"] == np.count_nonzero(
        (first + second > 2.4e-4) & mounted
    )
    frame = run.frame()
    assert set(frame["status"].unique()) == {"done", "cannot be mounted", "cuts air"}
    assert frame.loc[frame["status"] == "cuts air", "stress"].isna().all()
    direct = tolstat.evaluate(Rich(), {"A1": [-1e-3, 0.0], "A2": 0.0})
    assert list(direct["status"]) == ["cannot be mounted", "done"]
    assert words_of(("cuts air",))[100] == "cuts air"
    assert "steps" not in frame and "steps" not in direct


def test_a_trial_without_finite_responses_fails_without_a_status():
    outcome = simulate(
        Liar(lambda n: Outcome([[1.0, 2.0], [np.nan, 2.0], [np.inf, 1.0]])),
        np.zeros((3, 1)),
        None,
    )
    assert outcome.status.tolist() == [1, 4, 4]
    assert np.isnan(outcome.responses[1:]).all()


def test_the_functions_that_compile_are_those_listed():
    """The README's list, and what the lanes teach Numba."""
    text = (ROOT / "tolstat" / "machines" / "README.md").read_text()
    listed = re.search(r"and of NumPy (.*?);", text, re.DOTALL)[1]
    taught = set()
    for path in (ROOT / "tolstat" / "lanes").glob("*.py"):
        found = r"^(?:@overload|@on_vectors|teach)\(np\.(\w+)"
        taught |= set(re.findall(found, path.read_text(), re.MULTILINE))
    assert set(re.findall(r"`(\w+)`", listed)) == taught
    assert all(hasattr(np, name) for name in taught)
