"""A run that names the pair behind its out-of-limit trials: screen, JSON, page."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import tolstat
from tests.answers.browser import Page
from tests.answers.page_checks import steps_of, words_in
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.answers.next_steps import StepKind
from tolstat.answers.report.chosen_steps import findings_of
from tolstat.answers.report.finding_words import next_steps
from tolstat.answers.report.first_page import limits_table
from tolstat.answers.report.full_report import report_of
from tolstat.answers.report.report_answer import NoCause
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.document.inline import Typed
from tolstat.render.screen import as_text, show
from tolstat.statistics.limits.yields import MET
from tolstat.statistics.sample_size import MOST_ROWS, fewest_trials

DEGREE = np.pi / 180
STUDY = {
    "model": "toy", "trials": 3000, "seed": 3,
    "deviations": {"part": "+-1 mm", "angle": "+-1 deg"},
    "limits": {"gap": "-1.2..1.2 mm"},
}  # fmt: skip


@pytest.fixture
def run(toy, tmp_path):
    class Apart(type(toy)):
        """What matters is a part and an angle, which are of no kind."""

        def evaluate(self, deviations, settings):
            gap = deviations[:, 0] - deviations[:, 2] * 1e-3 / DEGREE
            return (
                super()
                .evaluate(deviations, settings)
                ._replace(responses=np.stack([gap, gap], axis=1), status=None)
            )

    return tolstat.run(STUDY, model=Apart(), output=tmp_path / "apart.h5")


def with_causes(found, causes, **limited):
    """The report with other causes of the gap, or other numbers of its limit."""
    gap = found.responses["gap"]
    gap = replace(gap, causes=causes, limited=gap.limited._replace(**limited))
    responses = {**found.responses, "gap": gap}
    findings = findings_of(drawn_trials(found.stored_run), responses, found.warnings)
    return replace(found, responses=responses, findings=findings)


def row_of(found):
    """Main cause, what it explains, and what would help, as the page has them."""
    table = limits_table(found)
    heads = [each.head for each in table.columns]
    row = dict(zip(heads, table.rows[0], strict=True))
    return row["main cause"], row.get("what would help")


def pairs_of(causes):
    """Causes that several explain only together."""
    return tuple(each for each in causes.named if each.together)


def test_the_pair_is_named_with_its_explained_share(run, capsys):
    found = report_of(run)
    causes = found.responses["gap"].causes
    (pair,), out = pairs_of(causes), int(run.beyond("gap").sum())
    apart = "part_1 and angle differ: one high, one low"
    assert pair.words == apart
    assert pair.together.far.value == 1.0 > pair.together.alone
    assert pair.halved == run.diagnostics.halved["gap"][("part_1", "angle")].beyond
    known = 2 * norm.sf(1.2 * 6 / np.sqrt(2))  # a sixth of a millimetre each
    assert pair.halved.lower <= known <= pair.halved.upper < 0.006
    cause, effect = row_of(found)
    assert as_text(cause.main) == apart
    explained = f"{out} of {out} out-of-limit trials in its outer 5 %"
    assert as_text(cause.below) == explained
    (step, *_), remedy = found.findings.steps, found.findings.remedy
    assert step.kind is StepKind.REMEDY and "tighten" in as_text(effect.main)
    assert effect.below[0].value == remedy.limits["gap"][1]
    said = json.loads(found.json())["responses"]["gap"]["causes"]["named"][0]
    assert said["together"]["members"] == ["part_1", "angle"]
    text = " ".join(Page(found.html()).text.split())
    assert f"{explained}; any of them alone in" in text and apart in text
    document = tolstat.summary(run).document()
    assert apart in words_in(*document.blocks)
    show(document)
    shown = capsys.readouterr().out  # in lines of its column
    assert "part_1 and angle" in shown and set(apart.split()) <= set(shown.split())


def chain(tmp_path, gap, links, limit, trials=20_000, **given):
    """Report of a dimension chain, causes of its only limit, and the cell of these."""
    zones = {
        name: {"nominal": "10 mm", "tolerance": f"+-{zone} mm"}
        for name, zone in links.items()
    }
    study = {
        "model": "dimension_chain", "trials": trials, "seed": 7,
        "settings": {"gap": gap}, "links": zones, "limits": {"gap": limit}, **given,
    }  # fmt: skip
    found = report_of(tolstat.run(study, output=tmp_path / "chain.h5"))
    return found, found.responses["gap"].causes, row_of(found)[0]


def test_equivalent_parts_are_named_together(tmp_path):
    """Seven trials were six pairs in six studies; the twin was never named."""
    links = {"bearing_1": 0.1, "bearing_2": 0.1, "housing": 0.15}
    ends = 30 + 2.4 / 3 * np.sqrt(0.1**2 + 0.1**2 + 0.15**2)
    _, causes, cause = chain(
        tmp_path, "bearing_1 + bearing_2 + housing", links, f"<= {ends} mm", 4096
    )
    words = {each.words: each for each in causes.named}
    assert words.keys() == {"bearing (2 parts, equivalent)", "housing"}
    twins = words["bearing (2 parts, equivalent)"]
    assert twins.members == ("bearing_1", "bearing_2") and twins.together is None
    assert causes.kinds["bearing"].halved == twins.halved and twins.halved.sure
    assert as_text(cause.main) in words
    (other,) = words.keys() - {as_text(cause.main)}
    assert f"; also {other}" in as_text(cause.below)


def test_the_least_change_that_meets_the_limit_comes_first(tmp_path):
    """Half of one tolerance suffices; half of both would cost more."""
    links = {"a": 0.1, "b": 0.04}
    _, causes, cause = chain(tmp_path, "a - b", links, "-0.09..0.09 mm")
    first, *others = causes.named
    assert first.members == ("a",) and as_text(cause.main) == "a"
    assert first.halved.upper < 0.0027
    (pair,) = pairs_of(causes)
    assert pair in others and pair.members == ("a", "b")
    assert pair.together.far.value > pair.together.single  # it explains more


def test_two_fighting_parts_are_a_pair(tmp_path):
    _, causes, _ = chain(tmp_path, "a - b", {"a": 0.1, "b": 0.11}, "-0.09..0.09 mm")
    assert causes.main.words == "a and b differ: one high, one low"
    one = next(each for each in causes.named if each.members == ("a",))
    assert one.halved.lower > 0.0027  # half of one does not suffice


def gap_share(found):
    return found.limits["gap"].yields.fraction_out_of_limit.value


def test_json_has_the_steps_that_the_page_says(run):
    found = report_of(run)
    findings = json.loads(found.json())["findings"]
    typed = [command for step in findings["steps"] for command in step["commands"]]
    sentences = next_steps(found)
    assert typed
    if proving := findings["remedy"]["proving"]:  # where that is quick
        typed.insert(0, proving)
    assert typed == [p.text for parts in sentences for p in parts if type(p) is Typed]
    first, gap = findings["steps"][0], findings["limits"]["gap"]
    assert first["kind"] == "change nominal values and tolerances"
    remedy = findings["remedy"]
    assert remedy["evidence"] == "predicted"  # the model is the caller's
    assert first["commands"] == remedy["commands"]
    assert first["entries"] == remedy["entries"] and first["entries"]
    known = pytest.approx(1 - gap_share(found))
    assert remedy["steps"][0]["before"]["value"] == known
    assert gap["verdict"] == found.verdicts["gap"]


def test_few_trials_state_how_many_would_tell(tmp_path):
    links = {"a": 0.1, "b": 0.1, "c": 0.15}
    end = 30 + 3 / 3 * np.sqrt(0.1**2 + 0.1**2 + 0.15**2)
    found, causes, cause = chain(tmp_path, "a + b + c", links, f"<= {end} mm", 4096)
    n = causes.trials_out_of_limit
    assert 0 < n < 10 and causes.named == () and causes.main is None
    assert 40 / n * 4096 <= causes.needed < 44.1 / n * 4096
    assert (
        as_text(cause.main) == f"too few ({n}); about {causes.needed} trials would tell"
    )
    # the step that decides adds as many trials: one command for both
    (step,) = found.findings.steps
    assert (step.kind, step.responses) == (StepKind.DECIDE, ("gap",))
    assert step.trials >= causes.needed
    assert [x.words for x in step.commands] == [("decide", found.stored_run.path)]
    assert steps_of(found)[0].startswith("Add trials to decide gap")


def test_a_met_limit_asks_for_no_trials_that_tell_causes(tmp_path):
    links = {"a": 0.1, "b": 0.1}
    found, causes, cause = chain(tmp_path, "a + b", links, "<= 20.155 mm", 4096)
    assert found.limits["gap"].yields.verdict == MET and causes.needed
    assert as_text(cause.main) == f"too few ({causes.trials_out_of_limit})"


def test_causes_of_most_trials_are_not_named(tmp_path):
    links = {"a": 0.1, "b": 0.1}
    _, causes, cause = chain(tmp_path, "a + b", links, "19.99..20.01 mm", 2000)
    assert causes.named == () and causes.needed == 0
    assert causes.reason is NoCause.MOST_OUT
    assert as_text(cause.main) == "not named: most trials are out of limit"


def test_a_fixed_cause_is_named_as_clear_as_it_is(tmp_path):
    """The phase of a run-out is the clearest; only its amplitude can be changed."""

    class RunOut(Model):
        name = "run_out"

        def describe(self, settings):
            parts = Contributor("phase", "rad"), Contributor("amplitude", "m")
            return Description(parts, (Response("gap", "m"),))

        def evaluate(self, deviations, settings):
            phase, amplitude = deviations.T
            return Outcome((amplitude * np.cos(phase))[:, None])

    study = {
        "model": "run_out", "trials": 3000, "seed": 1, "limits": {"gap": "<= 0.8 mm"},
        "deviations": {
            "phase": {"tolerance": "0..360 deg", "distribution": "uniform"},
            "amplitude": {"tolerance": "0.6..1 mm", "distribution": "uniform"},
        },
    }  # fmt: skip
    run = tolstat.run(study, model=RunOut(), output=tmp_path / "run_out.h5")
    found = report_of(run)
    first, *others = found.responses["gap"].causes.named
    assert first.words == "phase (fixed)" and others[0].members == ("amplitude",)
    # a quadratic surface sees no effect of the amplitude: it cannot say "none helps"
    assert found.findings.remedy.unavoidable is None


def test_the_main_contribution_names_all_equal_parts(tmp_path):
    """Of 0.02 + 0.02 + 0.01 mm^2 of variance, times 9, the twins make four fifths."""
    twin, other = "+-0.1414213562373095 mm", "+-0.1 mm"
    links = {"left": ("1 mm", twin), "right": ("1 mm", twin), "spacer": ("1 mm", other)}
    study = {
        "model": "dimension_chain", "trials": 4000, "seed": 1,
        "settings": {"gap": "left - right + spacer"}, "limits": {"gap": "0.9..1.1 mm"},
        "links": {n: {"nominal": a, "tolerance": b} for n, (a, b) in links.items()},
    }  # fmt: skip
    run = tolstat.run(study, output=tmp_path / "twins.h5")
    name, share = tolstat.summary(run).responses["gap"].largest_share
    assert name == "left, right" and share.value == pytest.approx(0.8, abs=0.02)
    study["links"]["right"]["tolerance"] = "+-0.14 mm"  # 1 % less
    run = tolstat.run(study, output=tmp_path / "others.h5")
    assert tolstat.summary(run).responses["gap"].largest_share[0] == "left"


def test_the_main_contribution_names_no_part_of_another_gap(tmp_path):
    """Equal parts of one gap: only one of them is in the other."""
    links = {"S": ("50.05 mm", "+-0.1 mm"), "A": ("49.8 mm", "+-0.08 mm"),
             "H": ("100 mm", "+-0.1 mm"), "B": ("49.7 mm", "+-0.09 mm")}  # fmt: skip
    study = {
        "model": "dimension_chain", "trials": 3000, "seed": 13,
        "gaps": {"left": "S - A", "right": "H - S - B"},
        "links": {n: {"nominal": a, "tolerance": b} for n, (a, b) in links.items()},
        "limits": {"left": "0.05..0.35 mm", "right": "0.15..0.4 mm"},
    }  # fmt: skip
    run = tolstat.run(study, output=tmp_path / "gaps.h5")
    responses = tolstat.summary(run).responses
    assert responses["right"].largest_share[0] == "S, H"
    assert responses["left"].largest_share[0] == "S"
    assert "S, H" not in responses["left"].contributions.groups


def test_a_missed_limit_without_a_named_cause_has_a_step(tmp_path):
    """Not most trials are out of limit, but no cause of them is named."""
    links, of = {"a": 0.1, "b": 0.1}, {"sampling": "sobol"}
    found, causes, _ = chain(tmp_path, "a + b", links, "19.93..20.07 mm", 2048, **of)
    assert causes.named == () and 0 < causes.trials_out_of_limit < 1024
    (step,) = (s for s in found.findings.steps if s.kind is StepKind.REMEDY)
    assert {*step.parts} <= {"a", "b"} and len(step.commands) == 2


def test_causes_are_not_asked_for_where_the_limit_seems_met(tmp_path):
    """Few trials are out, fewer than permitted: only the verdict needs more."""
    links = {"a": 0.1, "b": 0.1}
    end = 20 + 3.05 / 3 * np.sqrt(0.1**2 + 0.1**2)
    found, causes, _ = chain(tmp_path, "a + b", links, f"<= {end} mm", 2000)
    assert causes.needed > found.limits["gap"].yields.needed > 0
    (step,) = found.findings.steps
    assert step.kind is StepKind.DECIDE
    assert (step.responses, step.causes_of) == (("gap",), ())


@pytest.mark.parametrize(("ppk", "kinds"), [(1.67, 2), (2.2, 1)])
def test_a_demand_beyond_the_trials_of_a_run_is_told_so(tmp_path, ppk, kinds):
    """Of 1e9 trials none is advised; of fewer all are."""
    limit = {"limit": "<= 20.4 mm", "ppk": ppk}
    found, _, _ = chain(tmp_path, "a + b", {"a": 0.1, "b": 0.1}, limit, 1000)
    *adding, search = found.findings.steps
    assert len(adding) + 1 == kinds and search.kind is StepKind.SEARCH_RARE
    for step in adding:
        needed = fewest_trials(float(norm.sf(3 * ppk)))
        assert step.trials >= needed > MOST_ROWS
        assert step.commands[0].words[-2:] == ("--at-most", str(step.trials))
    words = steps_of(found)[-1]
    assert "takes more than 4000000 trials" in words
    assert 'sampling = { rare = "gap" }' in words


@pytest.mark.parametrize("tolerance", ["+-0.1 mm", "+-0.10 mm", "+-100 um"])
def test_links_are_equivalent_however_their_tolerances_are_typed(tolerance):
    links = {"A": "+-0.1 mm", "B": tolerance, "C": "+-0.01 mm"}
    study = {
        "model": "dimension_chain", "trials": 1000, "seed": 1,
        "settings": {"gap": "A - B - C"}, "limits": {"gap": "-0.1..0.1 mm"},
        "links": {n: {"nominal": "9 mm", "tolerance": t} for n, t in links.items()},
    }  # fmt: skip
    gap = tolstat.report(tolstat.run(study)).responses["gap"]
    assert [*gap.contributions.groups] == ["A, B"]
