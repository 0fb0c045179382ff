"""Slopes, worst cases, audits and worst trials: on machines whose answers are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import tolstat
from tests.conftest import Toy
from tolstat.machines.description import (
    Contributor,
    Description,
    Outcome,
    Response,
    setting,
)
from tolstat.report.findings import findings_of
from tolstat.status import Status
from tolstat.study.audit import audited_trials, tightened
from tolstat.study.classical import Target, slopes, worst_corners
from tolstat.study.evidence import gather, worst_trials


@dataclass(frozen=True)
class RoughSettings:
    rtol: float = setting(1e-3, "how roughly it is integrated", above=0.0)


class Rough:
    """A sum whose error is known: a tenth of rtol of itself."""

    name = "rough"
    title = "a sum, roughly"
    settings = RoughSettings

    def describe(self, settings):
        parts = tuple(
            Contributor(f"part_{i}", "m", "l", "a part", "sum") for i in (1, 2)
        )
        return Description(parts, (Response("gap", "m", "g", "sum", "sum"),))

    def evaluate(self, deviations, settings):
        gap = 1e-3 + deviations @ [3.0, -1.0]
        status = np.where(np.abs(deviations[:, 0]) > 0.29e-3, 4, 1)
        return Outcome((gap * (1 + settings.rtol / 10))[:, None], status)


STUDY = """\
model = "{model}"
trials = 3000
seed = 2
[deviations]
part_1 = "+-0.3 mm"
part_2 = {{ tolerance = "-0.1..+0.5 mm", distribution = "uniform" }}
[limits]
gap = "{limit}"
"""


@pytest.fixture
def rough(tmp_path):
    path = tmp_path / "rough.toml"
    path.write_text(STUDY.format(model="rough", limit="0.2..1.6 mm"))
    return tolstat.run(path, model=Rough(), workers=2)


def test_one_trial_of_each_hundred_is_audited(rough):
    chosen = rough.audited.trials
    np.testing.assert_array_equal(chosen // 100, np.arange(30))
    assert len(set((chosen % 100).tolist())) > 15
    np.testing.assert_array_equal(audited_trials(2, 7000)[:30], chosen)
    assert rough.audited.rtol == pytest.approx(1e-6)
    known = rough.column("gap")[chosen] / (1 + 1e-4) * (1 + 1e-7)
    np.testing.assert_allclose(rough.audited.responses["gap"], known, rtol=1e-12)


def test_integration_error_moves_the_numbers_by_what_it_is(rough):
    found = findings_of(rough)["responses"]["gap"]
    error = found["integration_error"]
    assert error["trials"] == 30 and error["rtol"] == pytest.approx(1e-6)
    per = 1e-4 - 1e-7
    assert error["moves"]["mean"] == pytest.approx(
        per * found["mean"]["value"], rel=0.02
    )
    assert error["moves"]["95 %"] == pytest.approx(
        per * found["quantiles"]["95 %"]["value"], rel=0.1
    )
    assert error["largest"] < 1.01 * per * found["largest"]


def test_a_model_without_rtol_is_not_audited(toy, toy_study):
    run = tolstat.run(toy_study, model=toy)
    assert run.audited is None and tightened(Toy.settings()) is None
    assert findings_of(run)["responses"]["gap"]["integration_error"] is None


def test_slopes_are_derivatives():
    table = slopes(Rough(), RoughSettings(1e-9), np.array([1e-4, 2e-4]))
    np.testing.assert_allclose(table[:, 0], [3.0, -1.0], rtol=1e-8)
    still = slopes(Rough(), RoughSettings(1e-9), np.array([1e-4, 0.0]))
    np.testing.assert_allclose(still[:, 0], [3.0, 0.0], rtol=1e-8)


class Bumpy:
    """The worst machine lies in a corner that no single step from the middle finds."""

    settings = RoughSettings

    def evaluate(self, deviations, settings):
        a, b, c = deviations.T
        return Outcome((a * b + 0.1 * c)[:, None], np.ones(len(a), np.int64))


def test_the_worst_corner_is_found_from_the_worst_trial():
    lower, upper = np.full(3, -1.0), np.full(3, 1.0)
    targets = [
        Target(0, 1, np.array([-0.3, -0.2, 0.1])),
        Target(0, -1, np.array([0.3, -0.2, 0.0])),
    ]
    most, least = worst_corners(
        Bumpy(), RoughSettings(), lower, upper, [[0], [1], [2]], targets
    )
    assert most.deviations.tolist() == [-1, -1, 1] and most.value == pytest.approx(1.1)
    assert least.deviations.tolist() == [1, -1, -1]
    assert least.value == pytest.approx(-1.1)
    assert most.tried > 6 and most.failed == 0


def test_parts_of_a_batch_stay_alike_in_the_worst_case():
    lower, upper = np.full(3, -1.0), np.full(3, 1.0)
    target = Target(0, -1, np.array([0.1, 0.1, 0.0]))
    (found,) = worst_corners(
        Bumpy(), RoughSettings(), lower, upper, [[0, 1], [2]], [target]
    )
    assert found.deviations[0] == found.deviations[1]
    assert found.value == pytest.approx(0.01 - 0.1)


def test_the_worst_case_of_a_linear_stack(rough):
    evidence = gather(rough, Rough())
    least, largest = evidence.worst_cases["gap"]
    # 1 + 3 * 0.3 + 0.1 fails: part 1 cannot be so long; 29/30 of it is not a corner
    assert largest.side == "largest" and largest.failed > 0
    assert least.side == "least" and np.isfinite(least.value)
    assert evidence.slopes["gap"]["part_1"] == pytest.approx(3.0, rel=1e-3)


def test_the_worst_trials_are_integrated_again_and_named_in_order(rough):
    evidence = gather(rough, Rough())
    worst = evidence.worst["gap"]
    assert [each.trial for each in worst] == worst_trials(rough, "gap")
    assert len(worst) == 10 and evidence.precise_rtol == pytest.approx(1e-6)
    values = rough.column("gap")[rough.status == Status.DONE]
    margin = np.minimum(values - 0.2e-3, 1.6e-3 - values)
    assert worst[0].value in values[margin == margin.min()]
    for each in worst:
        assert each.precise == pytest.approx(each.value / (1 + 1e-4), rel=1e-6)
    assert evidence.histories == {}


def test_the_stand_tells_how_its_worst_trials_moved(small_study):
    run = tolstat.run(small_study)
    evidence = gather(run)
    named = {each.trial for worst in evidence.worst.values() for each in worst}
    assert set(evidence.histories) == named
    for name, worst in evidence.worst.items():
        history = evidence.histories[worst[0].trial]
        names = [response.name for response in run.responses]
        stored = run.column(name)[worst[0].trial]
        assert history.outcome.responses[0, names.index(name)] == stored
        assert worst[0].precise == pytest.approx(stored, rel=5e-3, abs=1e-6)


def test_what_cannot_be_simulated_says_why(rough, toy, toy_study):
    assert "not in the catalogue" in gather(rough).missing
    facts = {**rough.facts, "source_digest": "another"}
    other = type(rough)(**{**vars(rough), "facts": facts})
    assert "run the study again" in gather(other, Rough()).missing
