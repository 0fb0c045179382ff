"""Runs whose trials are thinned until every limit is decided."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.cli.command_line import call
from tests.execution.same_runs import Enough, same
from tests.studies.deciding import PERMITTED, Three, limits_of
from tolstat.answers.report.report_answer import StepKind
from tolstat.errors import Remedy, RunFileError
from tolstat.execution import until_decided
from tolstat.execution.execute import execute, go_on
from tolstat.execution.until_decided import UntilDecided
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.statistics.intervals.weights import COLUMNS
from tolstat.study.study import load

ENDS = limits_of(0.5)
STUDY = {
    "model": "three", "trials": "decide", "seed": 3, "deviations": {"part": "+-3 mm"},
    "limits": {name: ENDS[name] for name in ("sum", "jam")},
}  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def dear():
    """Let plain trials take too long."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(until_decided, "PATIENCE", 0.0)
        yield


@pytest.fixture(scope="module")
def decided(dear, tmp_path_factory):
    path = tmp_path_factory.mktemp("thinned") / "run.h5"
    return tolstat.run(STUDY, model=Three(), output=path)


def test_both_limits_are_met_with_fewer_trials(decided):
    assert decided.stopped.reached and decided.complete
    assert decided.stopped.stages == (decided.trials,)
    assert decided.random_trials == 2048
    assert decided.trials < decided.thinned.drawn[-1] / 1.5
    report = tolstat.report(decided)
    assert report.verdicts == {"sum": "met", "jam": "met"}
    assert "drawn" in " ".join(report.trials.notes)
    assert "after so many trials" in report.html()  # how the interval narrowed
    for limited in report.limits.values():
        share = limited.yields.fraction_out_of_limit
        assert share.lower < 0.5 * PERMITTED < share.upper <= PERMITTED


def test_other_numbers_rest_on_the_first_trials(decided):
    plain = tolstat.run({**STUDY, "trials": 2048}, model=Three())
    np.testing.assert_array_equal(plain.column("sum"), decided.column("sum")[:2048])
    ours, theirs = (tolstat.report(run).responses["sum"] for run in (decided, plain))
    assert ours.mean == theirs.mean and ours.quantiles == theirs.quantiles
    scenario = tolstat.what_if(decided, {"part_1": "+-2 mm"}, model=Three())
    assert scenario.json()


def test_a_weighted_scenario_is_judged_by_the_first_trials(decided):
    plain = tolstat.run({**STUDY, "trials": 2048}, model=Three())
    wider, limits = {"part": "+-3.5 mm"}, {"sum": ENDS["sum"]}
    ours, theirs = (
        tolstat.what_if(run, wider, model=Three(), evaluate=False)
        for run in (decided, plain)
    )
    for name in STUDY["limits"]:
        yields, plainly = (
            answer.responses[name].scenario.limited.yields for answer in (ours, theirs)
        )
        assert yields == plainly
    assert ours.all_limits.scenario == theirs.all_limits.scenario
    assert "first 2048 trials" in ours.notes[0]
    of_all = tolstat.what_if(decided, {}, limits=limits, model=Three())
    of_first = tolstat.what_if(plain, {}, limits=limits, model=Three())
    narrow, wide = (
        answer.responses["sum"].scenario.limited.yields.fraction_out_of_limit
        for answer in (of_all, of_first)
    )
    assert narrow.upper - narrow.lower < wide.upper - wide.lower


def test_thinned_trials_are_random_trials_of_the_study(decided):
    drawn = load({**STUDY, "trials": int(decided.thinned.drawn[-1])}, model=Three())
    every = {tuple(row) for row in drawn.deviations()}
    frame = decided.frame()
    rows = frame[[f"part_{i}" for i in range(4)]].to_numpy()
    assert {tuple(row) for row in rows} <= every
    assert {*COLUMNS} <= {*frame.columns}


def test_the_file_is_whole(decided):
    assert tolstat.verify(decided.path, model=Three()).whole
    assert tolstat.replay(decided, decided.trials - 1, model=Three())
    memory = tolstat.run(STUDY, model=Three(), workers=1)
    assert memory.trials == decided.trials
    np.testing.assert_array_equal(memory.column("jam"), decided.column("jam"))


def test_a_stopped_one_ends_as_if_it_had_not_been(decided, tmp_path):
    path, enough = tmp_path / "part.h5", Enough(2500)
    with Workers(2, enough, block=100) as crew:
        part = execute(load(STUDY, model=Three()), path, crew, progress=enough.tell)
    assert not part.complete and part.thinned
    words = f"{part.ended} trials have run; deciding was stopped"
    assert words in " ".join(tolstat.report(part).trials.notes)
    page = " ".join(tolstat.report(part).html().split())
    assert f"So far {part.ended} trials have run" in page
    assert f"of {part.trials} trials" not in page
    assert tolstat.report(part).responses["sum"].limited  # of whole stages
    enough = Enough(part.ended + 300)
    with Workers(2, enough, block=100) as crew:
        part = go_on(path, crew, model=Three(), progress=enough.tell)
    assert same(tolstat.resume(path, model=Three()), decided)


def test_a_run_is_continued_and_ends_with_its_budget(tmp_path):
    path = tmp_path / "run.h5"
    tolstat.run({**STUDY, "trials": 2000}, model=Three(), output=path)
    run = tolstat.decide(path, at_most=3000, model=Three())
    assert run.thinned and not run.stopped.reached and 2500 < run.trials <= 3000
    longer = tolstat.decide(path, model=Three())
    assert longer.stopped.reached and longer.random_trials == run.random_trials
    before = path.read_bytes()
    tolstat.decide(path, model=Three())  # it is decided
    assert path.read_bytes() == before
    for name in ("sum", "thinned-chance"):
        np.testing.assert_array_equal(
            longer.column(name)[: run.trials], run.column(name)
        )


def test_time_ends_a_stage_and_whole_ones_count(decided, tmp_path, monkeypatch):
    path = tmp_path / "run.h5"
    with monkeypatch.context() as patch:
        patch.setattr(UntilDecided, "is_late", lambda rule, trials: trials.ended > 2500)
        with Workers(2, block=50) as crew:
            run = execute(load(STUDY, model=Three()), path, crew)
    assert run.complete and run.stopped.stages == (run.trials,)
    assert run.trials in decided.thinned.ends and 2048 < run.trials < 2800
    assert tolstat.verify(path, model=Three()).whole
    assert tolstat.report(run).limits["sum"].yields.verdict == "undecided"
    longer = tolstat.decide(path, model=Three())
    np.testing.assert_array_equal(longer.column("sum"), decided.column("sum"))


def test_a_comparison_says_that_it_rests_on_random_trials(decided):
    (less,) = tolstat.compare(decided, decided).differences
    assert less.pairing.trials == 2048
    assert "the first 2048 trials alone" in less.pairing.words


def test_an_export_says_that_trials_are_not_equally_likely(decided, tmp_path):
    done = call("export", decided.path, "-o", tmp_path / "run.csv")
    assert done.exit_code == 0
    assert "one over its thinned-chance" in done.stdout


def test_an_extension_is_refused(decided):
    with pytest.raises(RunFileError, match="thinned") as refused:
        tolstat.extend(decided.path, decided.trials + 100, model=Three())
    assert [one.remedy for one in refused.value.advice] == [Remedy.DECIDE]


def test_an_undecided_one_is_decided_further_not_extended(tmp_path):
    path, ends = tmp_path / "run.h5", limits_of(1.25)
    limits = {name: ends[name] for name in ("sum", "jam")}
    rule = {"until": "decide", "at_most": 2400}
    study = {**STUDY, "trials": rule, "limits": limits}
    run = tolstat.run(study, model=Three(), output=path)
    report = tolstat.report(run)
    jam = report.findings.limits["jam"]
    assert run.thinned and jam.verdict == "undecided"
    assert jam.trials_that_decide == 0  # not known: no evidence yet
    assert jam.no_cause.startswith("too few") and not jam.trials_that_tell
    (step,) = (x for x in report.findings.steps if x.kind is StepKind.ADD_TRIALS)
    assert step.responses == ("jam",) and not step.causes_of and not step.trials
    assert step.commands[0].words[:2] == ("decide", path)
    page = " ".join(report.html().split())
    assert "1e9" not in page and "tolstat extend" not in page and "about 0" not in page
    assert "Add trials to decide" in page
