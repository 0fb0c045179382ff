"""Rare runs: known fractions out of limit, and the same bits on every way."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import shlex
import shutil
import tomllib
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from scipy.special import ndtr
from scipy.stats import norm

import tolstat
from tests.answers.browser import Page
from tests.answers.page_checks import rows_of, words_in
from tests.execution.audited import Cliff
from tests.execution.rare_chain import CHAIN
from tests.execution.same_runs import Enough, same
from tests.store.tampering import resealed
from tolstat.answers.next_steps import StepKind
from tolstat.answers.rare.rare_answer import normal_score, rare_summary
from tolstat.answers.rare.rare_document import STAGES
from tolstat.answers.run_entries import RunIndex, entry_of
from tolstat.answers.runs_document import progress_table
from tolstat.cli.main import main
from tolstat.errors import QuestionError, RunFileError, StudyError
from tolstat.execution.execute import execute
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.render.screen import as_text
from tolstat.store.assumed import SCORES
from tolstat.study.study import load
from tolstat.units.scale import PPM

SIGMA = np.hypot(0.1, 0.4 / 3)  # mm
DISTANCE = 0.8 / SIGMA
DRAWN = ("rare-stage", "rare-spread", "rare-distance", "rare-weight")


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "chain.toml"
    path.write_text(CHAIN)
    return path


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    (folder / "chain.toml").write_text(CHAIN)
    with Workers(1, block=5000) as crew:
        return execute(load(folder / "chain.toml"), folder / "chain.h5", crew)


@pytest.fixture
def run(whole, tmp_path):
    """A copy, to be tampered with."""
    return tolstat.open(shutil.copy(whole.path, tmp_path / "chain.h5"))


def like(one, other):
    for name in DRAWN:
        np.testing.assert_array_equal(one.column(name), other.column(name))
    return same(one, other)


def said_of(run):
    """What the summary of a run says."""
    return words_in(*tolstat.summary(run).document().blocks)


def stopped(study, path, trials):
    enough = Enough(trials)
    with Workers(2, enough, block=40) as crew:
        return execute(load(study), path, crew, progress=enough.tell)


def test_a_rare_report_says_what_to_do_next_and_what_is_assumed(study, tmp_path):
    part = stopped(study, tmp_path / "part.h5", 300)  # in the search
    report = tolstat.report(part)
    (step,) = report.findings.steps
    assert step.kind is StepKind.RESUME and report.trials.counted == 0
    assert repr(report) == "<tolstat rare: part.h5, gap undecided>"  # no "failed ppm"
    words = words_in(*report.document().blocks)
    assert f"{step.commands[0]}." in words
    assert "Deviations are independent." in words
    assert "anytime-valid" not in words and "may decide" not in words  # as plain runs


def test_a_share_of_1_ppm_is_estimated(run):
    found = rare_summary(run)
    out = found.fraction_out_of_limit
    truth = norm.sf(DISTANCE)
    assert truth < 1e-6 and found.verdict == "met"
    assert (
        found.fraction_out_of_limit.lower
        < truth
        < found.fraction_out_of_limit.upper
        < 1.3 * found.fraction_out_of_limit.lower
    )
    assert found.within.upper == 1 - out.lower
    # in the direction in which the gap closes
    first = found.failure_points[0]
    assert found.first_order == pytest.approx(norm.sf(first.distance), rel=1e-12)
    assert 0.7 * truth < found.first_order <= truth  # straight, of one end
    assert first.distance == pytest.approx(DISTANCE, rel=0.02)
    deviations = np.array([first.deviations[name] for name in "AB"]) * 1e3
    scores = deviations / [0.1, 0.4 / 3]
    assert scores @ [-0.1, 0.4 / 3] / SIGMA == pytest.approx(DISTANCE, rel=0.02)
    assert [first.off[name] for name in "AB"] == pytest.approx(scores)
    assert [first.scores[name] for name in "AB"] == pytest.approx(scores, abs=1e-3)
    assert first.leading == ["B", "A"]
    assert first._replace(scores={"A": -3.0, "B": 1.4}).leading == ["A"]
    words = (
        f"B {deviations[1]:.4f} mm (+{scores[1]:.3f} sigmas) and "
        f"A {deviations[0]:.4f} mm ({scores[0]:.3f} sigmas)"
    )
    assert words in said_of(run)
    assert tolstat.replay(run, first.trial).differences == ()
    # of a plain run: width over its root
    relative = (
        found.fraction_out_of_limit.upper - found.fraction_out_of_limit.lower
    ) / found.fraction_out_of_limit.value
    expected = (2 * norm.isf(0.025) / relative) ** 2 / out.value
    assert found.plain_trials == pytest.approx(expected, rel=1e-3)
    assert sum(stage.trials for stage in found.stages) == run.trials
    # those that repeat another trial are named once
    distances = [point.distance for point in found.failure_points]
    assert len(set(distances)) == 10 and distances == sorted(distances)


def test_a_uniform_part_near_its_end_is_named_by_probability(tmp_path):
    """It is 1.6 sigmas off, and the normal one beside it 3.5."""
    table = tomllib.loads(CHAIN)
    uniform = {"tolerance": "+-0.4 mm", "distribution": "uniform"}
    table["links"] = {
        "A": {"nominal": "30 mm", "tolerance": "+-0.3 mm"},
        **{name: {"nominal": "9 mm", **uniform} for name in "BC"},
        "D": {"nominal": "9 mm", "tolerance": "+-0.05 mm"},
    }
    table |= {"settings": {"gap": "A - B - C - D"}, "limits": {"gap": ">= 1.88 mm"}}
    table["trials"] = 8000
    run = tolstat.run(table, output=tmp_path / "run.h5")
    first = rare_summary(run).failure_points[0]
    assert first.leading[0] == "A" and set(first.leading) == set("ABC")
    assert all(abs(first.off[name]) < 0.5 * abs(first.off["A"]) for name in "BC")
    distance = math.hypot(*first.scores.values())
    assert distance == pytest.approx(first.distance, abs=2e-3)
    said = said_of(run)
    assert said.count("Most probable failure point that was met: ") == 1
    page = " ".join(Page(tolstat.report(run).html()).text.split())
    for name in "BC":
        farther = (0.4 - 1e3 * first.deviations[name]) / 0.8
        assert first.farther[name] == pytest.approx(farther, rel=1e-3)
        off = 1e3 * first.deviations[name]
        words = f"{name} {off:.4f} mm ({100 * farther:.2f} % of such parts lie farther"
        assert words in said and words in page
    assert f"A {1e3 * first.deviations['A']:.4f} mm ({first.off['A']:.3f} sig" in said


@pytest.mark.parametrize(
    ("at", "deviation", "score"),
    [
        ([0.0] * 257 + [1.0] * 256, 1.0, SCORES[257]),  # parts alike: the least far out
        ([0.0] * 257 + [1.0] * 256, 0.0, 0.0),
        (SCORES, 9.0, 8.0),
        (SCORES, -9.0, -8.0),
        (SCORES, -3.0, -3.0),
        (2 * ndtr(SCORES), 2 * norm.cdf(-3.01), -3.01),
        (2 * ndtr(SCORES), 2 * norm.cdf(3.01), 3.01),
        (2 * ndtr(SCORES), 2 * norm.cdf(-7.3), -7.3),
    ],
)
def test_the_probability_of_an_extreme_part(at, deviation, score):
    assert normal_score(deviation, at) == pytest.approx(score, abs=1e-9)


def test_workers_and_blocks_do_not_change_the_result(study, whole):
    with Workers(2, block=37) as crew:
        assert like(execute(load(study), study.with_suffix(".h5"), crew), whole)


def test_a_resumed_run_equals_an_uninterrupted_run(study, whole, tmp_path):
    path = tmp_path / "part.h5"
    for trials in (0, 640, 4000):  # before all, in a stage of the search, in the last
        path.unlink(missing_ok=True)
        part = stopped(study, path, trials)
        assert not part.complete and trials <= part.ended < 5000
        notes = said_of(part)
        missing = f"{5000 - part.ended} of 5000 trials have not run"
        assert (missing if trials else "No trial has run") in notes
        if trials:
            share = rare_summary(part).fraction_out_of_limit
            assert share.sure == (trials == 4000)
        assert tolstat.verify(path).whole
        assert like(tolstat.resume(path), whole)
    assert tolstat.verify(path, every=True).whole


def test_changed_samples_are_detected(run):
    with resealed(run.path) as file:
        file["A"][4000] *= 1.5
        file["rare-weight"][4500] *= 2
    found = tolstat.verify(run.path)
    assert found.drawn_otherwise.tolist() == [4000, 4500]


def sought_otherwise(path, **facts):
    """Let a run be as one of a tolstat that sought otherwise."""
    with resealed(path) as file:
        file["A"][600:] *= 1.5
        file["provenance"].attrs.update(facts)


def test_a_different_version_with_other_samples_is_named(run, study, whole, tmp_path):
    sought_otherwise(run.path, version_tolstat="0.0.9", processor="abacus")
    said = command("verify", run.path)
    assert said.exit_code == 1
    words = " ".join(said.output.split())
    assert "made with processor abacus" in words  # fits hang on it
    assert "its study has other results here: its data or number of" in words
    assert "by a tolstat 0.0.9 that searched for rare trials" in words
    assert f"differently (here: {version('tolstat')})" in words
    assert f"Run its study again: tolstat run {study} --force" in words
    part = stopped(study, tmp_path / "part.h5", 4000).path
    sought_otherwise(part, version_tolstat="0.0.9")
    said = command("resume", part)
    anew = ["run", str(study), "-o", str(part), "--force"]
    assert said.exit_code == 2 and f"`tolstat {' '.join(anew)}`" in said.output
    assert (
        "trials 600-" in said.output and "made by a tolstat 0.0.9 that" in said.output
    )
    again = command(*anew)
    assert again.exit_code == 0 and like(tolstat.open(part), whole)


def test_the_same_version_may_have_other_samples(run):
    sought_otherwise(run.path)
    words = " ".join(command("verify", run.path).output.split())
    assert f"by a tolstat {version('tolstat')} that searched for rare trials" in words
    with pytest.raises(RunFileError, match="searched for rare trials differently"):
        tolstat.resume(run.path)


def test_damage_is_found_and_sampled_again(run, whole):
    with h5py.File(run.path, "r+") as file:
        file["gap"][17] *= -1
    found = tolstat.verify(run.path)
    # what hangs on trial 17 cannot be drawn again, and is not said to be wrong
    assert found.trials.tolist() == [17] and not len(found.drawn_otherwise)
    assert like(tolstat.resume(run.path), whole)
    assert tolstat.verify(run.path).whole


def test_a_forged_response_changes_later_samples(run):
    row = int(np.flatnonzero(run.column("gap")[:500] > 0.3e-3)[0])
    with resealed(run.path) as file:
        file["gap"][row] = -1e-3
    found = tolstat.verify(run.path)
    # steps to the limit begin with trials of the study; then trials are led from here
    _, sizes = np.unique(run.column("rare-stage"), return_counts=True)
    led = 500 + sizes[1:][: np.flatnonzero(sizes[1:] != sizes[1])[0]].sum()
    otherwise = found.drawn_otherwise
    assert otherwise[0] == led and len(otherwise) > 0.98 * (5000 - led)


def test_a_rare_run_cannot_be_extended(run):
    with pytest.raises(StudyError, match="depends on the number of trials"):
        tolstat.extend(run.path, 8000)
    with pytest.raises(QuestionError, match="cannot answer for another end"):
        tolstat.limited(run, {"gap": "<= 2 mm"})
    with pytest.raises(StudyError, match="did you mean 'gap'"):
        tolstat.limited(run, {"gab": ">= 0.1 mm"})
    assert run.diagnostics.halved == {}
    frame = run.frame()
    assert list(frame.columns)[-5:-1] == list(DRAWN)
    last = frame[~frame["rare-weight"].isna()]
    beyond = last.loc[last["gap"] < 0.2e-3, "rare-weight"].sum() / len(last)
    assert beyond == pytest.approx(
        rare_summary(run).fraction_out_of_limit.value, rel=1e-12
    )


def holds(estimate, truth, widest):
    """Whether an interval holds the truth, and its ends are near each other."""
    assert estimate.lower < truth < estimate.upper < widest * estimate.lower
    return True


@pytest.mark.parametrize(("limit", "widest"), [(0.1, 3), (0.3, 1.6), (0.5, 4)])
def test_a_rare_run_answers_for_limits_beside_its_own(run, limit, widest):
    summary = tolstat.summary(tolstat.limited(run, {"gap": f">= {limit} mm"}))
    truth = norm.sf((1 - limit) / SIGMA)
    assert holds(summary.fraction_out_of_limit, truth, widest)


@pytest.mark.parametrize(
    ("entries", "times"),
    [
        ({"A": "+-0.15 mm"}, (0.5, 1)),
        ({"B": "+-0.3 mm"}, (1, 0.75)),
        ({"A": "+-0.33 mm", "B": "+-0.44 mm"}, (1.1, 1.1)),
    ],
)
def test_what_if_of_a_rare_run_multiplies_both_ratios(run, entries, times):
    sigma = np.hypot(0.1 * times[0], 0.4 / 3 * times[1])
    found = tolstat.what_if(run, entries)
    response = found.responses["gap"]
    scenario = response.scenario.limited.yields.fraction_out_of_limit
    assert holds(scenario, norm.sf(0.8 / sigma), 25)
    before = response.baseline.limited.yields
    assert before.fraction_out_of_limit == rare_summary(run).fraction_out_of_limit
    assert before.verdict == "met"
    words = words_in(*found.document().blocks)
    assert "that the last stage met" in words and "anytime-valid" not in words


def test_a_rare_run_is_compared_by_its_fractions(run, tmp_path):
    table = tomllib.loads(CHAIN) | {"seed": 4}
    table["links"]["B"]["tolerance"] = "+-0.44 mm"
    other = tolstat.run(table, output=tmp_path / "other.h5")
    found = tolstat.compare(run, other)
    (difference,) = found.differences
    assert difference.pairing.kind == "unpaired"
    less = difference.limits["gap"].fraction_out_of_limit_difference
    truth = norm.sf(0.8 / np.hypot(0.1, 0.44 / 3)) - norm.sf(DISTANCE)
    assert less.lower < truth < less.upper and less.lower > 0
    assert difference.limits["gap"].moments_ppk_difference.reason
    words = words_in(*found.document().blocks)
    assert "more trials out of the limit of gap" in words
    assert "trials may decide" not in words
    (same,) = tolstat.compare(run, run).differences
    assert same.findings.neither == ("gap",)


def test_the_report_of_a_rare_run_has_all_responses(run):
    gap = rare_summary(run).responses["gap"]
    few = gap.quantiles[0.5].reason  # of the last stage of 5000 trials
    assert few or gap.quantiles[0.5].lower < 1e-3 < gap.quantiles[0.5].upper
    assert gap.mean.value == pytest.approx(1e-3, rel=0.05)
    assert gap.sigma.value == pytest.approx(SIGMA * 1e-3, rel=0.2)
    assert math.isnan(gap.least) and gap.weighted


@pytest.mark.parametrize(
    ("asked", "limits"),
    [
        (("report", "--limit", "gap <= 2 mm"), {"gap": "<= 2 mm"}),
        (("what-if", "A=+-2 mm"), {"gap": ">= 0.2 mm"}),
    ],
)
def test_the_study_written_by_a_refusal_runs(run, asked, limits):
    """As the refusal says, word for word."""
    name, *options = asked
    refused = command(name, run.path, *options)
    assert refused.exit_code == 2
    (typed,) = re.findall("`tolstat (.*)` writes the study", refused.output)
    written = command(*shlex.split(typed))
    assert written.exit_code == 0, written.output
    path = Path(shlex.split(typed)[-1])
    table = tomllib.loads(path.read_text())
    assert table["limits"] == limits
    assert table["sampling"] in ("rare", {"rare": "gap"})
    assert command("run", path, "--trials", "5000").exit_code == 0


def test_another_response_needs_a_separate_run(toy, tmp_path):
    study = {
        "model": "toy", "trials": 5000, "seed": 1, "sampling": {"rare": "gap"},
        "deviations": {"part": "+-0.6 mm"},
        "limits": {"gap": "<= 4 mm", "ratio": "<= 0.85"},
    }  # fmt: skip
    run = tolstat.run(study, model=toy, output=tmp_path / "run.h5")
    summary = rare_summary(run, ["ratio"])
    ratio = summary.responses["ratio"].limited.yields
    assert ratio.verdict == "undecided" and not ratio.needed
    assert ratio.fraction_out_of_limit.upper > 1e-3  # its trials were not searched
    words = words_in(*summary.document().blocks)
    assert "Only the limit of gap was searched. Few trials tell of ratio" in words
    other = tolstat.limited(run, {"ratio": "<= 0.8"})
    assert rare_summary(other).limits["ratio"].limit.upper == 0.8
    text = tolstat.fresh_study(run, {}, limits={"ratio": "<= 0.8"}, model=toy)
    fresh = tomllib.loads(text)
    assert fresh["limits"] == {"gap": "<= 4 mm", "ratio": "<= 0.8"}
    assert fresh["sampling"] == {"rare": "ratio"}
    with pytest.raises(QuestionError, match="response rato: unknown; did you mean"):
        rare_summary(run, ["rato"])


def test_an_unfinished_search_is_reported_with_its_interval(tmp_path):
    """Twelve parts that must be far out at once: few points carry the share."""
    links = [f"L{i}" for i in range(12)]
    study = {
        "model": "dimension_chain", "trials": 5000, "seed": 1, "sampling": "rare",
        "settings": {
            "gap": f"min(min({', '.join(links[:6])}), min({', '.join(links[6:])}))"
        },
        "links": {n: {"nominal": "1 mm", "tolerance": "+-0.3 mm"} for n in links},
        "limits": {"gap": "<= 1.05 mm"},
    }  # fmt: skip
    found = rare_summary(tolstat.run(study, output=tmp_path / "run.h5"))
    out = found.fraction_out_of_limit
    note = found.trials.notes[0]
    assert "have an effective sample size of" in note
    assert "more trials, or another seed" in note
    share = norm.sf(0.5) ** 12
    assert out.lower < share < out.upper
    assert out.upper > 10 * share


def test_failures_do_not_exceed_trials_out_of_limit(tmp_path):
    """One of 300 of those beyond fails: few are met, and their own interval is wide."""
    study = {
        "model": "dimension_chain", "trials": 6000, "seed": 1, "sampling": "rare",
        "settings": {"gap": "A + 0 * sqrt((abs(B - E) - F + L - A + abs(L - A)) * A)"},
        "links": {n: {"nominal": "1 mm", "tolerance": "+-0.3 mm"} for n in "AB"}
        | {"E": {"nominal": "1 mm"}, "F": {"nominal": "0.0004 mm"}}
        | {"L": {"nominal": "1.372 mm"}},
        "limits": {"gap": "<= 1.372 mm"},
    }  # fmt: skip
    run = tolstat.run(study, output=tmp_path / "run.h5")
    found = rare_summary(run)
    out = found.fraction_out_of_limit
    failures = found.trials.failures
    assert out.lower < norm.sf(3.72) < out.upper
    share = norm.sf(3.72) * 2 * 0.004 * norm.pdf(0)
    assert failures.lower < share < failures.upper
    assert failures.value < 0.1 * failures.upper and failures.sure
    assert failures.upper == out.upper
    first, said = found.failure_points[0], said_of(run)
    few = ", others less than half as far out: trial"
    assert (few in said) == (len(first.leading) == 1)
    page = " ".join(Page(tolstat.report(run).html()).text.split())
    assert (few in page) == (few in said)


def test_failed_trials_are_out_of_limit(toy, tmp_path):
    """A part longer than 0.9 mm cannot be mounted; no other is near the limit."""
    study = {
        "model": "toy", "trials": 5000, "seed": 1, "sampling": "rare",
        "deviations": {"part": {"tolerance": "+-0.6 mm", "shift": "0.06 mm"}},
        "limits": {"gap": "<= 90 mm"},
    }  # fmt: skip
    run = tolstat.run(study, model=toy, output=tmp_path / "run.h5")
    found = rare_summary(run)
    out = found.fraction_out_of_limit
    assert out.lower < norm.sf(4.2) < out.upper
    assert max(found.failure_points[0].off.values()) == pytest.approx(4.2, rel=0.01)
    assert found.trials.failed == sum(
        stage.trials_out_of_limit for stage in found.stages
    )
    # as many as are beyond; of the trials most, which is nobody's share
    failed, share = found.trials.failed, found.trials.failures
    assert share == out and failed > 1000
    value, lower, upper = PPM.interval(*share[:3])
    (said,) = [n for n in found.trials.notes if "fail" in n]
    assert said == (
        f"{value} ppm ({lower} to {upper}) fail, and count as out of limit; "
        f"of the trials sampled near the limit: {failed} not finite"
    )
    text = Page(tolstat.report(run).html()).text
    shown = command("show", run.path).output + repr(run)
    followed = command("show", run.path, "--follow")
    found_index = RunIndex("", tmp_path, (entry_of(run),))
    index = found_index.html() + found_index.csv()
    (row,) = rows_of(progress_table(found_index))
    assert said in " ".join(text.split()) and "5000 of 5000 trials have run" in text
    assert as_text(row["trials"].main) == "5000" and "failed" not in row
    assert entry_of(run).failed is None
    for printed in (text, shown, followed.output, followed.stderr, index, found.csv()):
        assert not re.search(rf"trials[^.:]*\b{failed} (?!not finite)", printed), (
            printed
        )
        assert "None" not in printed
    (csv_row,) = csv.DictReader(io.StringIO(found.csv()))
    assert float(csv_row["failed [ppm]"]) == pytest.approx(1e6 * share.value)
    assert "trials failed" not in csv_row and csv_row["trials run"] == "5000"


def test_no_failure_rate_before_the_last_stage(toy, tmp_path):
    study = {
        "model": "toy", "trials": 5000, "seed": 1, "sampling": "rare",
        "deviations": {"part": {"tolerance": "+-0.6 mm", "shift": "0.06 mm"}},
        "limits": {"gap": "<= 90 mm"},
    }  # fmt: skip
    enough = Enough(700)
    with Workers(2, enough, block=40) as crew:
        run = execute(
            load(study, model=toy), tmp_path / "run.h5", crew, progress=enough.tell
        )
    (said,) = [n for n in rare_summary(run).trials.notes if "fail" in n]
    assert said.startswith("the fraction that fails is not known: the last")
    assert said.endswith(f"near the limit: {run.failed} not finite")


def test_without_trials_out_of_limit_plain_trials_bound_the_share(toy, tmp_path):
    study = {
        "model": "toy", "trials": 5000, "seed": 1, "sampling": "rare",
        "deviations": {"angle": "+-1 deg"}, "limits": {"gap": "<= 90 mm"},
    }  # fmt: skip
    found = rare_summary(tolstat.run(study, model=toy, output=tmp_path / "run.h5"))
    out = found.fraction_out_of_limit
    n = found.trials.counted
    assert out[:2] == (0, 0) and not found.failure_points
    # one in twenty is drawn with twice the spread
    assert (
        out.upper == found.trials.unseen == pytest.approx(3.689 / 0.955 / n, rel=3e-2)
    )


def test_trials_that_change_sides_are_counted(tmp_path):
    """Force errs by 1 N: whoever is beyond by less is within in truth."""
    study = {
        "model": "cliff", "trials": 5000, "seed": 1, "sampling": "rare",
        "deviations": {"part": "+-3 mm"}, "limits": {"force": "<= 14.5 N"},
    }  # fmt: skip
    run = tolstat.run(study, model=Cliff(), output=tmp_path / "run.h5")
    found, again = rare_summary(run), run.audited.trials
    force = 10 + 1e3 * run.column("part_1")[again]
    done = run.column("part_2")[again] <= 2.9e-3
    changed = np.count_nonzero((force > 13.5) & (force <= 14.5) & done)
    assert found.precise == len(again) and found.changed == changed
    assert 0 < changed < len(again) / 2


def command(*words):
    return CliRunner().invoke(main, [str(word) for word in words])


def test_at_the_command_line(study, monkeypatch):
    study.write_text(
        CHAIN.replace('">= 0.2 mm"', '{ limit = ">= 0.2 mm", ppm = 1e-4 }')
    )
    run = study.with_suffix(".h5")
    done = command("run", study)
    assert done.exit_code == 0 and "not met" in done.output, done.output
    shown = command("show", run).output
    for words in ("failure point that was met", "A plain run would need", "not met"):
        assert words in shown
    assert "no trial failed in any stage" in shown
    assert STAGES in " ".join(shown.split())
    found = json.loads(command("report", run, "--json").output)
    out = found["fraction_out_of_limit"]
    assert out["lower"] < norm.sf(DISTANCE) < out["upper"]
    table = command("report", run, "--csv").output
    (row,) = csv.DictReader(io.StringIO(table))
    known = pytest.approx(1e6 * out["upper"])
    assert float(row["fraction out of limit upper [ppm]"]) == known
    assert row["verdict"] == found["verdict"] and row["response"] == found["response"]
    assert command("report", run).exit_code == 0
    page = run.with_suffix(".html").read_text()
    assert ">Most probable failure points</h2>" in page and "verdict not-met" in page
    text = " ".join(Page(page).text.split())
    assert STAGES in text
    assert re.search(r"point that was met: B \S+ mm \(\+\S+ sigmas\)", text)
    refused = command("report", run, "--response", "worst")
    assert refused.exit_code == 2 and "worst: unknown; allowed: gap" in refused.output
    monkeypatch.chdir(study.parent)
    assert "not met" in command("runs", ".").output
