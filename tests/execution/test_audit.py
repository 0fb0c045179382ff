"""Choice of the trials evaluated again, and planted errors that it finds."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.execution.audited import Cliff, CliffSettings
from tolstat import Description, Response
from tolstat.answers.report.full_report import report_of
from tolstat.deviations.samplers import Random
from tolstat.execution.diagnostics.audit_selection import (
    next_to,
    random_trials,
    select,
    spread,
)
from tolstat.execution.execute import execute
from tolstat.execution.stages import Trials
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.statistics.limits.limit import Limit
from tolstat.status import Status
from tolstat.store.run_records import Reason
from tolstat.study.study import load


class Wavy(Cliff):
    """A force that is wrong by as much as 6 mN, up or down."""

    def evaluate(self, deviations, settings):
        found = super().evaluate(deviations, CliffSettings(1e-12))
        force = 10 + 1e3 * deviations[:, 0]
        found.responses[:, 0] += 6 * settings.rtol * np.sign(np.sin(1e6 * force))
        return found


STUDY = """\
model = "cliff"
trials = {trials}
seed = 5
[deviations]
part = "+-3 mm"
[limits]
force = "<= 12.5 N"
"""


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "cliff.toml"
    path.write_text(STUDY.format(trials=3000))
    return path


@pytest.fixture
def cliff(study):
    return tolstat.run(study, model=Cliff(), workers=2)


def planned(values, status=None):
    """Trials of one response that are over."""
    description = Description((), (Response("y", "1"),))
    found = Trials.planned(description, np.zeros((len(values), 0)))
    found.status[:] = Status.DONE if status is None else status
    found.responses[:, 0] = values
    return found


def test_a_large_error_out_of_limit_is_found(cliff):
    """One machine in 160 errs by 1 N: those chosen at random meet none of them."""
    found = report_of(cliff).responses["force"]
    error = found.integration_errors
    assert found.limited.yields.fraction_out_of_limit.value < 0.01
    assert error.at_random.trials == 30 and error.at_random.largest < 1.1e-3
    assert error.largest == pytest.approx(1, rel=2e-3)
    assert error.chosen["worst"].largest == error.largest
    assert error.chosen["near"].largest == pytest.approx(error.largest)
    # and what is claimed of others is no more than what random trials allow
    errs = np.mean(cliff.column("force") > 12.6)
    assert errs < error.above == pytest.approx(1 - 0.05 ** (1 / 30))


def test_a_jam_within_the_limit_is_found():
    """Responses of one machine in 400 lie apart, within the limit."""
    y = np.random.default_rng(0).uniform(0, 0.01, 4000)
    apart = np.arange(7, 4000, 400)
    y[apart] = np.linspace(0.3, 0.9, len(apart))
    # of a seed by which chance alone meets none of them
    chosen = select(planned(y), {"y": Limit(-np.inf, 0.95)}, 3)
    at_random = chosen.trials[chosen.at_random]
    assert not np.isin(apart, at_random).any()
    spread = chosen.trials[(chosen.reasons["y"] & Reason.SPREAD) > 0]
    assert np.isin(apart, spread).sum() >= 8


def test_both_sides_of_each_end_of_a_limit():
    rng = np.random.default_rng(3)
    y, status = rng.normal(size=2000), np.full(2000, Status.DONE)
    status[::7] = Status.NOT_FINITE
    y[::7] = np.nan
    limit = Limit(-1.0, 2.0)
    chosen = select(planned(y, status), {"y": limit}, 1)
    near = chosen.trials[(chosen.reasons["y"] & Reason.NEAR) > 0]
    done = np.flatnonzero(status == Status.DONE)
    for end in limit.permitted:
        below, above = done[y[done] < end], done[y[done] > end]
        assert set(below[np.argsort(-y[below])[:4]]) <= set(near)
        assert set(above[np.argsort(y[above])[:4]]) <= set(near)
    assert len(near) == 16


def test_a_value_equal_to_an_end_lies_within():
    values = np.array([0.0, 1.0, 1.0, 2.0, 3.0])
    upper = next_to(values, Limit(-np.inf, 1.0), 1.0, 1)
    lower = next_to(values, Limit(1.0, np.inf), 1.0, 1)
    assert upper.tolist() == [1, 3] and lower.tolist() == [1, 0]


def test_a_spread_reaches_from_the_least_to_the_largest():
    values = np.random.default_rng(1).permutation(np.arange(101.0))
    found = np.sort(values[spread(values, 5)])
    np.testing.assert_array_equal(found, [0, 25, 50, 75, 100])
    assert spread(np.zeros(9), 5).tolist() == [0] and not len(spread(values[:0], 5))


def test_without_limits_the_extremes_of_every_response(study):
    text = study.read_text()
    study.write_text(text[: text.index("[limits]")])
    run = tolstat.run(study, model=Cliff())
    audited = run.audited
    assert set(audited.chosen_by) == {"force", "other"}
    for name, reasons in audited.chosen_by.items():
        values = np.where(run.status == Status.DONE, run.column(name), np.nan)
        chosen = audited.trials[reasons == Reason.SPREAD]
        assert {np.nanargmin(values), np.nanargmax(values)} <= set(chosen)
        assert set(np.unique(reasons)) == {0, Reason.SPREAD}


def test_the_choice_depends_only_on_the_study(study, tmp_path):
    found = []
    for workers, block in ((1, 7), (2, 64)):
        with Workers(workers, block=block) as crew:
            path = tmp_path / f"{workers}.h5"
            found.append(execute(load(study, model=Cliff()), path, crew).audited)
    one, two = found
    np.testing.assert_array_equal(one.trials, two.trials)
    np.testing.assert_array_equal(one.at_random, two.at_random)
    assert list(one.chosen_by) == ["force"]
    np.testing.assert_array_equal(one.chosen_by["force"], two.chosen_by["force"])
    for name, values in one.responses.items():
        np.testing.assert_array_equal(values, two.responses[name])


def test_more_trials_keep_the_random_choice(cliff, study):
    few = cliff.audited
    more = tolstat.run(study, model=Cliff(), trials=5000, force=True).audited
    random = more.trials[more.at_random]
    assert len(random) == 50 and (random // 100 == np.arange(50)).all()
    np.testing.assert_array_equal(random[:30], few.trials[few.at_random])
    np.testing.assert_array_equal(random, random_trials(5, 5000))


def test_trials_near_the_limit_are_integrated_again(tmp_path):
    """A limit where many machines lie, and errors that carry some across."""
    path = tmp_path / "dense.toml"
    path.write_text(STUDY.format(trials=3000).replace("<= 12.5 N", "<= 10 N"))
    run = tolstat.run(path, model=Wavy())
    found = report_of(run).responses["force"]
    error = found.integration_errors
    rows = np.column_stack([run.column(f"part_{i}") for i in (1, 2)])
    precise = Wavy().evaluate(rows, CliffSettings(1e-6)).responses[:, 0]
    done = run.status == Status.DONE
    true = np.count_nonzero(((run.column("force") > 10) != (precise > 10))[done])
    assert true > 2
    assert error.changed == true and found.limited.yields.words == "not met"
    beyond = np.mean(precise[done] > 10) - np.mean(run.column("force")[done] > 10)
    assert error.effect.fraction_out_of_limit == pytest.approx(
        -beyond * done.mean(), abs=1e-12
    )


def test_an_audit_is_cheap():
    """Another hundredth of the trials, and 50 of each limited response."""
    rng = np.random.default_rng(2)
    for trials in (50, 1000, 100_000):
        limit = {"y": Limit(-1.0, 1.0)}
        chosen = select(planned(rng.normal(size=trials)), limit, 1)
        assert len(chosen.trials) <= 2 * np.ceil(trials / 100) + 2 * 8 + 12 + 10 + 20


def test_trials_chosen_by_one_response_do_not_represent_another(cliff):
    """What is rare in force was chosen often; of other it is not rarer for that."""
    found = report_of(cliff).responses
    tight = {"rtol": 1e-6}
    precise = Cliff().evaluate(
        np.column_stack([cliff.column(f"part_{i}") for i in (1, 2)]),
        CliffSettings(**tight),
    )
    done = cliff.status == Status.DONE
    true = np.mean((cliff.column("other") - precise.responses[:, 1])[done])
    moved = found["other"].integration_errors.effect.mean
    assert true == pytest.approx(6e-3, abs=2e-3)  # of 160 machines one by 1 N
    assert abs(moved - true) < 5e-3
    assert found["other"].integration_errors.chosen == {}


def test_a_contributor_named_audit_does_not_change_the_choice():
    """Of a batch of that name each hundredth was chosen by how long its part is."""
    first = np.arange(0, 5000, 100)
    chosen = random_trials(5, 5000) - first
    batch = Random().unit_samples(5, {"audit": 0}, len(first))[:, 0]
    assert np.mean(chosen == (100 * batch).astype(int)) < 0.2


def test_a_sure_audit_bounds_what_it_cannot_see(study):
    """ceil(3.7/(p0 - p_upper)) random trials, for the limit that needs most."""
    text = study.read_text()
    limits = text[text.index("[limits]") :]
    met = limits.replace(
        limits.splitlines()[1], 'force = { limit = "<= 20 N", yield = "97 %" }'
    )
    study.write_text('audit = "sure"\n' + text.replace(limits, met))
    run = tolstat.run(study, model=Cliff())
    yields = tolstat.summary(run).limits["force"].yields
    room = 0.03 - yields.fraction_out_of_limit.upper
    number = int(np.count_nonzero(run.audited.at_random))
    assert number == min(np.ceil(3.7 / room), run.trials) > 0.01 * run.trials
