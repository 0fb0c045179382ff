"""The remedy of a run: what is said, whether it helps, and its commands as typed."""

from __future__ import annotations

import json
import math
import tomllib
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import tolstat
from tests.answers.page_checks import steps_of
from tests.answers.remedy.following import follow, remedy_of, typed
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.answers.next_steps import Step, StepKind
from tolstat.answers.remedy import find_remedy
from tolstat.answers.remedy.changed_entries import changeable_entries
from tolstat.answers.remedy.remedy_finding import Evidence
from tolstat.answers.remedy.remedy_words import remedy_cell, remedy_words
from tolstat.errors import StudyError
from tolstat.execution.stages import SampledStages
from tolstat.render.screen import as_text
from tolstat.status import Status

BEARING = {"nominal": "20 mm", "tolerance": "-0.12..0 mm", "distribution": "uniform"}
STACK = {
    "model": "dimension_chain", "trials": 4000, "seed": 1,
    "settings": {"gap": "housing - shaft - bearing_1 - bearing_2"},
    "links": {
        "housing": {"nominal": "120.6 mm", "tolerance": "+-0.12 mm"},
        "shaft": {"nominal": "80 mm", "tolerance": "h8"},
        "bearing_1": BEARING, "bearing_2": BEARING,
    },
    "limits": {"gap": "0.15..0.6 mm"},
}  # fmt: skip


def stack(limit="0.15..0.6 mm", **links):
    """The stack-up with other keys of some links."""
    study = deepcopy(STACK)
    study["limits"]["gap"] = limit
    for name, keys in links.items():
        study["links"][name] |= keys
    return study


def bought(**links):
    """The stack-up with bearings that are bought."""
    fixed = {"fixed": True}
    return stack(**({"bearing_1": fixed, "bearing_2": fixed} | links))


def ran(study, folder):
    """Write a study, and run it."""
    path = folder / "gap.toml"
    path.write_text(tomli_w.dumps(study))
    return tolstat.run(path)


def on_a_busy_machine(run):
    """The same run, which took long because of other work: remedies are proved."""
    return replace(run, times={**run.times, "seconds": 0.2 * run.trials})


def test_the_numbers_are_those_of_the_closed_form(tmp_path):
    run = ran(bought(), tmp_path)
    remedy = remedy_of(run)
    assert remedy.evidence is Evidence.PROVED and remedy.met
    (step,) = remedy.steps
    ((entry, members, shift, tolerance),) = step.changes
    assert (entry, members, tolerance) == ("housing", ("housing",), "")
    mean = 0.6e-3 + (0.046e-3 + 0.12e-3 + 0.12e-3) / 2  # h8 of 80 mm
    assert mean + shift == pytest.approx(0.375e-3, abs=30e-6)
    sigma = math.sqrt(0.04**2 + (0.046 / 6) ** 2 + 2 * 0.12**2 / 12) * 1e-3
    margin = min(0.6e-3 - mean - shift, mean + shift - 0.15e-3) / sigma
    assert margin > 3 and step.after.lower > 0.9973
    assert step.before == run_share(run).complement
    assert shift * 1e6 == pytest.approx(round(shift * 1e6), abs=1e-6)  # of 0.12 mm
    again = remedy_of(tolstat.open(run.path))
    assert again == remedy  # to the last bit


def run_share(run):
    from tolstat.statistics.intervals.shares import proportion

    return proportion(int(run.beyond("gap").sum()), run.trials)


SHAPES = {
    "normal": bought(),
    "one end above": bought() | {"limits": {"gap": "<= 0.6 mm"}},
    "one end below": bought() | {"limits": {"gap": ">= 0.9 mm"}},
    "shift and cp": bought(housing={"tolerance": "+-0.2 mm", "shift": "0.05 mm",
                                    "cp": 2.0}),
    "another unit": bought(housing={"nominal": "12.06 cm",
                                    "distribution": "triangular"}),
    "drawing text": bought(housing={"nominal_shift": "0.01 mm"}),
    "Ppk": bought() | {"limits": {"gap": {"limit": "0.15..0.6 mm", "ppk": 1.0}}},
    "grades": stack("0.62..0.83 mm", housing={"tolerance": "js9"}),
    "spread": bought(housing={"nominal": "120.2 mm"})
    | {"limits": {"gap": "0.2..0.49 mm"}},
}  # fmt: skip


@pytest.mark.parametrize("kind", SHAPES)
def test_the_commands_lead_to_limits_that_are_met(tmp_path, kind):
    run = ran(SHAPES[kind], tmp_path)
    remedy = remedy_of(run)
    assert remedy.steps and remedy.met, remedy
    fresh = follow(remedy.commands)
    for name, limited in tolstat.summary(fresh).limits.items():
        share, (_, promised) = limited.yields.fraction_out_of_limit, remedy.limits[name]
        assert limited.yields.verdict in ("met", "undecided")
        assert share.lower <= promised.upper
    before, after = run.study.table["links"], fresh.study.table["links"]
    kept = {n for n, keys in before.items() if keys.get("fixed")}
    assert {n: after[n] for n in kept} == {n: before[n] for n in kept}


def test_python_follows_the_steps_of_a_report_to_a_met_study():
    run = tolstat.run(bought())
    while steps := tolstat.report(run).findings.steps:
        match steps[0]:
            case Step(kind=StepKind.REMEDY, change=change, prediction=promised):
                assert change.deviations["housing"].keys() == {"nominal"}
                run = tolstat.run(tomllib.loads(tolstat.fresh_study(run, change)))
            case Step(kind=StepKind.DECIDE):
                run = tolstat.decide(run)
    summary = tolstat.summary(run)
    assert summary.verdicts == {"gap": "met"}
    within = summary.all_limits.within
    assert within.lower <= promised.after.upper and within.upper >= promised.after.lower
    assert promised.before.upper < 0.9973  # of 0.15..0.6 mm about a mean of 0.74 mm


PLANETARY = {
    "model": "planetary", "trials": 4000, "seed": 2,
    "settings": {"teeth": [24, 36, 21, 84], "module": "2.5 mm"},
    "deviations": {"tooth_thickness": "-50..-20 um", "centre_distance": "js7"},
    "limits": {"backlash": "0..16 arcmin"},
}  # fmt: skip


@pytest.mark.parametrize(
    "entry",
    [
        "-50..-20 um",
        {"tolerance": "-50..-20 um", "common": True, "cp": 1.33},
        {"tolerance": "+-15 um", "nominal_shift": "-35 um"},
    ],
)
def test_parts_of_an_entry_change_together(tmp_path, entry):
    study = PLANETARY | {
        "deviations": PLANETARY["deviations"] | {"tooth_thickness": entry}
    }
    run = ran(study, tmp_path)
    remedy = remedy_of(run)
    assert "tooth_thickness" in remedy.entries
    fresh = follow(remedy.commands)
    assert tolstat.summary(fresh).verdicts == {"backlash": "met"}
    if isinstance(entry, dict):
        new = fresh.study.table["deviations"]["tooth_thickness"]
        kept = {k: x for k, x in entry.items() if k in ("common", "cp")}
        assert kept.items() <= new.items()


def test_page_screen_json_and_csv_say_the_same(tmp_path):
    run = ran(bought(), tmp_path)
    report = tolstat.report(run)
    remedy = report.findings.remedy
    (sentence,) = [x for x in steps_of(report) if "housing" in x]
    for words in ("Move housing by -0.3", "all limits met", "proved by 20000 new"):
        assert words in sentence
    for name in (*map(str, remedy.commands), "proved by 20000 new trials"):
        assert name.split(" --write")[0] in as_plain(report)
    found = json.loads(report.json())["findings"]
    assert found["remedy"]["entries"] == remedy.entries
    (step, *_) = found["steps"]
    assert step["kind"] == StepKind.REMEDY.value
    assert step["commands"] == [*map(str, remedy.commands)]
    assert step["change"]["deviations"].items() == remedy.change.deviations.items()
    row = report.frame().loc["gap"]
    assert row["remedy"] == f"housing={remedy.entries['housing']}"
    assert row["remedy_proved_by_trials"] == 20_000
    shown = typed(f"tolstat show {run.path}")
    assert "Move housing by" in shown and "what would help" in shown
    missed = remedy._replace(met=False, missed=("gap",))
    (sentence,) = map(as_text, remedy_words(run, missed))
    assert "No change is known" in sentence and "gap still not met" in sentence
    assert "proved" not in sentence
    cell = as_text(remedy_cell(run, missed, "gap").main)
    assert cell == "no change is known to meet all limits"


def as_plain(report):
    from tests.answers.browser import Page

    return " ".join(Page(report.html()).text.split())


def test_what_is_fixed_stays_and_is_said_to_be(tmp_path):
    parts = ("housing", "shaft", "bearing_1")
    study = bought(**{name: {"fixed": True} for name in parts})
    study["limits"]["gap"] = "0.65..0.83 mm"
    remedy = remedy_of(ran(study, tmp_path))
    assert remedy.reason == "all contributors are fixed" and not remedy.steps
    study["links"]["shaft"]["fixed"] = False
    run = tolstat.run(study, output=tmp_path / "shaft.h5")
    rest = remedy_of(run).unavoidable
    assert next(iter(rest.causes)) == "housing" and "shaft" not in rest.causes
    sigma = math.sqrt(0.04**2 + 2 * 0.12**2 / 12)
    share = 2 - 2 * normal(0.09 / sigma)  # centred, without the shaft
    assert rest.share.lower < share < rest.share.upper
    (said, *_) = steps_of(tolstat.summary(run))
    assert said.startswith("No change of the free dimensions meets all limits")
    assert "widen gap to" in said and "with all tolerances as they are" in said
    study["limits"]["gap"] = said.split("widen gap to ")[1].split(" with all")[0]
    study |= {"trials": 40_000, "seed": 5}
    wider = tolstat.run(study, output=tmp_path / "wider.h5")
    assert tolstat.summary(wider).limits["gap"].yields.verdict == "met"
    causes = tolstat.summary(run).responses["gap"].causes.named
    fixed = [cause.words for cause in causes if "housing" in cause.members]
    assert all("(fixed)" in words for words in fixed)


def test_a_fixed_entry_that_would_only_move_is_not_said_to_be_tightened(tmp_path):
    study = bought(housing={"fixed": True}, shaft={"fixed": True})
    study["links"]["spacer"] = {"nominal": "5 mm", "tolerance": "+-0.1 mm"}
    study["settings"] = {}
    study["gaps"] = {
        "gap": "housing - shaft - bearing_1 - bearing_2", "other": "spacer",
    }  # fmt: skip
    run = ran(study, tmp_path)
    freed = remedy_of(run).unavoidable.freed
    (housing,) = (change for change in freed if change.entry == "housing")
    assert housing.tolerance == "" and housing.shift < -0.3e-3
    (said, *_) = steps_of(tolstat.summary(run))
    assert "move housing by -0.3" in said and "tighten housing" not in said


def normal(x):
    return 0.5 * (1 + math.erf(x / math.sqrt(2)))


def test_shifts_are_rounded_to_the_step_of_an_entry(tmp_path):
    remedy = remedy_of(ran(bought(housing={"step": "0.05 mm"}), tmp_path))
    (change,) = remedy.changes
    assert change.shift / 0.05e-3 == pytest.approx(round(change.shift / 0.05e-3))


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"fixed": "yes"}, "fixed: true or false"),
        ({"step": 0.1}, 'a text such as "0.01 mm"'),
        ({"step": "0 mm"}, "above 0"),
        ({"step": "1 s"}, "step"),
        ({"fixed": True, "cost": {"law": "reciprocal", "at": "+-0.1 mm", "price": 1}},
         "contradict"),
    ],
)  # fmt: skip
def test_keys_that_say_nothing_are_refused(keys, words):
    with pytest.raises(StudyError, match=words):
        tolstat.run(stack(housing=keys))


def test_conditions_and_measured_parts_are_fixed_by_default(tmp_path):
    from tolstat.answers.remedy.changed_entries import fixed_contributors

    class Heated(Model):
        name = "heated"

        def describe(self, settings):
            parts = (
                Contributor("length", "m"), Contributor("heat", "K"),
                Contributor("share", "1"), Contributor("turn", "rad"),
                Contributor("force", "N"),
            )  # fmt: skip
            return Description(parts, (Response("gap", "m"),))

        def evaluate(self, deviations, settings):
            return Outcome(deviations[:, :1] + 1e-6 * deviations[:, 1:2])

    entries = {
        "length": "+-1 mm", "heat": "+-20 K", "share": {"tolerance": "+-5 %",
        "fixed": False}, "force": {"tolerance": "+-1 N", "cost": {"+-1 N": 1}},
        "turn": {"tolerance": "0..360 deg", "distribution": "uniform"},
    }  # fmt: skip
    study = {"model": "heated", "trials": 500, "seed": 1, "deviations": entries,
             "limits": {"gap": "-0.5..0.5 mm"}}  # fmt: skip
    run = tolstat.run(study, model=Heated(), output=tmp_path / "heated.h5")
    run = replace(run, times={**run.times, "seconds": 0.01})  # on any machine
    assert fixed_contributors(run) == {"heat", "turn"}
    remedy = remedy_of(run)  # the model is the caller's: no fresh trials
    assert remedy.evidence is Evidence.PREDICTED and [*remedy.entries] == ["length"]
    assert str(remedy.proving).startswith(f"tolstat report {run.path} --machine")
    (said, *_) = steps_of(tolstat.summary(run))
    assert f"Prove it: {remedy.proving}" in said

    proved = tolstat.summary(run, model=Heated()).findings.remedy
    assert proved.evidence is Evidence.PROVED and not proved.proving
    assert [*proved.entries] == ["length"]

    class Other(Heated):
        failures = {"stuck": "the length sticks"}

    other = tolstat.summary(run, model=Other()).findings.remedy
    assert other.evidence is Evidence.PREDICTED and "differ" in other.note


def test_the_mean_of_a_lot_stays_where_it_is():
    """No drawing has it: the size of its parts moves."""
    study = {
        "model": "dimension_chain", "trials": 300, "seed": 1,
        "settings": {"gap": "box - shaft"},
        "links": {"box": "30.2 +-0.1 mm", "shaft": "30 +-0.1 mm"},
        "deviations": {"shaft_lot": "+-0.1 mm"}, "limits": {"gap": "0.1..0.4 mm"},
    }  # fmt: skip
    design = changeable_entries(tolstat.run(study)).design
    assert design.movable.tolist() == [True, True, False]


def test_a_contributor_whose_name_ends_as_one_of_a_lot_moves():
    study = {
        "model": "dimension_chain", "trials": 300, "seed": 1,
        "settings": {"gap": "box - parking_lot"},
        "links": {"box": "30.2 +-0.1 mm", "parking_lot": "30 +-0.1 mm"},
        "limits": {"gap": "0.1..0.4 mm"},
    }  # fmt: skip
    assert changeable_entries(tolstat.run(study)).design.movable.all()


def test_a_size_keeps_its_sign(tmp_path):
    links = {
        "stop": {"nominal": "1 deg", "tolerance": "+-0.2 deg"},
        "arm": {"nominal": "30 deg", "tolerance": "+-0.2 deg", "fixed": True},
    }
    study = stack() | {"links": links, "settings": {"gap": "arm - stop"}}
    study["limits"] = {"gap": "32..40 deg"}  # a stop at -4 deg would do
    remedy = remedy_of(ran(study, tmp_path))
    moved = [change.shift for change in remedy.changes]
    assert all(shift >= -math.radians(1) for shift in moved) and not remedy.met


def test_a_change_that_hardly_helps_is_no_remedy(tmp_path):
    """A limit in per cent of a ratio of 50: a tenth of a millimetre remains of a."""
    links = {
        "a": {"nominal": "10 mm", "tolerance": "+-0.1 mm"},
        "b": {"nominal": "20 mm", "tolerance": "+-0.1 mm"},
    }
    study = stack("49..51 %") | {"links": links, "settings": {"gap": "100*a/b"}}
    assert not remedy_of(ran(study, tmp_path)).steps


def test_fresh_trials_that_all_fail_prove_nothing(tmp_path, monkeypatch):
    run = ran(bought(), tmp_path)

    def fails(*arguments):
        stages = SampledStages(*arguments)
        stages.trials.responses[:] = np.nan
        stages.trials.status[:] = Status.STEP_TOO_SMALL
        return stages

    monkeypatch.setattr(find_remedy, "SampledStages", fails)
    remedy = remedy_of(run)
    assert remedy.note == "only 0 of 20000 fresh trials do not fail"
    assert remedy.evidence is Evidence.PREDICTED and remedy.steps
    (said,) = steps_of(tolstat.summary(run))
    assert f"Not proved: {remedy.note}." in said


def test_causes_are_tightened_where_no_surface_explains_a_response(tmp_path):
    """Most trials have no overlap at all: a point mass, as of a part that jams."""
    study = {
        "model": "dimension_chain", "trials": 20_000, "seed": 2,
        "settings": {"gap": "max(abs(a - b) - play, none)"},
        "links": {
            "a": {"nominal": "9 mm", "tolerance": "+-0.3 mm"},
            "b": {"nominal": "9 mm", "tolerance": "+-0.3 mm"},
            "c": {"nominal": "9 mm", "tolerance": "+-0.3 mm"},  # in no gap
            "play": "0.38 mm", "none": "0 mm",
        },
        "limits": {"gap": {"limit": "<= 0.08 mm", "yield": "99.95 %"}},
    }  # fmt: skip
    remedy = remedy_of(ran(study, tmp_path))
    assert remedy.entries and {*remedy.entries} <= {"a", "b"}
    assert remedy.evidence is Evidence.PROVED
    halves = [float(remedy.entries.get(n, "+-0.3 mm")[2:-3]) for n in ("a", "b")]
    share = 2 - 2 * normal(0.46 * 3 / math.hypot(*halves))
    _, after = remedy.limits["gap"]
    assert after.lower <= share <= after.upper
    follow(remedy.commands)


@pytest.mark.parametrize("limit", ["0.54..0.94 mm", "<= 1.2 mm"])
def test_limits_that_are_met_need_no_remedy(tmp_path, limit):
    assert remedy_of(ran(stack(limit), tmp_path)) is None


def test_a_part_of_a_run_has_no_remedy(tmp_path):
    run = ran(bought(), tmp_path)
    assert remedy_of(replace(run, complete=False)) is None


def test_grids_and_rare_runs_have_no_remedy(tmp_path):
    study = bought() | {"sampling": {"rare": "gap"}, "limits": {"gap": ">= 0.45 mm"}}
    study["trials"] = 5000
    tolstat.run(study, output=tmp_path / "rare.h5")
    assert "nominal values and tolerances" not in typed(
        f"tolstat show {tmp_path}/rare.h5"
    )


def test_a_run_without_its_study_file_has_commands(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = ran(bought(), Path())
    Path("gap.toml").unlink()
    remedy = remedy_of(on_a_busy_machine(tolstat.open(run.path)))
    assert remedy.met
    follow(remedy.commands)


def test_measured_and_correlated_parts_stay(tmp_path):
    sizes = np.random.default_rng(1).normal(80, 0.02, 300)
    (tmp_path / "parts.csv").write_text("\n".join(["size [mm]", *map(str, sizes)]))
    study = bought()
    study["links"]["shaft"] = {"nominal": "80 mm", "data": "parts.csv",
                               "column": "size"}  # fmt: skip
    study["correlation"] = {"housing": {"shaft": 0.5}}
    run = ran(study, tmp_path)
    remedy = remedy_of(on_a_busy_machine(run))
    assert [*remedy.entries] == ["housing"] and remedy.met
    fresh = follow(remedy.commands)
    assert tolstat.summary(fresh).verdicts["gap"] in ("met", "undecided")
    assert fresh.study.table["correlation"] == run.study.table["correlation"]
