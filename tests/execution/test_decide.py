"""Runs that end when every limit is met or not met."""

from __future__ import annotations

import time

import numpy as np
import pytest

import tolstat
from tests.conftest import Toy
from tests.execution.same_runs import Enough, same
from tolstat.errors import Remedy, RunFileError, StudyError
from tolstat.execution.execute import execute, go_on
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.statistics.deciding.looks import looks_from
from tolstat.statistics.intervals.shares import anytime_valid
from tolstat.study.study import load

# 0.35 % of trials fail, some more are out of limit: more than 0.27 %, by a third
CLOSE = """\
model = "toy"
trials = {trials}
seed = 1
[deviations]
part = "+-1 mm"
[limits]
gap = "<= 3 mm"
"""
DECIDE = '"decide"'


@pytest.fixture
def study(tmp_path):
    def write(trials=DECIDE, text=CLOSE):
        path = tmp_path / "study.toml"
        path.write_text(text.format(trials=trials))
        return path

    return write


@pytest.fixture
def decided(study, tmp_path):
    """A run with more trials than it had rows at first."""
    return tolstat.run(study(), model=Toy(), output=tmp_path / "decided.h5")


def test_it_ends_at_the_first_look_with_a_verdict(decided):
    assert decided.stopped.reached and decided.trials > 8192
    out = decided.beyond("gap")
    for look in looks_from(0):
        share = anytime_valid(int(out[:look].sum()), look)
        assert (share.lower > 0.0027) == (look == decided.trials)
        if look == decided.trials:
            break


def test_its_trials_are_those_of_any_run_of_its_length(decided, study, tmp_path):
    plain = tolstat.run(
        study(), model=Toy(), trials=decided.trials, workers=1, output=tmp_path / "p.h5"
    )
    assert same(decided, plain, but="stopped")
    assert tolstat.verify(decided.path, model=Toy()).whole
    memory = tolstat.run(
        {"model": "toy", "trials": "decide", "seed": 1,
         "deviations": {"part": "+-1 mm"}, "limits": {"gap": "<= 3 mm"}},
        model=Toy(),
    )  # fmt: skip
    np.testing.assert_array_equal(memory.column("gap"), decided.column("gap"))
    assert memory.stopped == decided.stopped


@pytest.mark.parametrize("trials", ["4096", "9000"])
def test_a_run_is_continued_until_it_is_decided(decided, study, trials, tmp_path):
    path = tmp_path / "run.h5"
    tolstat.run(study(trials), model=Toy(), output=path)
    run = tolstat.decide(path, model=Toy())
    np.testing.assert_array_equal(run.column("gap"), decided.column("gap"))
    assert run.stopped == decided.stopped and run.rules == decided.rules
    before = path.read_bytes()
    again = tolstat.decide(path, model=Toy())
    assert same(again, run) and path.read_bytes() == before


def test_a_refusal_says_how_to_decide_regardless(study, tmp_path):
    path = tmp_path / "run.h5"
    file = study("4096")
    tolstat.run(file, model=Toy(), output=path)
    file.write_text(file.read_text().replace("seed = 1", "seed = 2"))
    with pytest.raises(RunFileError, match="cannot be resumed") as refused:
        tolstat.decide(path, model=Toy())
    assert Remedy.DECIDE_REGARDLESS in [one.remedy for one in refused.value.advice]
    run = tolstat.decide(path, model=Toy(), regardless=True)
    assert run.stopped.reached and run.sampled.seed == 1


def test_a_run_that_is_decided_is_unchanged(study, tmp_path):
    path = tmp_path / "run.h5"
    text = CLOSE.replace("3 mm", "1 mm")
    run = tolstat.run(study("1000", text=text), model=Toy(), output=path)
    assert same(tolstat.decide(path, model=Toy()), run)


def test_a_stopped_one_ends_as_if_it_had_not_been(decided, study, tmp_path):
    path, times = tmp_path / "part.h5", 0
    enough = Enough(3000)
    with Workers(2, enough, block=500) as crew:
        part = execute(load(study(), model=Toy()), path, crew, progress=enough.tell)
    while not part.complete:
        times += 1
        enough = Enough(part.ended + 7000)
        with Workers(2, enough, block=500) as crew:
            part = go_on(path, crew, model=Toy(), progress=enough.tell)
    assert times > 2 and same(part, decided)


def test_a_stopped_decision_on_a_run_is_resumed_as_one(decided, study, tmp_path):
    path, enough = tmp_path / "run.h5", Enough(6000)
    tolstat.run(study("4096"), model=Toy(), output=path)
    with Workers(2, enough, block=500) as crew:
        part = go_on(path, crew, trials="decide", model=Toy(), progress=enough.tell)
    assert not part.complete and part.rules == ("decide",)
    run = tolstat.resume(path, model=Toy())
    np.testing.assert_array_equal(run.column("gap"), decided.column("gap"))
    assert run.stopped == decided.stopped


def test_it_ends_undecided_when_the_budget_is_used_up(study):
    rule = '{{ until = "decide", at_most = {} }}'
    run = tolstat.run(study(rule.format(9000)), model=Toy())
    assert run.trials == 9000 and not run.stopped.reached
    assert run.stopped.wanted > 9000 and run.stopped.at_most == 9000
    run = tolstat.run(study(rule.format('"1 ms"')), model=Toy(), force=True)
    assert run.trials <= 1024 and not run.stopped.reached


class Slow(Toy):
    """10 ms a trial."""

    def evaluate(self, deviations, settings):
        time.sleep(0.01 * len(deviations))
        return super().evaluate(deviations, settings)


def test_time_ends_a_stage(study, decided, tmp_path):
    path = tmp_path / "run.h5"
    rule = '{ until = "decide", at_most = "1 s" }'
    run = tolstat.run(study(rule), model=Slow(), workers=1, output=path)
    assert run.complete and not run.stopped.reached and 32 <= run.trials < 1024
    assert run.stopped.stages == (run.trials,)
    assert tolstat.verify(path, model=Toy()).whole
    longer = tolstat.decide(path, model=Toy(), regardless=True)
    np.testing.assert_array_equal(longer.column("gap"), decided.column("gap"))


def test_an_extended_one_has_a_number_of_trials(decided):
    longer = tolstat.extend(decided.path, decided.trials + 100, model=Toy())
    assert longer.complete and longer.rules == () and longer.stopped is None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[limits]\ngap = \"<= 3 mm\"", "", "no limit to decide"),
        ("seed = 1", 'seed = 1\nsampling = "sobol"', 'needs sampling = "random"'),
        (DECIDE, '{{ until = "decide", at_most = 0 }}', "whole number from 1"),
        (DECIDE, '{{ until = "decide", at_most = "0 s" }}', "time above zero"),
        (DECIDE, '{{ until = "decide", at_most = "5 mm" }}', "mm"),
        (DECIDE, '"decided"', '"decide"'),
    ],
)  # fmt: skip
def test_a_wrong_study_is_refused(study, old, new, words):
    text = CLOSE.replace("{trials}", DECIDE)
    assert old in text
    with pytest.raises(StudyError, match=words):
        load(study(text=text.replace(old, new)), model=Toy())


def test_a_run_without_random_trials_is_refused(study, tmp_path):
    path = tmp_path / "run.h5"
    text = CLOSE.replace("seed", 'sampling = "latin"\nseed')
    tolstat.run(study("64", text=text), model=Toy(), output=path)
    with pytest.raises(StudyError, match="has no verdict that holds"):
        tolstat.decide(path, model=Toy())
    text = text.replace("3 mm", "1 mm")  # its trials leave no doubt
    tolstat.run(study("1024", text=text), model=Toy(), output=path, force=True)
    with pytest.raises(StudyError, match="has no verdict that holds"):
        tolstat.decide(path, model=Toy())
    text = CLOSE.replace("[deviations]\npart =", "[grid]\npart_1 =").replace(
        'trials = {trials}\nseed = 1', 'sampling = "grid"'
    ).replace('"+-1 mm"', '["0 mm", "1 mm"]')  # fmt: skip
    tolstat.run(study(text=text), model=Toy(), output=path, force=True)
    with pytest.raises(RunFileError, match="runs exactly"):
        tolstat.decide(path, model=Toy())
