"""Runs whose trials are thinned until every limit is decided."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tolstat
from tests.answers.browser import Page
from tests.answers.page_checks import steps_of
from tests.cli.command_line import call
from tests.execution.same_runs import Enough, same
from tests.studies.deciding import PERMITTED, Three, limits_of
from tests.studies.deciding import decided as trials_of
from tolstat.answers.next_steps import StepKind
from tolstat.errors import Remedy, RunFileError
from tolstat.execution.execute import execute, go_on
from tolstat.execution.until_decided import UntilDecided
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.statistics.deciding.chances import Ranking, near_chances
from tolstat.statistics.deciding.thinned_share import thinned_share
from tolstat.statistics.intervals.weights import COLUMNS, Thinned
from tolstat.statistics.limits.limit import Limit, margins
from tolstat.study.sampling import deciding, rule_stored
from tolstat.study.study import load
from tolstat.toml import toml_table

ENDS = limits_of(0.5)
SLOW = {"until": "decide", "slow": True}
STUDY = {
    "model": "three", "trials": SLOW, "seed": 3, "deviations": {"part": "+-3 mm"},
    "limits": {name: ENDS[name] for name in ("sum", "jam")},
}  # fmt: skip


@pytest.fixture(scope="module")
def decided(tmp_path_factory):
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
    page = report.html()
    assert "after so many trials" in page  # how the interval narrowed
    assert "too few random trials (" in page and "too few (" not in page
    for limited in report.limits.values():
        share = limited.yields.fraction_out_of_limit
        assert share.lower < 0.5 * PERMITTED < share.upper <= PERMITTED


def test_the_kind_of_model_alone_decides_what_is_thinned(monkeypatch):
    monkeypatch.setattr("tolstat.statistics.sample_size.MOST_PLAIN", 5000)
    ways = True, False, None
    thinned, plain, by_kind = (trials_of(2, 2, slow=way)[1] for way in ways)
    assert thinned < plain / 3 and by_kind == plain  # a formula, however slow
    monkeypatch.setattr(Three, "integrates", True)
    assert trials_of(2, 2, slow=None)[1] == thinned


@pytest.fixture(scope="module")
def plain():
    return tolstat.run({**STUDY, "trials": 2048}, model=Three())


def test_a_slow_run_says_how_few_trials_decide(decided, plain):
    slow = replace(plain, times={**plain.times, "seconds": 200.0})
    report = tolstat.report(slow)
    (step,) = report.findings.steps
    assert step.kind is StepKind.DECIDE and step.trials > 2 * step.evaluated
    assert decided.trials / 2 < step.evaluated < 2 * decided.trials
    (command,) = map(str, step.commands)
    assert command == "tolstat decide run.h5 --slow --machine FILE.py:NAME"
    (words,) = steps_of(report)
    assert f"in all, of which {step.evaluated} are evaluated (about" in words
    (quick,) = tolstat.report(plain).findings.steps
    assert not quick.evaluated and "--slow" not in str(quick.commands[0])


@pytest.mark.parametrize("at_most", [None, 3000])
def test_a_study_stays_slow_with_another_budget(at_most):
    slow = load(STUDY, model=Three(), trials=deciding(at_most)).until
    assert slow.slow and slow.rules[0].endswith(", slow")
    assert rule_stored(slow.rules) == deciding(at_most, slow=True)
    other = load(STUDY, model=Three(), trials=deciding(at_most, slow=False)).until
    assert other.slow is False and rule_stored(other.rules)["slow"] is False


def test_other_numbers_rest_on_the_first_trials(decided, plain):
    np.testing.assert_array_equal(plain.column("sum"), decided.column("sum")[:2048])
    ours, theirs = (tolstat.report(run).responses["sum"] for run in (decided, plain))
    assert ours.mean == theirs.mean and ours.quantiles == theirs.quantiles
    scenario = tolstat.what_if(decided, {"part_1": "+-2 mm"}, model=Three())
    assert scenario.json()


def test_a_scenario_without_a_change_is_its_baseline(decided):
    same = tolstat.what_if(decided, {"part": "+-3 mm"}, model=Three(), evaluate=True)
    assert same.trials == decided.trials and not same.baseline.run.thinned
    assert "random ones" in same.notes[-1]
    for response in same.responses.values():
        assert response.baseline == response.scenario
        if limit := response.difference.limit:
            assert limit.fraction_out_of_limit_difference.value == 0
            assert limit.worse == limit.better == 0


def test_a_weighted_scenario_is_judged_by_the_first_trials(decided, plain):
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


def test_a_changed_study_is_decided_so_too():
    """Though a command asked for it, and not the study."""
    run = tolstat.decide(
        {**STUDY, "trials": 100}, model=Three(), at_most=2500, slow=True
    )
    text = tolstat.fresh_study(run, {"part_1": "+-2.9 mm"}, model=Three())
    assert run.thinned and toml_table(text)["trials"] == SLOW


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


RARE = 50e-6  # permitted: 74 000 trials would show it, if none is out of limit


@pytest.fixture(scope="module")
def rare(tmp_path_factory):
    path = tmp_path_factory.mktemp("rare") / "run.h5"
    limits = {"sum": limits_of(0.5, RARE)["sum"], "jam": ENDS["jam"]}
    return tolstat.run({**STUDY, "limits": limits}, model=Three(), output=path)


def test_far_trials_are_left_out_for_a_limit_that_permits_few(rare, decided):
    far = rare.thinned.least < 0
    assert rare.stopped.reached and 0 < far.sum() < 6000
    assert (rare.thinned.chance[far] == 1).all()
    both = tolstat.report(rare)
    (few, many) = (both.limits[name].yields for name in ("sum", "jam"))
    share = few.fraction_out_of_limit
    assert share.lower < 0.5 * RARE < share.upper <= RARE
    assert few.words == "met (if no kind of failure was missed)"
    assert few.missed == pytest.approx(3.69 / 2048, rel=2e-3)
    # any other limit rests on stages with a chance for all trials
    assert many.words == "met" and not many.missed
    out = rare.beyond("jam")[: rare.thinned.covering]
    stages = rare.thinned.first(len(out))
    assert many.fraction_out_of_limit == thinned_share(out, stages)
    words = " ".join(Page(both.html()).text.split())
    assert "if no kind of failure was missed, one of up to 1800 ppm" in words
    assert "the first 2048 trials bound such a region at 1800 ppm" in words


def test_all_trials_tell_of_a_remedy_and_of_all_limits():
    limits = {"sum": limits_of(4, RARE)["sum"]}
    run = tolstat.run({**STUDY, "limits": limits}, model=Three())
    slow = replace(run, times={**run.times, "seconds": 1e6})  # proves nothing
    report = tolstat.report(slow)
    share = report.limits["sum"].yields.fraction_out_of_limit
    assert report.verdicts == {"sum": "not met"}
    assert run.beyond("sum")[:2048].sum() < 3  # too few of them to tell
    assert report.all_limits.within == share.complement
    remedy = report.findings.remedy
    (step,) = remedy.steps
    ((_, after),) = remedy.limits.values()
    assert step.before == share.complement and after.upper < RARE < share.lower
    assert not remedy.met  # trials without a chance may be out of limit after it


def test_far_trials_tell_nothing_of_other_limits(rare):
    """Skipped as far from the run's limits, they may be out of another one."""
    other = tolstat.limited(rare, {"sum": limits_of(20, RARE)["sum"]}, model=Three())
    assert other.trials == rare.thinned.covering
    limited = tolstat.report(other).limits["sum"]
    share = limited.yields.fraction_out_of_limit
    assert share.lower < 20 * RARE < share.upper and not limited.yields.missed
    assert (
        tolstat.limited(rare, {"sum": rare.limits["sum"].words}).trials == rare.trials
    )
    page = tolstat.explore(rare, model=Three()).html()
    assert "Only the random trials" in page


def test_a_rare_one_is_whole_and_resumed(rare, tmp_path):
    assert tolstat.verify(rare.path, model=Three()).whole
    path, enough = tmp_path / "part.h5", Enough(rare.thinned.covering + 100)
    study = {**STUDY, "limits": rare.study.table["limits"]}
    with Workers(2, enough, block=100) as crew:
        part = execute(load(study, model=Three()), path, crew, progress=enough.tell)
    assert not part.complete and tolstat.report(part).html()
    assert same(tolstat.resume(path, model=Three()), rare)


def test_far_trials_stay_where_ranks_tell_little():
    trials, rng = 4096, np.random.default_rng(1)
    x, noise = rng.standard_normal((trials, 3)), rng.standard_normal(trials)
    limit = Limit(-np.inf, 4.0, 1 - RARE)
    one = np.ones(trials)
    plain = Thinned(one, trials * one, one)
    for part, sure in ((0.2, True), (0.9, False)):
        y = np.hypot(1, -part) ** -1 * (x[:, 0] + part * noise)
        ranking = Ranking.fitted(x, y, limit)
        near = near_chances(ranking, margins(y, limit.permitted), plain, RARE)
        assert (near is not None) == sure
        if near:
            kept = near.of_trials(x) == 1
            assert kept[np.argsort(y)[-20:]].mean() >= 0.9 and kept.mean() < 0.12


def test_a_stopped_one_ends_as_if_it_had_not_been(decided, tmp_path):
    path, enough = tmp_path / "part.h5", Enough(2500)
    with Workers(2, enough, block=100) as crew:
        part = execute(load(STUDY, model=Three()), path, crew, progress=enough.tell)
    assert not part.complete and part.thinned
    words = f"{part.ended} trials have run; deciding was stopped"
    report = tolstat.report(part)
    assert words in " ".join(report.trials.notes)
    page = " ".join(report.html().split())
    assert f"So far {part.ended} trials have run" in page
    assert f"of {part.trials} trials" not in page
    assert report.responses["sum"].limited  # of whole stages
    enough = Enough(part.ended + 300)
    with Workers(2, enough, block=100) as crew:
        part = go_on(path, crew, model=Three(), progress=enough.tell)
    assert same(tolstat.resume(path, model=Three()), decided)


def test_a_run_is_continued_and_ends_with_its_budget(tmp_path):
    path = tmp_path / "run.h5"
    tolstat.run({**STUDY, "trials": 2000}, model=Three(), output=path)
    run = tolstat.decide(path, at_most=3000, slow=True, model=Three())
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


def test_a_comparison_has_the_fractions_of_the_reports(decided, rare, plain):
    for runs in ((decided, rare), (rare, decided), (plain, decided)):
        (less,) = tolstat.compare(*runs).differences
        assert less.pairing.trials == 2048
        assert "the first 2048 trials" in less.pairing.words
        missed = "if no kind of failure was missed" in less.pairing.words
        assert missed == (rare in runs)
        for name in STUDY["limits"]:
            limit = less.responses[name].limit
            for i, run in enumerate(runs):
                limited = tolstat.summary(run).limits[name]
                share = limited.yields.fraction_out_of_limit
                ours = limit.fractions_out_of_limit[i]
                assert ours.value == share.value
                assert ours == share or run is plain  # there for a single look
            more = limit.fraction_out_of_limit_difference
            first, second = limit.fractions_out_of_limit
            ends = {run.limits[name].permitted for run in runs}  # one: trials are equal
            assert more.value == (len(ends) > 1) * (second.value - first.value)
            assert more.lower < more.value < more.upper
            assert limit.worse is limit.better is None


def test_far_trials_tell_nothing_of_the_limit_of_another_design(rare, plain):
    other = tolstat.limited(plain, {"cubic": ENDS["cubic"]})
    (less,) = tolstat.compare(rare, other).differences
    limit, out = less.responses["cubic"].limit, rare.column("cubic")
    assert limit.trials == (rare.thinned.covering, 2048)
    stages = rare.thinned.first(limit.trials[0])
    out = out[: limit.trials[0]] > float(ENDS["cubic"][3:])
    assert limit.fractions_out_of_limit[0] == thinned_share(out, stages)


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
    rule = {**SLOW, "at_most": 2400}
    study = {**STUDY, "trials": rule, "limits": limits}
    run = tolstat.run(study, model=Three(), output=path)
    report = tolstat.report(run)
    (first, *_) = report.findings.remedy.steps
    assert first.before == report.all_limits.within  # one yield on a page
    jam = report.findings.limits["jam"]
    assert run.thinned and jam.verdict == "undecided"
    assert jam.trials_that_decide == 0  # not known: no evidence yet
    assert jam.no_cause.startswith("too few") and not jam.trials_that_tell
    (step,) = (x for x in report.findings.steps if x.kind is StepKind.DECIDE)
    assert step.responses == ("jam",) and not step.causes_of and not step.trials
    assert step.commands[0].words[:2] == ("decide", path)
    page = " ".join(report.html().split())
    assert "1e9" not in page and "tolstat extend" not in page and "about 0" not in page
    assert "Add trials to decide" in page
