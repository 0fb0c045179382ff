"""A run that is integrated too roughly: what is said of its limits, and where."""

from __future__ import annotations

import io
import json
import tomllib
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest

import tolstat
from tests.answers.page_checks import words_in
from tolstat import Contributor, Description, Model, Outcome, Response, setting
from tolstat.answers.next_steps import StepKind
from tolstat.answers.report.report_answer import NoCause
from tolstat.answers.run_entries import stored_runs
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.status import Status


@dataclass(frozen=True)
class RoughSettings:
    rtol: float = setting(1e-3, "how roughly it is integrated", above=0.0)
    max_step: float = setting(0.02, "longest step", unit="s", above=0.0)


class Rough(Model):
    """Normal about 10 N, sigma 1 N, less an error of 2 N times rtol."""

    name = "rough"
    settings = RoughSettings

    def describe(self, settings):
        return Description((Contributor("part", "m"),), (Response("force", "N"),))

    def evaluate(self, deviations, settings):
        return Outcome(10 + 1e3 * deviations - 2 * settings.rtol)


STUDY = """\
title = "Rough"
model = "rough"
trials = 4000
seed = 3
[settings]
rtol = {rtol}
[deviations]
part = "+-3 mm"
[limits]
force = "<= {limit} N"
"""


def ran(folder, rtol, limit, name="rough"):
    path = folder / f"{name}.toml"
    path.write_text(STUDY.format(rtol=rtol, limit=limit))
    return tolstat.run(path, model=Rough(), progress=None)


@pytest.mark.parametrize(
    ("rtol", "limit", "word"),
    [
        (1.0, 12, "undecided (integration error)"),  # 0.03 ppm, in truth 23 000 ppm
        (1e-3, 12, "not met"),
        (1.0, 15.5, "met"),
        (1.0, 7, "not met"),
    ],
)
def test_the_verdict_is_that_of_both_integrations(tmp_path, rtol, limit, word):
    found = tolstat.summary(ran(tmp_path, rtol, limit))
    assert found.limits["force"].yields.words == word
    assert found.verdicts == {"force": word.partition(" (")[0]}


@pytest.fixture(scope="module")
def rough(tmp_path_factory):
    return ran(tmp_path_factory.mktemp("rough"), 1.0, 12)


def test_every_answer_says_integration_error(rough, tmp_path):
    word = "undecided (integration error)"
    found, page = tolstat.summary(rough), tolstat.report(rough)
    assert f"force {word}" in repr(found)
    for each in (found, page):
        words = words_in(*each.document().blocks)
        assert f"The limit is {word}. Yield" in words
        assert "trials decide" not in words and "trials may decide" not in words
        given = json.loads(each.json())["responses"]["force"]["limited"]["yields"]
        assert (given["verdict"], given["reason"]) == ("undecided", "integration error")
        assert pd.read_csv(io.StringIO(each.csv()))["verdict"][0] == word
    assert page.responses["force"].integration_errors.changed > 0
    (entry,) = stored_runs(rough.path.parent).entries
    assert entry.verdicts == f"{word}: force"
    other = ran(tmp_path, 1e-6, 12, "other")
    compared = words_in(*tolstat.compare(rough, other).document().blocks)
    assert "(integration error)" in compared
    assert "(integration error)" in words_in(
        *tolstat.what_if(rough, {"part": "+-2.9 mm"}, model=Rough()).document().blocks
    )


def test_the_next_step_settles_it(rough, tmp_path, monkeypatch):
    """What it says to write into [settings] gives a run whose errors are small."""
    monkeypatch.chdir(rough.path.parent)
    summary = tolstat.summary("rough.h5")
    (step,) = summary.findings.steps
    assert step.settings == {"rtol": "1e-6", "max_step": '"0.005 s"'}
    words = words_in(*summary.document().blocks)
    assert 'write rtol = 1e-6 and max_step = "0.005 s" into [settings]' in words
    assert "tolstat run rough.toml --force" in words
    study = rough.path.with_suffix(".toml").read_text()
    lines = 'rtol = 1e-6\nmax_step = "0.005 s"'
    (tmp_path / "finer.toml").write_text(study.replace("rtol = 1.0", lines))
    finer = tolstat.run(tmp_path / "finer.toml", model=Rough(), progress=None)
    assert tolstat.summary(finer).verdicts == {"force": "not met"}


def test_more_trials_are_not_the_answer_to_a_rough_run(rough):
    yields = tolstat.summary(rough).limits["force"].yields
    assert yields.needed == 0 and yields.fraction_out_of_limit.value < 1e-3
    drawn = drawn_trials(rough)
    assert drawn.ends("force").shape == (2, 4000)


def test_a_rare_verdict_can_be_turned_too(tmp_path):
    """As integrated 0.1 ppm are out of limit, in truth 690; 100 are permitted."""
    path = tmp_path / "rare.toml"
    text = STUDY.format(rtol=1.0, limit=13.2).replace("trials = 4000", "trials = 5000")
    demanded = '{ limit = "<= 13.2 N", ppm = 100 }'
    path.write_text('sampling = "rare"\n' + text.replace('"<= 13.2 N"', demanded))
    found = tolstat.summary(tolstat.run(path, model=Rough(), progress=None))
    assert found.fraction_out_of_limit.upper < 1e-6
    assert found.words == "undecided (integration error)"
    (step,) = found.findings.steps
    assert step.settings["rtol"] == "1e-6"
    assert "write rtol = 1e-6 and" in words_in(*found.document().blocks)


@dataclass(frozen=True)
class Breaking(Rough):
    """It loses contact where the part is far off, if so at that rtol alone."""

    always: bool = False
    failures = {"loses contact": "the parts touch"}

    def evaluate(self, deviations, settings):
        far = np.abs(deviations[:, 0]) > 2.4e-3
        lost = far & (self.always or settings.rtol > 1e-4)
        found = super().evaluate(deviations, settings)
        return Outcome(found.responses, failed={"loses contact": lost})


@pytest.mark.parametrize(
    ("always", "word"), [(False, "undecided (integration error)"), (True, "not met")]
)
def test_trials_that_fail_by_the_integration_alone_do_not_decide(
    tmp_path, always, word
):
    path = tmp_path / "breaking.toml"
    path.write_text(STUDY.format(rtol=1e-3, limit=20))
    run = tolstat.run(path, model=Breaking(always), progress=None)
    assert run.counts["loses contact"] > 40
    again = run.status[run.audited.trials]
    assert np.count_nonzero(again != Status.DONE) >= 10
    found = tolstat.summary(run)
    assert found.limits["force"].yields.words == word
    said = " failed trials did not fail when evaluated again)"
    assert (said in words_in(*found.document().blocks)) is not always


def test_a_finer_run_is_the_only_step(tmp_path):
    """Another limit of the rough run is undecided: more rough trials decide nothing."""

    class Two(Rough):
        def describe(self, settings):
            responses = Response("force", "N"), Response("play", "m")
            return Description((Contributor("part", "m"),), responses)

        def evaluate(self, deviations, settings):
            force = 10 + 1e3 * deviations - 2 * settings.rtol
            return Outcome(np.hstack([force, deviations]))

    path = tmp_path / "two.toml"
    text = STUDY.format(rtol=1.0, limit=12) + 'play = "<= 2.8 mm"\n'
    path.write_text(text.replace("trials = 4000", "trials = 400"))
    run = tolstat.run(path, model=Two(), progress=None)
    found = tolstat.summary(run)
    assert found.limits["play"].yields.needed
    (step,) = found.findings.steps
    assert (step.kind, step.responses) == (StepKind.FINER_RUN, ("force",))
    finer = tomllib.loads(tolstat.fresh_study(run, step.change, model=Two()))
    assert finer["settings"]["rtol"] == step.change.settings["rtol"] == 1e-6
    assert step.settings == {"rtol": "1e-6", "max_step": '"0.005 s"'}


def test_an_error_that_is_visible_beside_sigma_is_said_without_a_limit():
    study = {
        "model": "rough", "trials": 100, "seed": 3, "settings": {"rtol": 0.075},
        "deviations": {"part": "+-3 mm"},
    }  # fmt: skip
    answer = tolstat.summary(tolstat.run(study, model=Rough(), progress=None))
    # 0.15 N; sigma is 1 N
    (warning,) = [w for w in answer.warnings if w.kind == "errors"]
    assert [*warning.responses] == ["force"]
    visible = warning.responses["force"]
    assert visible.error == pytest.approx(0.15, rel=1e-2)
    assert visible.of_sigma == pytest.approx(0.15, rel=0.3)
    assert "Integration errors: force by up to" in words_in(*answer.document().blocks)
    study["settings"]["rtol"] = 0.04
    assert not tolstat.summary(tolstat.run(study, model=Rough())).warnings


@pytest.mark.parametrize(
    ("declared", "word"), [(True, "not met"), (False, "undecided (integration error)")]
)
def test_a_residual_has_no_integration_error(declared, word):
    """It is one, all of it; a limit of it judges this run."""

    class Balance(Rough):
        def describe(self, settings):
            rest = Response("rest", "N", residual=declared)
            return Description((Contributor("part", "m"),), (rest,))

        def evaluate(self, deviations, settings):
            return Outcome(settings.rtol * np.sin(3e3 * deviations))

    study = {
        "model": "rough", "trials": 4000, "seed": 3, "settings": {"rtol": 0.1},
        "deviations": {"part": "+-3 mm"},
    }  # fmt: skip
    run = tolstat.run(study, model=Balance(), progress=None)
    kinds = [warning.kind for warning in tolstat.summary(run).warnings]
    assert ("numbers" in kinds or "errors" in kinds) is not declared
    errors = tolstat.report(run).responses["rest"].integration_errors
    assert (errors is None) is declared
    study["limits"] = {"rest": "-0.05..0.05 N"}
    found = tolstat.summary(tolstat.run(study, model=Balance(), progress=None))
    assert found.limits["rest"].yields.words == word


def test_a_limit_missed_with_visible_errors_has_no_remedy():
    study = {
        "model": "rough", "trials": 4000, "seed": 3, "settings": {"rtol": 0.075},
        "deviations": {"part": "+-3 mm"}, "limits": {"force": "<= 11 N"},
    }  # fmt: skip
    found = tolstat.summary(tolstat.run(study, model=Rough(), progress=None)).findings
    limit = found.limits["force"]
    assert limit.verdict == "not met" and limit.no_cause is NoCause.INTEGRATION_ERROR
    assert [step.kind for step in found.steps] == [StepKind.FINER_RUN]
    assert found.remedy is None


@pytest.mark.parametrize(("error", "kinds"), [(1e-11, []), (1e-8, ["numbers"])])
def test_errors_of_rounding_beside_equal_values_are_no_warning(error, kinds):
    class Equal(Rough):
        def evaluate(self, deviations, settings):
            values = np.where(deviations > 1e-3, 9.0, 10.0)
            return Outcome(values - error * settings.rtol)

    study = {
        "model": "rough", "trials": 400, "seed": 3, "settings": {"rtol": 1.0},
        "deviations": {"part": "+-3 mm"},
    }  # fmt: skip
    answer = tolstat.summary(tolstat.run(study, model=Equal(), progress=None))
    assert [w.kind for w in answer.warnings if w.kind in ("numbers", "errors")] == kinds


class Counting(Rough):
    """Also counts its steps, over 1 s and a little more; others are no error."""

    def describe(self, settings):
        parts, responses = super().describe(settings)
        return Description(parts, (*responses, Response("count", "1", shown="count")))

    def evaluate(self, deviations, settings):
        force = 10 + 1e3 * deviations
        evaluations.append(settings.max_step)
        return Outcome(np.hstack([force, np.ceil(force / 10 / settings.max_step)]))

    def tightened(self, settings):
        return RoughSettings(settings.rtol / 10, settings.max_step / 4)


evaluations = []


@pytest.mark.parametrize("limit", ["", 'count = "<= 60"'])
def test_a_response_that_counts_steps_is_named_and_no_shorter_one_advised(limit):
    evaluations.clear()
    study = STUDY.format(rtol=1e-3, limit=20) + limit
    run = tolstat.run(tomllib.loads(study), model=Counting())
    assert min(evaluations) > 0.02 / 64  # no fourth evaluation
    answer = tolstat.summary(run)
    (warning,) = [w for w in answer.warnings if w.kind == "growth"]
    assert warning.responses == ("count",)
    kinds = {w.kind for w in answer.warnings}
    assert kinds.isdisjoint({"numbers", "errors"})
    assert not any(step.kind is StepKind.FINER_RUN for step in answer.findings.steps)
    assert "It counts steps or does not converge" in words_in(*answer.document().blocks)
    if limit:
        assert answer.responses["count"].limited.yields.reason == "integration error"
