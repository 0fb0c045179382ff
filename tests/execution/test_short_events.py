"""Verdicts beside what an audit shows; right values in closed form."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.answers.page_checks import words_in
from tests.execution import short_events as models
from tests.execution.audited import Fragile
from tolstat.answers.next_steps import StepKind
from tolstat.answers.report.finding_words import next_steps, sentences
from tolstat.answers.report.report_warnings import NumbersWarning, VerdictWarning
from tolstat.document.blocks import Paragraph
from tolstat.render.screen import as_text

NORMAL = "+-10 %"


def ran(folder, model, limit, trials=2000, tolerance=NORMAL, **settings):
    study = {
        "model": model.name, "trials": trials, "seed": 1, "settings": settings,
        "deviations": {"d": tolerance}, "limits": {"end": limit},
    }  # fmt: skip
    path = folder / f"{model.name}.h5"
    return tolstat.run(study, model=model, output=path, progress=None)


def right(run, model, limit):
    """The verdict of all trials by the closed form."""
    word, end = limit.split()
    y = model.truth(run.column("d"))
    out = np.mean(y > float(end) if word == "<=" else y < float(end))
    return "not met" if out > 0.0027 else "met"


MISSED = [
    (models.Pulse(), ">= 0.3"), (models.Pulse(), "<= 0.3"),
    (models.ShortPulse(), ">= 0.3"), (models.ShortPulse(), "<= 0.3"),
    (models.Controller(), "<= 0.5"), (models.Controller(), ">= -0.5"),
    (models.Tooth(), ">= 0.5"), (models.Tooth(), "<= 0.5"),
    (models.Brush(), "<= 0.8"), (models.Brush(), ">= 0.8"),
]  # fmt: skip


@pytest.mark.parametrize(("model", "limit"), MISSED)
def test_what_steps_miss_leaves_the_limit_undecided(tmp_path, model, limit):
    run = ran(tmp_path, model, limit)
    found = tolstat.summary(run)
    yields = found.limits["end"].yields
    assert yields.words == "undecided (integration error)"
    (warning,) = [x for x in found.warnings if isinstance(x, VerdictWarning)]
    seen = warning.movement
    assert seen.moved or seen.moved_third
    assert seen.largest > 0.1
    causes = found.responses["end"]
    assert causes.causes.named == () and found.findings.remedy is None
    (step,) = next_steps(found)
    assert "max_step below the shortest event" in words_in(Paragraph(step))


def test_the_error_is_said_before_the_verdict(tmp_path):
    found = tolstat.summary(ran(tmp_path, models.Pulse(), ">= 0.3"))
    words = words_in(*found.document().blocks)
    said = words.index("undecided (integration error: ")
    assert said < words.index("The limit is undecided")
    assert "trials evaluated again moved, by up to 0." in words[said:]


@pytest.mark.parametrize(
    ("model", "tolerance"),
    [(models.Controller(), "+-1e-7 %"), (models.Pulse(), NORMAL),
     (models.Tooth(), NORMAL), (models.Brush(), NORMAL)],
)  # fmt: skip
def test_numbers_that_err_more_than_their_interval(tmp_path, model, tolerance):
    """With or without a limit that the error can reach."""
    run = ran(tmp_path, model, "<= 0.5", tolerance=tolerance)
    found = tolstat.summary(run)
    (warning,) = [x for x in found.warnings if isinstance(x, NumbersWarning)]
    number, error = warning.numbers["mean"]
    truth = model.truth(run.column("d")).mean()
    assert not number.lower <= truth <= number.upper
    # the audit knows the direction; it misses some events itself
    assert 0.0 < error / (number.value - truth) < 1.1


def test_a_response_far_from_its_limit_with_an_error_far_above_its_spread(tmp_path):
    """As the mean of a sampled controller: an interval of 1e-9, an error of 1.75."""
    run = ran(tmp_path, models.Controller(), "<= 5", tolerance="+-1e-7 %")
    found = tolstat.summary(run)
    assert found.responses["end"].mean.value == pytest.approx(-1.75)
    assert found.limits["end"].yields.words == "undecided (integration error)"


@pytest.mark.parametrize(
    ("model", "limit"),
    [(models.Pulse(), ">= 0.3"), (models.Pulse(), "<= 0.5"),
     (models.Tooth(), ">= 0.5"), (models.Brush(), "<= 0.8"),
     (models.Brush(), ">= 0.6")],
)  # fmt: skip
def test_steps_shorter_than_the_event_decide(tmp_path, model, limit):
    run = ran(tmp_path, model, limit, max_step="0.5 ms")
    found = tolstat.summary(run)
    assert found.limits["end"].yields.words == right(run, model, limit)
    assert found.unseen_errors[:2] == (20, 0)
    words = "20 random trials evaluated again, none moved: up to "
    assert words in words_in(*tolstat.report(run).document().blocks)


@pytest.mark.parametrize("rtol", [1e-1, 1e-2, 1e-3, 1e-6])
@pytest.mark.parametrize("limit", ["<= 1.1", "<= 0.9", ">= 0.9", ">= 0.3"])
def test_a_smooth_model_that_is_rough_is_right_or_undecided(tmp_path, rtol, limit):
    model = models.Swing()
    run = ran(tmp_path, model, limit, rtol=rtol)
    yields = tolstat.summary(run).limits["end"].yields
    truth = right(run, model, limit)
    assert yields.words in (truth, "undecided (integration error)")
    if rtol < 1e-2:
        assert yields.words == truth


def test_a_third_evaluation_is_stored_and_kept(tmp_path):
    run = ran(tmp_path, models.Pulse(), ">= 0.3")
    third = tolstat.open(run.path).audited.third
    # again at a quarter of the longest step, until no trial moves
    assert third.settings == pytest.approx({"rtol": 1e-9 / 32, "max_step": 0.5 / 256})
    assert third.settings["max_step"] < models.Pulse.width < 4 * 0.5 / 64
    assert run.audited.residual.of_rtol > 1e5
    assert tolstat.open(run.path).audited.residual == run.audited.residual
    assert np.isin(third.trials, run.audited.trials).all()
    assert 8 <= len(third.trials) <= 24
    longer = tolstat.extend(run.path, trials=2200, model=models.Pulse(), progress=None)
    assert longer.audited.third and len(longer.audited.trials) > 20
    assert tolstat.verify(longer.path, model=models.Pulse()).whole


def test_a_jam_that_most_trials_miss_is_not_met_quietly(tmp_path):
    """In truth 10 000 ppm; the run sees 1000 of them."""
    study = {
        "model": "jam", "trials": 20_000, "seed": 3, "limits": {"end": "<= 4"},
        "deviations": {
            "d": "+-3", "kind": {"tolerance": "0..1", "distribution": "uniform"},
            "u": {"tolerance": "0..1", "distribution": "uniform"},
        },
    }  # fmt: skip
    run = tolstat.run(
        study, model=models.Jam(), output=tmp_path / "jam.h5", progress=None
    )
    yields = tolstat.summary(run).limits["end"].yields
    assert yields.fraction_out_of_limit.upper < 0.0027
    assert yields.words == "undecided (integration error)"


def test_trials_that_fail_when_evaluated_again_are_no_integration_error(tmp_path):
    study = {
        "model": "fragile", "trials": 1000, "seed": 1, "deviations": {"part": "+-3 mm"},
        "limits": {"force": "<= 13.5 N"},
    }  # fmt: skip
    run = tolstat.run(study, model=Fragile(), output=tmp_path / "fragile.h5")
    found = tolstat.summary(run)
    assert found.limits["force"].yields.words == (
        "undecided (trials fail when evaluated again)"
    )
    (warning,) = [x for x in found.warnings if isinstance(x, VerdictWarning)]
    (said,) = [as_text(parts) for parts in sentences([warning])]
    again = len(run.audited.trials)
    assert (
        f"{warning.movement.failed_again} of {again} trials evaluated again failed"
        in said
    )
    assert "integration error" not in said
    assert found.responses["force"].causes.named == () and not found.findings.remedy
    (step,) = found.findings.steps
    trial = step.commands[0].words[2]
    assert step.kind is StepKind.SEE_FAILED and trial in run.audited.trials
    assert abs(run.column("force")[trial] - 10) > 2
