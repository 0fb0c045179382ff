"""Models whose answer depends on the other trials of a block."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.conftest import Toy
from tolstat import Outcome
from tolstat.answers.verification_document import verified_document
from tolstat.errors import ModelError, TolstatError
from tolstat.execution import run_loop
from tolstat.render.screen import show
from tolstat.study.study import load


class Lying(Toy):
    """The formula of Toy, plus something that a block decides."""

    def added(self, deviations):
        return 0.0

    def evaluate(self, deviations, settings):
        found = super().evaluate(deviations, settings)
        gap = found.responses[:, 0] + self.added(deviations)
        return Outcome(np.stack([gap, found.responses[:, 1]], axis=1), found.status)


class OfLength(Lying):
    def added(self, deviations):
        return 1e-5 * len(deviations)


class OfMean(Lying):
    def added(self, deviations):
        return deviations[:, 0].mean()


class OfSpread(Lying):
    def added(self, deviations):  # nothing at the nominal trial
        return deviations[:, 0] * np.ptp(deviations[:, 0])


class OfCalls(Lying):
    calls = 0

    def added(self, deviations):
        OfCalls.calls += 1
        return 1e-6 * OfCalls.calls


class Late(Lying):
    """It depends on its block where that is long: not when a run begins."""

    def added(self, deviations):
        return deviations[:, 0].mean() * (len(deviations) > 20)


class Rounded(Lying):
    def added(self, deviations):
        return 1e-19 * len(deviations)


@pytest.mark.parametrize("model", [OfLength, OfMean, OfSpread, OfCalls])
def test_a_run_of_such_a_model_ends_with_its_first_block(toy_study, model):
    """Its last trial that is done is checked, before any trial is stored."""
    with pytest.raises(ModelError, match="the answer of trial 31 depends on the other"):
        tolstat.run(toy_study, model=model(), workers=1)
    assert not toy_study.with_suffix(".h5").exists()


def test_the_refusal_says_what_to_do(toy_study):
    with pytest.raises(
        ModelError, match=r"evaluate must compute each row of deviations by"
    ):
        tolstat.run(toy_study, model=OfLength())


def test_the_status_counts_too(toy_study):
    class Picky(Toy):
        def evaluate(self, deviations, settings):
            found = super().evaluate(deviations, settings)
            return found._replace(
                status=np.full(len(deviations), 1 + 3 * (len(deviations) > 1))
            )

    with pytest.raises(ModelError, match="trial 31 depends on the other trials of"):
        tolstat.run(toy_study, model=Picky(), workers=1)


def test_a_trial_that_is_done_is_checked(toy, toy_study):
    last = load(toy_study, model=toy).deviations()[31, 0]  # of the first block

    class LastFails(OfMean):
        def evaluate(self, deviations, settings):
            found = super().evaluate(deviations, settings)
            return found._replace(status=1 + 3 * (deviations[:, 0] == last))

    with pytest.raises(ModelError, match="trial 30 depends on the other trials of"):
        tolstat.run(toy_study, model=LastFails(), workers=1)


def test_other_rounding_is_a_warning(toy_study):
    with pytest.warns(RuntimeWarning, match=r"trial 31 depends .*\(in its last bits"):
        assert tolstat.run(toy_study, model=Rounded(), workers=1).complete


class Huge(Lying):
    """It depends on its block where that is longer than the first ones."""

    def added(self, deviations):
        return deviations[:, 0].mean() * (len(deviations) > 300)


@pytest.mark.parametrize("model", [Late, Huge])
def test_a_run_checks_its_own_blocks(toy_study, model):
    with pytest.raises(
        TolstatError, match=r"the answer of trial \d+ depends on the oth"
    ):
        tolstat.run(toy_study, model=model(), trials=20_000)


def test_verify_evaluates_some_trials_alone(toy_study, capsys):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run_loop.BlockCheck, "_is_exact", lambda *_: True)
        run = tolstat.run(toy_study, model=Late())
    found = tolstat.verify(run.path, model=Late(), every=True)
    assert not found.whole and len(found.dependent) and len(found.different)
    assert {*found.dependent} <= {*found.alone}
    show(verified_document(run.path, found))
    said = capsys.readouterr().out
    assert "of them, each alone: different in" in said
    assert "an answer depends on the other trials of its block" in " ".join(
        said.split()
    )


def test_alone_is_without_any_other_trial(toy_study):
    class Crowded(Lying):
        def added(self, deviations):
            return 1e-5 * (len(deviations) > 1)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run_loop.BlockCheck, "_is_exact", lambda *_: True)
        run = tolstat.run(toy_study, model=Crowded())
    found = tolstat.verify(run.path, model=Crowded(), every=True)
    assert not len(found.different) and [*found.dependent] == [*found.alone]


def test_honest_models_are_as_among_others(toy, toy_study, recwarn):
    run = tolstat.run(toy_study, model=toy)
    found = tolstat.verify(run.path, model=toy, every=True)
    assert found.whole and len(found.alone) == 8 and not recwarn.list


def test_a_grid_is_evaluated_with_its_own_settings(toy, tmp_path):
    study = tmp_path / "grid.toml"
    study.write_text(
        'model = "toy"\nsampling = "grid"\n[grid]\ngain = [1.0, 2.0]\n'
        'part_1 = { from = "0 mm", to = "0.5 mm", points = 20 }\n'
    )
    run = tolstat.run(study, model=toy)
    found = tolstat.verify(run.path, model=toy, every=True)
    assert found.whole and len(found.evaluated) == 40
    with pytest.raises(ModelError, match="depends on the other trials"):
        tolstat.run(study, model=OfMean(), force=True)


def test_a_single_trial_and_a_run_without_one(toy, toy_study):
    run = tolstat.run(toy_study, model=toy, trials=1)
    assert tolstat.verify(run.path, model=toy).whole
