"""Slopes, worst cases, audits and worst trials of models with known results."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import tolstat
from tolstat import Contributor, Description, Model, Outcome, Response, setting
from tolstat.answers.report.full_report import report_of
from tolstat.execution.diagnostics.audit_selection import random_trials
from tolstat.execution.diagnostics.influence import slopes
from tolstat.execution.diagnostics.worst_cases import Target, worst_corners
from tolstat.execution.execute import execute, resume
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.statistics.limits.limit import worst_trials
from tolstat.status import Status
from tolstat.study.study import load


@dataclass(frozen=True)
class RoughSettings:
    rtol: float = setting(1e-3, "how roughly it is integrated", above=0.0)


class Rough(Model):
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
        gap = 1e-3 + 3.0 * deviations[:, 0] - deviations[:, 1]
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
    again = rough.audited.trials
    chosen = again[rough.audited.at_random]
    np.testing.assert_array_equal(chosen // 100, np.arange(30))
    assert len(set((chosen % 100).tolist())) > 15
    np.testing.assert_array_equal(random_trials(2, 7000)[:30], chosen)
    assert rough.audited.settings["rtol"] == pytest.approx(1e-6)
    known = rough.column("gap")[again] / (1 + 1e-4) * (1 + 1e-7)
    np.testing.assert_allclose(rough.audited.responses["gap"], known, rtol=1e-12)


def test_the_effect_of_a_known_integration_error_is_found(rough):
    found = report_of(rough).responses["gap"]
    error = found.integration_errors
    assert error.at_random.trials == 30 and error.settings["rtol"] == pytest.approx(
        1e-6
    )
    per = 1e-4 - 1e-7
    assert error.effect.mean == pytest.approx(per * found.mean.value, rel=0.02)
    assert error.effect.quantiles[0.95] == pytest.approx(
        per * found.quantiles[0.95].value, rel=0.1
    )
    assert error.largest < 1.01 * per * found.largest


def test_a_model_without_rtol_is_not_audited(toy, toy_study):
    run = tolstat.run(toy_study, model=toy)
    assert run.audited is None and toy.tightened(toy.settings()) is None
    assert report_of(run).responses["gap"].integration_errors is None


def test_slopes_are_derivatives():
    with Workers() as crew:
        settings = RoughSettings(1e-9)
        table = slopes(Rough(), settings, np.array([1e-4, 2e-4]), crew)
        still = slopes(Rough(), settings, np.array([1e-4, 0.0]), crew)
    np.testing.assert_allclose(table[:, 0], [3.0, -1.0], rtol=1e-8)
    np.testing.assert_allclose(still[:, 0], [3.0, 0.0], rtol=1e-8)


def bumpy_sum(deviations):
    """The worst trial lies in a corner that no single step from the middle finds."""
    a, b, c = deviations.T
    return (a * b + 0.1 * c)[:, None]


def test_the_worst_corner_is_found_from_the_worst_trial():
    ends = np.array([[-1.0] * 3, [1.0] * 3])
    targets = [
        Target(0, 1, np.array([[-0.3, -0.2, 0.1]])),
        Target(0, -1, np.array([[0.3, -0.2, 0.0]])),
    ]
    most, least = worst_corners(bumpy_sum, ends, [[0], [1], [2]], targets)
    assert most.deviations.tolist() == [-1, -1, 1] and most.value == pytest.approx(1.1)
    assert least.deviations.tolist() == [1, -1, -1]
    assert least.value == pytest.approx(-1.1)
    assert most.tried > 6 and most.failed == 0


def test_parts_of_a_batch_stay_equal_in_the_worst_case():
    ends = np.array([[-1.0] * 3, [1.0] * 3])
    target = Target(0, -1, np.array([[0.1, 0.1, 0.0]]))
    (found,) = worst_corners(bumpy_sum, ends, [[0, 1], [2]], [target])
    assert found.deviations[0] == found.deviations[1]
    assert found.value == pytest.approx(0.01 - 0.1)


def test_of_very_many_groups_those_are_moved_whose_worse_end_is_least_sure(monkeypatch):
    """Slopes mislead for the 38th; the last two act only together."""
    rates, rows = np.linspace(1, 2, 37), list[int]()

    def respond(deviations):
        rows.append(len(deviations))
        bent, *pair = deviations[:, 37:].T
        one_by_one = deviations[:, :37] @ rates + bent**3 - 0.1 * bent
        return (one_by_one + pair[0] * pair[1])[:, None]

    ends = np.array([-np.ones(40), np.ones(40)])
    slopes = np.array([*rates, -0.1, 0.0, 0.0])
    targets = [Target(0, sign, sign * np.sign(slopes)[None, :]) for sign in (1, -1)]
    groups = [[i] for i in range(40)]
    worst_corners(respond, ends, groups, targets)
    moved = max(rows)
    rows.clear()
    monkeypatch.setattr(
        "tolstat.execution.diagnostics.worst_cases.MOST_MOVED", 2 * 40 * 2
    )  # two groups of each target
    worst = worst_corners(respond, ends, groups, targets)
    values = [rates.sum() + 1.9, -rates.sum() - 1.9]
    assert [corner.value for corner in worst] == pytest.approx(values)
    assert rows[0] == 81 and max(rows[1:]) <= 2 * 2 * 2 < moved
    assert all(corner.tried > 81 for corner in worst)


LINEAR = """\
model = "rough"
trials = 500
seed = 2
[deviations]
part_1 = "+-0.2 mm"
part_2 = { tolerance = "-0.1..+0.5 mm", distribution = "uniform" }
[limits]
gap = "0.2..1.6 mm"
"""


def test_the_worst_case_of_a_linear_stack(tmp_path):
    """1 mm + 3 part_1 - part_2 in its corners, by hand."""
    path = tmp_path / "linear.toml"
    path.write_text(LINEAR)
    diagnostics = tolstat.run(path, model=Rough()).diagnostics
    least, largest = (
        diagnostics.worst_cases["gap"][side] for side in ("least", "largest")
    )
    rough = 1 + 1e-3 / 10  # its error, which is known
    assert largest.value == pytest.approx(rough * (1 + 0.6 + 0.1) * 1e-3, rel=1e-12)
    assert least.value == pytest.approx(rough * (1 - 0.6 - 0.5) * 1e-3, rel=1e-12)
    assert largest.deviations == pytest.approx({"part_1": 2e-4, "part_2": -1e-4})
    assert least.deviations == pytest.approx({"part_1": -2e-4, "part_2": 5e-4})
    assert largest.failed == 0 and largest.tried > 4
    slopes = diagnostics.slopes["gap"]
    assert slopes == pytest.approx({"part_1": 3 * rough, "part_2": -rough}, rel=1e-9)


def test_no_trial_within_the_tolerances_is_worse_than_the_worst_case(rough):
    lower, upper = np.array([(-3e-4, 3e-4), (-1e-4, 5e-4)]).T
    parts = np.column_stack([rough.column("part_1"), rough.column("part_2")])
    inside = ((parts >= lower) & (parts <= upper)).all(axis=1) & (rough.status == 1)
    gap = rough.column("gap")[inside]
    cases = rough.diagnostics.worst_cases["gap"]
    assert cases["largest"].value >= gap.max() and cases["least"].value <= gap.min()


def test_a_corner_that_fails_is_counted(rough):
    """1 + 3 * 0.3 + 0.1 fails: part 1 cannot be so long."""
    largest = rough.diagnostics.worst_cases["gap"]["largest"]
    assert largest.failed > 0 and np.isfinite(largest.value)


def test_the_worst_trials_are_evaluated_again_and_named_in_order(rough):
    worst = rough.worst_trials("gap")
    values, limit = rough.column("gap"), rough.limits["gap"]
    trials = list(worst)
    assert trials == worst_trials(values, rough.status, limit).tolist()
    assert len(worst) == 10
    done = values[rough.status == Status.DONE]
    margin = np.minimum(done - 0.2e-3, 1.6e-3 - done)
    assert values[trials[0]] in done[margin == margin.min()]
    for trial, precise in worst.items():
        assert precise == pytest.approx(values[trial] / (1 + 1e-4), rel=1e-6)


def test_worst_trials_are_ordered_by_their_precise_values(rough):
    first, second, *_ = rough.worst_trials("gap")
    gap = rough.audited.responses["gap"].copy()
    places = np.searchsorted(rough.audited.trials, [first, second])
    gap[places] = gap[places[::-1]]
    swapped = replace(rough.audited, responses={"gap": gap})
    again = replace(rough, audited=swapped)
    assert list(again.worst_trials("gap"))[:2] == [second, first]
    limited = tolstat.limited(again, {"gap": rough.limits["gap"].words})
    assert list(limited.worst_trials("gap"))[:2] == [second, first]
    assert len(limited.worst_trials("gap", 3)) == 3


def test_halving_agrees_with_a_run_of_halved_tolerances(rough, tmp_path):
    limit = "0.8..1.6 mm"
    path = tmp_path / "as_drawn.toml"
    path.write_text(STUDY.format(model="rough", limit=limit))
    found = tolstat.run(path, model=Rough()).diagnostics.halved["gap"]
    assert set(found) == {("part_1",), ("part_2",), ("part_1", "part_2")}
    for members, (beyond, effective) in found.items():
        text = STUDY.format(model="rough", limit=limit).replace("3000", "30000")
        if "part_1" in members:
            text = text.replace("+-0.3 mm", "+-0.15 mm")
        if "part_2" in members:
            text = text.replace("-0.1..+0.5 mm", "0.05..0.35 mm")  # about its middle
        path.write_text(text)
        again = tolstat.run(path, model=Rough(), force=True)
        gap = again.column("gap")
        bad = ~((gap >= 0.8e-3) & (gap <= 1.6e-3) & (again.status == Status.DONE))
        own = bad.mean()
        assert beyond.lower < own < beyond.upper
        assert beyond.value == pytest.approx(own, rel=0.25)
        assert 3000 / 4 < effective < 3000


def test_failed_trials_are_out_of_limit_with_halved_tolerances(tmp_path):
    path = tmp_path / "wide.toml"
    path.write_text(STUDY.format(model="rough", limit="-5..5 mm"))
    run = tolstat.run(path, model=Rough())
    found = run.diagnostics.halved["gap"]
    assert found["part_2",].beyond.value == pytest.approx(run.failed / 3000, rel=0.5)
    assert run.failed > 3 and found["part_1",].beyond.value < 1e-5


def test_the_run_states_why_tolerances_are_not_halved(toy, toy_study):
    found = tolstat.run(toy_study, model=toy).diagnostics.halved["gap"]
    turn = found["angle",]
    assert turn.beyond.reason == "a full turn is no tolerance" and turn.effective == 0
    assert found["part_1", "part_2"].beyond.sure
    text = toy_study.read_text().replace("1000", "1024")
    toy_study.write_text('sampling = "sobol"\n' + text)
    assert tolstat.run(toy_study, model=toy, force=True).diagnostics.halved == {}


def test_the_stand_reports_its_worst_trials(small_study):
    run = tolstat.run(small_study)
    for name in run.limits:
        worst = run.worst_trials(name)
        assert len(worst) == 10
        first, precise = next(iter(worst.items()))
        stored = run.column(name)[first]
        assert precise == pytest.approx(stored, rel=5e-3, abs=1e-6)


def test_missing_diagnostics_have_a_reason(tmp_path, toy):
    path = tmp_path / "grid.toml"
    path.write_text('model = "toy"\nsampling = "grid"\n[grid]\npart_1 = ["0 mm"]\n')
    assert (
        tolstat.run(path, model=toy).diagnostics.missing == "no deviations were drawn"
    )


def test_stopping_during_diagnostics_keeps_the_trials(toy, toy_study):
    """A Ctrl-C while slopes are sought: every trial is stored, the rest is resumed."""
    over = []
    with Workers(stopping=lambda: bool(over)) as crew:
        run = execute(
            load(toy_study, model=toy),
            toy_study.with_suffix(".h5"),
            crew,
            progress=lambda p: over.append(p) if p.doing == "audit" else None,
        )
    assert run.counts["not run"] == 0
    assert run.diagnostics.missing == "the run did not come to its end"
    resumed = resume(run.path, model=toy)
    assert resumed.complete and not resumed.diagnostics.missing
