"""Runs that end when they are precise enough."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

import tolstat
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.statistics.intervals.quantiles import quantiles
from tolstat.study.study import load

STUDY = """\
model = "toy"
seed = 1
trials = {{ until = {rule}, at_most = {at_most} }}
[deviations]
part = "+-0.5 mm"
[limits]
gap = "<= 1 mm"
"""


@pytest.fixture
def study(tmp_path):
    def write(rule, at_most=20_000):
        path = tmp_path / "until.toml"
        path.write_text(STUDY.format(rule=rule, at_most=at_most))
        return path

    return write


def test_it_ends_when_the_precision_is_reached(toy, study):
    run = tolstat.run(study('"gap p95 +-3 %"'), model=toy, workers=2)
    stages = list(run.stopped.stages)
    assert stages[0] == 1024 and stages[-1] == run.trials < 20_000
    assert run.stopped.reached and run.stopped.rules == ("gap p95 +-3 %",)
    found = quantiles(run.column("gap"), [0.95])[0.95]
    assert (found.upper - found.lower) / 2 <= 0.03 * found.value
    for trials in stages[:-1]:
        earlier = quantiles(run.column("gap")[:trials], [0.95])[0.95]
        assert (earlier.upper - earlier.lower) / 2 > 0.03 * earlier.value


def test_the_trials_are_those_of_a_run_of_that_length(toy, study, tmp_path):
    path = study('"gap p95 +-3 %"')
    run = tolstat.run(path, model=toy, workers=2)
    same = tolstat.run(
        path, model=toy, trials=run.trials, workers=1, output=tmp_path / "same.h5"
    )
    assert same.stopped is None
    for name in ("part_1", "gap", "status", "trial"):
        np.testing.assert_array_equal(run.column(name), same.column(name))
    assert run.nominal_values == same.nominal_values
    assert run.limits == same.limits and run.assumed == same.assumed
    again = tolstat.run(path, model=toy, workers=1, force=True)
    np.testing.assert_array_equal(run.column("gap"), again.column("gap"))


def test_it_ends_at_the_greatest_number_of_trials(toy, study):
    run = tolstat.run(study('"gap p95 +-0.1 %"', 3000), model=toy, workers=2)
    assert run.trials == 3000 and not run.stopped.reached
    assert run.stopped.stages == (1024, 3000)
    assert run.stopped.wanted > 100_000
    assert tolstat.open(run.path).stopped == run.stopped


def test_an_unreachable_precision_is_reported_after_the_first_stage(toy, study):
    seen = []
    tolstat.run(study('"gap p95 +-0.1 %"', 3000), model=toy, progress=seen.append)
    told = [each for each in seen if each.wanted]
    assert len(told) == 1 and told[0].over == 1024 and told[0].wanted > 100_000
    seen.clear()
    path = study('"gap p95 +-3 %"')
    tolstat.run(path, model=toy, progress=seen.append, force=True)
    assert not any(each.wanted for each in seen)


def test_all_of_several_rules_are_reached(toy, study):
    rules = '["gap p95 +-5 %", "gap beyond +-0.5 pp", "gap mean +-0.01 mm"]'
    run = tolstat.run(study(rules), model=toy, workers=2)
    assert run.stopped.reached
    assert len(run.stopped.rules) == 3
    alone = tolstat.run(study('"gap p95 +-5 %"'), model=toy, workers=2, force=True)
    assert alone.trials <= run.trials


def test_a_rule_is_read_as_it_is_written(toy, study):
    until = load(
        study('["gap median +-2 um", "gap beyond +-20 % of itself"]'), model=toy
    )
    first, second = until.until.precisions
    assert (first.statistic.share, first.within, first.relative) == (0.5, 2e-6, False)
    assert (second.statistic.kind, second.relative) == ("beyond", True)
    assert second.within == pytest.approx(0.2) and until.trials == 20_000


def test_sobol_trials_can_be_extended_until(toy, study):
    path = study('"gap mean +-0.004 mm"')
    path.write_text('sampling = "sobol"\n' + path.read_text())
    run = tolstat.run(path, model=toy, workers=2)
    assert run.stopped.reached and run.sampled.replicates == 16


@pytest.mark.parametrize("slow", ["stages.trials_wanted", "run_loop.halved_shares"])
def test_it_stops_during_a_long_check(toy, study, monkeypatch, slow):
    """Means and sigmas of a million trials take ten seconds."""
    looked = threading.Event()

    def look(*_):
        looked.set()
        time.sleep(5.0)
        return 0.0

    monkeypatch.setattr(f"tolstat.execution.{slow}", look)
    began = time.monotonic()
    path = study('"gap p95 +-3 %"')
    with Workers(1, looked.is_set) as crew:
        run = execute(load(path, model=toy), path.with_suffix(".h5"), crew)
    assert looked.is_set() and time.monotonic() - began < 4.0
    assert run.ended >= 1024 and not run.complete
