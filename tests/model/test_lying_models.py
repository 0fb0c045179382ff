"""Models that break the contract, or the process: each is a sentence."""

from __future__ import annotations

import io
import os
import sys
from concurrent.futures import wait
from pathlib import Path

import numpy as np
import pytest

import tolstat
from tests.cli.command_line import call
from tests.conftest import Toy
from tolstat import Outcome, catalogue
from tolstat.errors import ModelError, TolstatError
from tolstat.execution.workers import block_scheduler
from tolstat.execution.workers.block_scheduler import Threads, Workers


class Unprintable(Exception):
    def __str__(self):
        raise ValueError("no words")


def noted(error):
    error.add_note("said later")
    return error


FAULTS = [
    (SystemExit(0), "SystemExit: 0"),
    (GeneratorExit(), "GeneratorExit"),
    (BaseException("odd"), "BaseException: odd"),
    (Unprintable(), r"Unprintable: <exception str\(\) failed>"),
    (noted(ValueError("odd")), "ValueError: odd"),
    (ValueError("x" * 10**6), r"ValueError: x{980,990} \.\.\."),
]


@pytest.mark.parametrize("where", ["describe", "evaluate", "impossible", "numbers"])
@pytest.mark.parametrize(("error", "words"), FAULTS)
def test_a_model_that_ends_the_process(toy_study, monkeypatch, where, error, words):
    def raising(self, *arguments, **more):
        raise error

    monkeypatch.setattr(Toy, where, raising)
    said = f"model 'toy'.*{where} fails: .*{words} \\(test_lying_models.py, line"
    with pytest.raises(TolstatError, match=said):
        tolstat.run(toy_study, model=Toy())
    assert not toy_study.with_suffix(".h5").exists()


@pytest.mark.parametrize(("error", "words"), [*FAULTS[:2], FAULTS[3]])
def test_a_model_that_cannot_be_made(toy_study, monkeypatch, error, words):
    def raising(self):
        raise error

    monkeypatch.setattr(Toy, "__init__", raising)
    with pytest.raises(TolstatError, match=words):
        tolstat.run(toy_study, model=Toy)


@pytest.mark.parametrize("name", ["name", "failures", "views", "integrates"])
def test_a_declaration_that_fails(toy_study, monkeypatch, name):
    monkeypatch.setattr(Toy, name, property(lambda self: 1 / 0))
    with pytest.raises(TolstatError, match=r"Toy: ZeroDivisionError: division by zero"):
        tolstat.run(toy_study, model=Toy())


def test_an_outcome_that_fails(toy_study, monkeypatch):
    class Late(Outcome):
        failed = property(lambda self: 1 / 0)

    answer = Late(np.zeros((1, 2)))
    monkeypatch.setattr(Toy, "evaluate", lambda *_: answer)
    said = r"evaluate fails: ZeroDivisionError: .* \(test_lying_models.py, line"
    with pytest.raises(TolstatError, match=said):
        tolstat.run(toy_study, model=Toy())


@pytest.mark.parametrize("raised", ["SystemExit(0)", "GeneratorExit", "BaseException"])
def test_on_the_command_line_it_is_exit_code_2(tmp_path, raised):
    text = Path("runs/own/stack.py").read_text()
    file, study = tmp_path / "stack.py", tmp_path / "stack.toml"
    study.write_text(Path("runs/own/stack.toml").read_text())
    for before, now in (
        (
            "    def evaluate(self, deviations, settings):\n",
            f"        raise {raised}\n",
        ),
        ("", f"raise {raised}\n"),
    ):
        file.write_text(text.replace(before, before + now, 1))
        done = call("run", study, "--machine", f"{file}:Stack")
        assert done.exit_code == 2 and raised[:10] in done.stderr, done.output


BREAKING = {
    "close": lambda name: getattr(sys, name).close(),
    "junk": lambda name: setattr(sys, name, object()),
    "none": lambda name: setattr(sys, name, None),
}


@pytest.mark.parametrize("name", ["stdout", "stderr"])
@pytest.mark.parametrize("how", BREAKING)
def test_a_model_that_breaks_a_stream(toy_study, monkeypatch, name, how):
    class Breaking(Toy):
        def evaluate(self, deviations, settings):
            BREAKING[how](name)
            return super().evaluate(deviations, settings)

    own = io.StringIO()  # its descriptor is that of the process
    monkeypatch.setattr(sys, name, own)
    with pytest.raises(TolstatError, match=rf"evaluate closes or breaks sys\.{name}; "):
        tolstat.run(toy_study, model=Breaking())
    assert how == "close" or getattr(sys, name) is own
    assert not getattr(sys, name).closed


class Wandering(Toy):
    """It leaves the working directory whenever it is called."""

    away = "/"

    def describe(self, settings):
        os.chdir(self.away)
        return super().describe(settings)

    def evaluate(self, deviations, settings):
        os.chdir(self.away)
        return super().evaluate(deviations, settings)

    def impossible(self, deviations, settings):
        os.chdir(self.away)
        return super().impossible(deviations, settings)


def test_a_model_that_changes_the_working_directory(toy_study, tmp_path, monkeypatch):
    (tmp_path / "away").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Wandering, "away", str(tmp_path / "away"))
    run = tolstat.run("toy.toml", model=Wandering(), output="out.h5")
    assert run.complete and run.path == Path("out.h5") and Path.cwd() == tmp_path
    run = tolstat.extend("out.h5", 1500, model=Wandering())
    assert tolstat.verify("out.h5", model=Wandering(), every=True).whole
    assert tolstat.report("out.h5").save("out.html").exists()
    assert not list((tmp_path / "away").iterdir())
    assert {each.name for each in tmp_path.iterdir()} == {
        "away", "toy.toml", "out.h5", "out.html",
    }  # fmt: skip


def test_a_thread_that_changes_it_at_once(tmp_path, monkeypatch):
    class Hasty(Threads):
        def call(self, function, *arguments):
            future = super().call(function, *arguments)
            wait([future])
            return future

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(block_scheduler, "Threads", Hasty)
    with Workers(1) as workers:
        workers.call(os.chdir, "/")
    assert Path.cwd() == tmp_path


def test_a_file_of_a_model_that_changes_it(tmp_path, monkeypatch):
    file = tmp_path / "stack.py"
    file.write_text(
        "import os\nos.chdir('/')\n" + Path("runs/own/stack.py").read_text()
    )
    monkeypatch.chdir(tmp_path)
    assert catalogue.load("stack.py:Stack").name == "stack"
    assert Path.cwd() == tmp_path


def of_outcome(change):
    """Return a model whose outcome is changed."""

    class Changed(Toy):
        failures = {"odd": "it is even"}

        def evaluate(self, deviations, settings):
            return change(super().evaluate(deviations, settings), deviations)

    return Changed()


def test_masked_responses_are_refused(toy_study):
    def masked(found, deviations):
        responses = np.ma.masked_less(found.responses, 0.0)
        return Outcome(responses)

    with pytest.raises(ModelError, match=r"responses are masked in some trials; write"):
        tolstat.run(toy_study, model=of_outcome(masked))
    whole = of_outcome(lambda found, _: Outcome(np.ma.array(found.responses)))
    assert tolstat.run(toy_study, model=whole).counts["done"] == 1000


@pytest.mark.parametrize("kind", [np.float64, np.int64])
def test_numbers_do_not_mark_failures(toy_study, kind):
    def marked(found, deviations):
        return found._replace(failed={"odd": np.zeros(len(deviations), kind)})

    with pytest.raises(
        ModelError, match=r"failed 'odd' must be true or false for each"
    ):
        tolstat.run(toy_study, model=of_outcome(marked))


def test_a_response_whose_square_is_not_finite_is_no_answer(toy_study):
    """It is counted with those that are not finite, and the report is made."""

    def huge(found, deviations):
        responses = np.where(deviations[:, :1] > 0.2e-3, 1e308, found.responses)
        return Outcome(responses)

    run = tolstat.run(toy_study, model=of_outcome(huge))
    beyond = int(np.count_nonzero(run.column("part_1") > 0.2e-3))
    assert run.counts["not finite"] == beyond > 0
    assert tolstat.report(run).html()
    sure = of_outcome(
        lambda found, _: found._replace(responses=found.responses * 1e200)
    )
    with pytest.raises(
        ModelError, match=r"gap is .*e\+19\d in a trial whose status is"
    ):
        tolstat.run(toy_study, model=sure, force=True)


def test_a_model_describes_itself_once_for_many_blocks(toy, toy_study, monkeypatch):
    """With thousands of contributors that takes longer than a block."""
    asked = []

    def counted(self, settings, plain=Toy.describe):
        asked.append(settings)
        return plain(self, settings)

    monkeypatch.setattr(Toy, "describe", counted)
    rows = np.zeros((500, 3))
    with Workers(1, block=1) as crew:
        before = crew.simulate(toy, rows, toy.settings())
        after = crew.simulate(toy, rows, toy.settings(gain=3.0))
    assert len(asked) == 2
    assert before.responses.shape == after.responses.shape == (500, 2)
