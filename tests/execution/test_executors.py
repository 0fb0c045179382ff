"""Executors that do not keep their word: each is a sentence, at once."""

from __future__ import annotations

from concurrent.futures import Executor, Future, ThreadPoolExecutor

import pytest

import tolstat
from tests.cli.command_line import chain
from tests.conftest import ROOT
from tolstat import catalogue
from tolstat.errors import BrokenError, ModelError


class Here(Executor):
    """It calls at once, and changes what comes back."""

    def changed(self, found):
        return found

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.set_result(self.changed(fn(*args, **kwargs)))
        return future


class Cancelling(Here):
    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.cancel()
        return future


class WithoutFuture(Here):
    def submit(self, fn, /, *args, **kwargs):
        return None


class WithoutAnswers(Here):
    def changed(self, found):
        return None


class Shorter(Here):
    def changed(self, found):
        answers, seconds = found
        return type(answers)(*(each[1:] for each in answers[:2]), None), seconds


class Narrower(Here):
    def changed(self, found):
        answers, seconds = found
        return answers._replace(responses=answers.responses[:, :0]), seconds


class Numbers(Here):
    def changed(self, found):
        return found[0].responses


class Refusing(Here):
    def submit(self, fn, /, *args, **kwargs):
        raise RuntimeError("it was shut down")


class Ending(Here):
    def submit(self, fn, /, *args, **kwargs):
        raise SystemExit(0)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (Cancelling, "CancelledError"),
        (WithoutFuture, "WithoutFuture returns NoneType, not a Future"),
        (
            WithoutAnswers,
            "WithoutAnswers returns NoneType, not the answers of 1 trials",
        ),
        (Shorter, "returns tuple, not the answers of 1 trials"),
        (Narrower, "returns tuple, not the answers of 1 trials"),
        (Numbers, "returns ndarray, not the answers of 1 trials"),
        (Refusing, "RuntimeError: it was shut down"),
        (Ending, "SystemExit: 0"),
        (dict, "AttributeError: 'dict' object has no attribute 'submit'"),
    ],
)
def test_what_an_executor_may_not_do(tmp_path, kind, words):
    study = chain(tmp_path, "study")
    executor = kind() if kind is not dict else {"a": 1}
    with pytest.raises(BrokenError) as lost:
        tolstat.run(study, executor=executor)
    assert words in str(lost.value) and "0 of 1000 trials are stored" in str(lost.value)
    assert tolstat.resume(study.with_suffix(".h5")).complete


def test_an_executor_that_does_is_used(tmp_path):
    study = chain(tmp_path, "study")
    run = tolstat.run(study, output=tmp_path / "far.h5", executor=Here())
    assert run.frame().equals(tolstat.run(study).frame())


def test_threads_share_the_model_of_a_file(tmp_path):
    stack = catalogue.load(str(ROOT / "runs/own/stack.py:Stack"))
    study, options = ROOT / "runs/own/stack.toml", {"trials": 300}
    with ThreadPoolExecutor(2) as executor:
        for name in ("one.h5", "two.h5"):
            output = tmp_path / name
            run = tolstat.run(study, output=output, executor=executor, **options)
    assert catalogue.find("stack") is stack
    here = tolstat.run(study, output=tmp_path / "here.h5", **options)
    assert run.frame().equals(here.frame())


def test_an_object_is_refused_by_threads_too(toy, toy_study):
    with ThreadPoolExecutor(1) as executor, pytest.raises(ModelError, match="from its"):
        tolstat.run(toy_study, model=toy, executor=executor)
