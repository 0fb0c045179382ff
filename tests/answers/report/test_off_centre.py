"""A response off the centre of its limit: what is said, and whether it helps."""

from __future__ import annotations

import json
import math
import os
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import stats

import tolstat
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.answers.report import finding_words
from tolstat.answers.report.finding_words import NOT_BEYOND as UNSEEN
from tolstat.answers.report.finding_words import centring_words, off_centre_words
from tolstat.answers.report.first_page import first_page
from tolstat.answers.report.gather import report_of, summary_of
from tolstat.answers.report.off_centre import MeanShift, Narrowing
from tolstat.answers.report.report_answer import StepKind
from tolstat.answers.report.summary_document import summary_document
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.cli.main import main
from tolstat.document.blocks import Bullets, Table
from tolstat.document.inline import Typed
from tolstat.errors import StudyError
from tolstat.render.screen import as_text
from tolstat.store.stored_run import NOT_ENDED
from tolstat.study.distribution_entry import keys_of

NEVER, NOT_HALVED = Narrowing.NEVER, Narrowing.NOT_BY_HALF
NONLINEAR, ONE_SIDED = MeanShift.NONLINEAR, MeanShift.ONE_SIDED
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


def link(name, **keys):
    """The stack-up with other keys of a link; a size of 0 leaves it out."""
    return {**STACK, "links": {**STACK["links"], name: STACK["links"][name] | keys}}


def found_of(study, folder, name="gap", **options):
    """Run a study file in a folder; return its summary and the finding, as parts."""
    run = tolstat.run(study, output=folder / "gap.h5", **options)
    found = summary_of(drawn_trials(run), ())
    step = found.findings.centring.get(name)
    return found, centring_words(run, found.responses[name], step)


def follow(parts, folder, *, shell=False):
    """Type the commands of a finding; return the run that they make."""
    typed = [each.text for each in parts if isinstance(each, Typed)]
    assert len(typed) == 2, as_text(parts)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    for each in typed:
        if shell:
            subprocess.run(
                each, shell=True, cwd=folder, env={**os.environ, "PATH": path},
                capture_output=True, check=True,
            )  # fmt: skip
        else:
            done = CliRunner().invoke(main, shlex.split(each)[1:])
            assert done.exit_code == 0, f"{each}\n{done.output}"
    (fresh,) = folder.glob("*centred.h5")
    return tolstat.open(fresh)


TRIANGULAR = {"tolerance": "+-0.12 mm", "distribution": "triangular"}


@pytest.mark.parametrize(
    "study",
    [
        STACK,
        {**STACK, "limits": {"gap": "<= 0.6 mm"}},
        {**STACK, "limits": {"gap": ">= 0.9 mm"}},
        # the steepest over its tolerance: a normal one with a shift, a one-sided one
        link("housing", tolerance="+-0.2 mm", shift="0.05 mm", cp=2.0),
        link("housing", nominal="12.06 cm", **TRIANGULAR),
        link("shaft", tolerance="-0.3..-0.1 mm", cp=2.0),
    ],
)
def test_the_commands_lead_to_a_limit_that_is_met(study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found, parts = found_of(study, Path())
    assert found.verdicts == {"gap": "not met"}
    fresh = follow(parts, tmp_path, shell=study is STACK)
    assert summary_of(drawn_trials(fresh), ()).verdicts == {"gap": "met"}


@pytest.mark.parametrize(
    ("tolerance", "typed"),
    [
        ("-50..-20 um", "tooth_thickness=-"),
        ({"tolerance": "-50..-20 um", "distribution": "uniform"}, "tooth_thickness=-"),
        ({"tolerance": "-50..-20 um", "common": True, "cp": 1.33}, "tooth_thickness=-"),
        ({"tolerance": "+-15 um", "nominal_shift": "-35 um"}, 'tolerance = "+-15 um"'),
    ],
)
def test_the_commands_move_tolerances_of_any_other_model(
    tolerance, typed, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    study = {
        "model": "planetary", "trials": 4000, "seed": 2,
        "settings": {"teeth": [24, 36, 21, 84], "module": "2.5 mm"},
        "deviations": {"tooth_thickness": tolerance, "centre_distance": "js7"},
        "limits": {"backlash": "0..16 arcmin"},
    }  # fmt: skip
    _, parts = found_of(study, Path(), "backlash")
    assert typed in as_text(parts)
    fresh = follow(parts, tmp_path)
    assert summary_of(drawn_trials(fresh), ()).verdicts == {"backlash": "met"}
    entry = fresh.study.table["deviations"]["tooth_thickness"]
    entry, kept = keys_of(entry), keys_of(tolerance)
    moved = "nominal_shift" if "nominal_shift" in kept else "tolerance"
    assert {**entry, moved: kept[moved]} == kept


def test_numbers_agree_with_the_closed_form(tmp_path):
    found, _ = found_of(STACK, tmp_path, trials=50_000)
    gap = found.responses["gap"]
    off = gap.off_centre
    mean = 0.6e-3 + (0.046e-3 + 0.12e-3 + 0.12e-3) / 2  # h8 of 80 mm
    tolerance = gap.mean.upper - gap.mean.lower
    assert off.what == "mean" and off.value == pytest.approx(mean, abs=tolerance)
    assert off.outside == pytest.approx(mean - 0.6e-3, abs=tolerance)
    assert off.shift == pytest.approx(0.375e-3 - mean, abs=tolerance)
    shifts = {each.members: each for each in off.shifts}
    assert {*shifts} == {("bearing_1", "bearing_2"), ("housing",), ("shaft",)}
    half = {"bearing_1": 0.06e-3, "housing": 0.12e-3, "shaft": 0.023e-3}
    slopes = {"bearing_1": -2, "housing": 1, "shaft": -1}
    for members, each in shifts.items():
        known = off.shift / slopes[members[0]]
        assert each.shift == pytest.approx(known, abs=0.02 * half[members[0]])
        assert each.relative == pytest.approx(abs(each.shift) / half[members[0]])
    sigma = math.sqrt(0.04**2 + (0.023 / 3) ** 2 + 2 * 0.12**2 / 12) * 1e-3
    assert gap.sigma.value == pytest.approx(sigma, rel=0.01)
    assert off.performance.pp.value > 1 > 0 > off.performance.ppk.value
    assert off.shifted.verdict == "met"


def test_the_finding_comes_first_and_no_cause_is_named(tmp_path):
    found, parts = found_of(STACK, tmp_path)
    blocks = first_page(found)
    kinds = [type(each) for each in blocks]
    assert kinds.index(Bullets) < kinds.index(Table)
    said = as_text(parts)
    for words in ("the mean lies", "above the limit", NEVER.strip(), "Pp 1.", "Ppk -",
                  "the spread is fine, the centre is not"):  # fmt: skip
        assert words in said
    causes = found.responses["gap"].causes
    assert not causes.named and causes.main is None
    (step,) = found.findings.steps
    assert (step.kind, step.responses) == (StepKind.CENTRE, ("gap",))
    off = found.responses["gap"].off_centre
    assert (step.parts, step.shift) == off.shifts[0][:2] and len(step.commands) == 2
    assert step.after == off.shifted.fraction_out_of_limit
    run = tolstat.open(tmp_path / "gap.h5")
    text = json.dumps(json.loads(tolstat.report(run).json())["responses"]["gap"])
    assert '"off_centre": {"what": "mean"' in text
    assert "off centre" in str(report_of(run).document())


def test_the_nominal_value_is_named_if_it_lies_outside_too(tmp_path):
    found, _ = found_of(link("housing", nominal="121 mm"), tmp_path)
    off = found.responses["gap"].off_centre
    assert (off.what, off.reason, off.tolerances) == ("nominal value", "", NEVER)
    assert off.outside == pytest.approx(0.4e-3)


def test_a_shift_beyond_the_sampled_tolerance_is_said_to_be_one(tmp_path):
    for limit, beyond in (("0.15..0.6 mm", True), ("0.43..0.88 mm", False)):
        found, parts = found_of({**STACK, "limits": {"gap": limit}}, tmp_path)
        shifts = found.responses["gap"].off_centre.shifts
        assert (shifts[0].relative > 1) == beyond
        assert (UNSEEN.strip() in as_text(parts)) == beyond
        (tmp_path / "gap.h5").unlink()


def test_a_kink_gives_no_shift(tmp_path):
    """The slopes at a kink, a half each, describe neither of its sides."""
    links = {n: {"nominal": "0 mm", "tolerance": "+-0.6 mm"} for n in ("x", "y")}
    study = {**STACK, "settings": {"gap": "max(x, y)"}, "links": links,
             "limits": {"gap": "<= 0.05 mm"}}  # fmt: skip
    off = found_of(study, tmp_path)[0].responses["gap"].off_centre
    assert off.reason == NONLINEAR and off.shifts == ()


def test_the_fresh_run_has_the_trials_that_decide(tmp_path):
    found, parts = found_of({**STACK, "limits": {"gap": "0.2..0.6 mm"}}, tmp_path)
    needed = found.responses["gap"].off_centre.shifted.needed
    assert needed > 4000 and f"--trials {needed}" in as_text(parts)


def test_a_nominal_value_outside_its_tolerance_is_not_named(tmp_path):
    """Ever narrower tolerances would leave 0.3 mm: the drawing aims at that."""
    housing = STACK["links"]["housing"] | {"tolerance": "-0.42..-0.3 mm"}
    links = {**STACK["links"], "housing": housing}
    study = {**STACK, "links": links, "limits": {"gap": "0.2..0.35 mm"}}
    found, _ = found_of(study, tmp_path)
    off = found.responses["gap"].off_centre
    assert (off.what, off.reason) == ("mean", ONE_SIDED)


def test_a_reason_is_given_if_only_the_mean_lies_outside(tmp_path):
    found, parts = found_of({**STACK, "limits": {"gap": "0.3..0.67 mm"}}, tmp_path)
    off = found.responses["gap"].off_centre
    assert (off.what, off.reason) == ("mean", ONE_SIDED)
    assert off.tolerances == NOT_HALVED  # half of the shift stays: 0.67 mm
    assert ONE_SIDED.strip() in as_text(parts)


def test_a_spread_that_moves_the_mean_calls_for_narrower_tolerances(tmp_path):
    """Out of round: no nominal value centres it, and half the spread helps."""
    links = {n: {"nominal": "0 mm", "tolerance": "+-0.6 mm"} for n in ("x", "y")}
    study = {**STACK, "settings": {"gap": "hypot(x, y)"}, "links": links,
             "limits": {"gap": "<= 0.2 mm"}}  # fmt: skip
    found, parts = found_of(study, tmp_path)
    gap = found.responses["gap"]
    assert (gap.off_centre.what, gap.off_centre.reason) == ("mean", NONLINEAR)
    assert gap.off_centre.shifts == () and NEVER not in gap.off_centre.tolerances
    assert "No nominal value" in as_text(parts)
    study["limits"] = {"gap": "<= 0.05 mm"}  # 97 % are out of limit
    found, _ = found_of(study, tmp_path, force=True)
    assert not found.responses["gap"].causes.named


def test_a_mean_inside_the_limit_is_off_centre_if_its_spread_is_fine(tmp_path):
    even = {"nominal": "20 mm", "tolerance": "+-0.06 mm"}
    links = {**STACK["links"], "bearing_1": even, "bearing_2": even}
    study = {**STACK, "links": links, "limits": {"gap": "0.1..0.68 mm"}}
    found, parts = found_of(study, tmp_path)
    gap = found.responses["gap"]
    off, (pp, ppk) = gap.off_centre, gap.off_centre.performance
    assert (off.what, off.outside, off.tolerances) == ("", 0.0, NOT_HALVED)
    assert pp.lower > 1 > ppk.upper and "off the middle" in as_text(parts)


@pytest.mark.parametrize("limit", ["0.54..0.94 mm", "0.7..0.78 mm", "<= 0.8 mm"])
def test_a_centred_response_or_a_near_end_is_not_off_centre(limit, tmp_path):
    found, parts = found_of({**STACK, "limits": {"gap": limit}}, tmp_path)
    assert found.responses["gap"].off_centre is None and parts == ()


def test_parts_that_act_against_each_other_are_not_shifted_together(tmp_path):
    study = {**STACK, "settings": {"gap": "housing + shaft - bearing_1 + bearing_2"}}
    found, _ = found_of({**study, "limits": {"gap": "199..200 mm"}}, tmp_path)
    members = [each.members for each in found.responses["gap"].off_centre.shifts]
    assert ("bearing_1", "bearing_2") not in members and len(members) == 3


def test_measured_parts_have_no_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sizes = np.random.default_rng(1).normal(121, 0.05, 300)
    text = "\n".join(["size", *map(str, sizes)])
    Path("parts.csv").write_text(text)
    Path("gap.toml").write_text(
        """model = "dimension_chain"\ntrials = 3000\nseed = 1
        settings.gap = "housing - shaft"\nlinks.shaft = "120 mm"
        limits.gap = "0..0.5 mm"
        [links.housing]\nnominal = "120.2 mm"\ndata = "parts.csv"
        column = "size"\nunit = "mm"\nfit = "normal"\n"""
    )
    _, parts = found_of(Path("gap.toml"), Path())
    assert "Change the nominal value of housing by" in as_text(parts)
    assert not [each for each in parts if isinstance(each, Typed)]


def test_a_grade_follows_the_new_size_of_its_link(tmp_path):
    tolstat.run(STACK, output=tmp_path / "gap.h5")
    text = tolstat.fresh_study(tmp_path / "gap.h5", {"shaft": {"nominal": "81 mm"}})
    fresh = tolstat.run(_written(text, tmp_path), output=tmp_path / "new.h5")
    assert fresh.assumed["shaft"].tolerance == pytest.approx((-54e-6, 0))  # to 120 mm
    assert fresh.study.table["links"]["shaft"] == {
        "nominal": "81 mm",
        "tolerance": "h8",
    }
    assert fresh.nominal_values["gap"] == pytest.approx(-0.4e-3)
    with pytest.raises(StudyError, match="did you mean 'shaft'"):
        tolstat.fresh_study(tmp_path / "gap.h5", {"shaf": {"nominal": "81 mm"}})


def _written(text, folder):
    (folder / "new.toml").write_text(text)
    return folder / "new.toml"


def test_the_median_is_named_if_the_mean_of_a_skewed_response_lies_inside(tmp_path):
    links = {"x": {"nominal": "0", "tolerance": "-1.8..1.2"}}  # median 0.74, mean 0.84
    study = {**STACK, "settings": {"gap": "exp(x)"}, "links": links,
             "limits": {"gap": "0.8..3"}}  # fmt: skip
    found, parts = found_of(study, tmp_path)
    off = found.responses["gap"].off_centre
    assert off.what == "median" and off.value == pytest.approx(math.exp(-0.3), rel=0.03)
    assert "the median lies" in as_text(parts)


@pytest.mark.parametrize(("limit", "far"), [(">= 170 %", False), (">= 400 %", True)])
def test_no_share_is_shifted_by_100_per_cent(limit, far, tmp_path):
    class Stiff(Model):
        name = "stiff"

        def describe(self, settings):
            parts = (Contributor("stiffness", "1", "c", "relative"),)
            return Description(parts, (Response("force", "1", "F"),))

        def evaluate(self, deviations, settings):
            return Outcome(1 + deviations)

    study = {"model": "stiff", "trials": 500, "seed": 1, "limits": {"force": limit},
             "deviations": {"stiffness": "+-15 %"}}  # fmt: skip
    run = tolstat.run(study, model=Stiff(), output=tmp_path / "stiff.h5")
    off = summary_of(drawn_trials(run), ()).responses["force"].off_centre
    assert bool(off.shifts) is not far


def test_a_nominal_trial_that_failed_leaves_no_claim(tmp_path):
    run = tolstat.run(STACK, output=tmp_path / "gap.h5")
    slopes = {"gap": dict.fromkeys(run.diagnostics.slopes["gap"], math.nan)}
    run = replace(
        run,
        diagnostics=replace(run.diagnostics, slopes=slopes),
        nominal_answers=run.nominal_answers._replace(responses=np.full((1, 1), np.nan)),
    )
    off = summary_of(drawn_trials(run), ()).responses["gap"].off_centre
    assert (off.what, off.tolerances, off.reason, off.shifts) == ("mean", "", "", ())


def test_only_the_first_findings_are_told_whole(tmp_path, toy, monkeypatch):
    limits = {"gap": "9..10 mm", "ratio": "8..9"}
    toy_study = {"model": "toy", "trials": 500, "seed": 1, "limits": limits,
                 "deviations": {"part": "+-0.1 mm"}}  # fmt: skip
    run = tolstat.run(toy_study, model=toy, output=tmp_path / "toy.h5")
    found = summary_of(drawn_trials(run), ())
    said = [as_text(each) for each in off_centre_words(found)]
    assert {each.split(":")[0] for each in said} == {"gap", "ratio"}
    monkeypatch.setattr(finding_words, "MOST_OFF_CENTRE", 1)
    said = [as_text(each) for each in off_centre_words(found)]
    assert said[1].startswith("Also off centre: ")


def test_a_partial_run_claims_nothing_on_tolerances(tmp_path):
    run = tolstat.run(STACK, output=tmp_path / "gap.h5")
    found = summary_of(drawn_trials(replace(run, diagnostics=NOT_ENDED)), ())
    off = found.responses["gap"].off_centre
    assert (off.what, off.reason, off.shifts) == ("mean", "", ())


NARROW = {"tolerance": "+-0.05 mm"}
CHAIN = {
    "model": "dimension_chain", "trials": 20_000, "seed": 1,
    "settings": {"gap": "H - a - b - c"},
    "links": {
        "H": {"nominal": "50 mm", "tolerance": "+-0.1 mm"},
        "a": {"nominal": "20 mm", **NARROW}, "b": {"nominal": "15 mm", **NARROW},
        "c": {"nominal": "14.5 mm", **NARROW},
    },
}  # fmt: skip


def chain(limit, **keys):
    """The chain, nominal value 0.5 mm, with a limit and other keys of H."""
    links = {**CHAIN["links"], "H": CHAIN["links"]["H"] | keys}
    return {**CHAIN, "links": links, "limits": {"gap": limit}}


@pytest.mark.parametrize(
    ("limit", "place", "tolerances"),
    [
        ("<= 0.51 mm", "mm inside the limit", NOT_HALVED),
        (">= 0.49 mm", "mm inside the limit", NOT_HALVED),
        ("<= 0.5 mm", "the mean lies on the end of the limit", NEVER),
    ],
)
def test_no_cause_is_named_for_a_mean_near_the_one_end(
    limit, place, tolerances, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    found, parts = found_of(chain(limit), Path())
    gap = found.responses["gap"]
    assert (gap.off_centre.what, gap.off_centre.tolerances) == ("", tolerances)
    assert place in as_text(parts) and tolerances.strip() in as_text(parts)
    halve = {StepKind.HALVE, StepKind.TEST_HALF}
    assert not gap.causes.named
    assert not halve & {step.kind for step in found.findings.steps}
    fresh = follow(parts, tmp_path)
    assert summary_of(drawn_trials(fresh), ()).verdicts == {"gap": "met"}


def test_halving_that_meets_the_one_end_is_no_matter_of_the_centre(tmp_path):
    """Sigma 0.044 mm: 0.07 mm is 3.2 of a half; 0.04 mm ends an even half of 0.03."""
    found, parts = found_of(chain("<= 0.57 mm"), tmp_path)
    assert found.verdicts == {"gap": "not met"} and parts == ()
    still = {"a": "20 mm", "b": "15 mm", "c": "14.5 mm"}
    even = {"nominal": "50 mm", "tolerance": "+-0.06 mm", "distribution": "uniform"}
    study = {**chain("<= 0.54 mm"), "links": {**still, "H": even}}
    found, parts = found_of(study, tmp_path, force=True)
    assert found.verdicts == {"gap": "not met"} and parts == ()


def test_a_mean_moved_by_the_spread_stays_a_matter_of_the_spread(tmp_path):
    links = {n: {"nominal": "0 mm", "tolerance": "+-0.6 mm"} for n in ("x", "y")}
    study = {**STACK, "settings": {"gap": "max(x, y)"}, "links": links,
             "limits": {"gap": "<= 0.2 mm"}}  # fmt: skip
    found, parts = found_of(study, tmp_path)
    assert found.verdicts == {"gap": "not met"} and parts == ()


def test_rounding_puts_no_nominal_value_outside(tmp_path):
    """50 - 20 - 15 - 14.5 mm is 2e-18 m more than 0.5 mm."""
    found, _ = found_of(chain("0.1..0.5 mm", tolerance="0..0.6 mm"), tmp_path)
    off = found.responses["gap"].off_centre
    assert (off.what, off.reason) == ("mean", ONE_SIDED)
    assert off.outside == pytest.approx(0.3e-3, rel=0.01)


@pytest.mark.parametrize(
    ("limit", "told"), [("0.25..0.75 mm", False), ("0.25..0.7499 mm", True)]
)
def test_a_worst_case_on_the_end_is_not_out_of_limit(limit, told, tmp_path):
    found, _ = found_of(chain(limit), tmp_path)
    said = str(summary_document(found))
    assert ("Worst case of the tolerances" in said) is told


@pytest.mark.parametrize("limit", ["0.1..0.45 mm", "0.1..0.55 mm"])
def test_a_shifted_nominal_is_not_named_without_its_shift(limit, tmp_path):
    """At 0.6 mm by the shift: narrower tolerances leave it there."""
    found, parts = found_of(chain(limit, nominal_shift="0.1 mm"), tmp_path)
    off = found.responses["gap"].off_centre
    assert (off.what, off.reason, off.tolerances) == ("mean", "", NEVER)
    assert off.value == pytest.approx(0.6e-3, abs=0.002e-3)
    assert "nominal value lies" not in as_text(parts)


FIT = {
    "model": "dimension_chain", "trials": 4000, "seed": 1,
    "settings": {"gap": "hole - shaft"},
}  # fmt: skip
H7, G6, F7, P6 = (0, 25), (-25, -9), (-50, -25), (26, 42)  # um, of 50 mm


@pytest.mark.parametrize(
    ("hole", "shaft", "limit", "never"),
    [
        (H7, G6, ">= 20 um", False), (H7, G6, ">= 35 um", True),
        (H7, G6, "20..80 um", False), (H7, F7, ">= 40 um", False),
        (H7, F7, ">= 60 um", True), (H7, P6, ">= -25 um", False),
        (H7, P6, "<= -36 um", True), (H7, (-60, -20), ">= 45 um", False),
        ((-12, 12), (-8, 8), ">= 2 um", True),
    ],
)  # fmt: skip
def test_never_is_said_where_no_narrower_zone_meets_the_limit(
    tmp_path, hole, shaft, limit, never
):
    """At the middles, at the ends nearest to zero, or one of each."""
    links = {
        name: {"nominal": "50 mm", "tolerance": "{}..{} um".format(*zone)}
        for name, zone in (("hole", hole), ("shaft", shaft))
    }
    study = {**FIT, "links": links, "limits": {"gap": limit}}
    off = found_of(study, tmp_path)[0].responses["gap"].off_centre
    said = off is not None and off.tolerances == NEVER
    ends = [(sum(zone) / 2, min(max(0, zone[0]), zone[1])) for zone in (hole, shaft)]
    lower, upper = tolstat.open(tmp_path / "gap.h5").limits["gap"].permitted
    reached = [1e-6 * (a - b) for a in ends[0] for b in ends[1]]
    possible = any(lower < gap < upper for gap in reached)
    assert said == never == (not possible)


def test_half_the_width_about_the_same_middles_meets_the_limit_of_a_clearance_fit():
    """H7/g6 of 50 mm, at least 18 um: 10 000 ppm, and 2 ppm about the middles."""
    mean, sigma = 12.5 + 17.0, math.hypot(25 / 6, 16 / 6)
    assert stats.norm.cdf((18 - mean) / sigma) > 2.7e-3
    assert stats.norm.cdf((18 - mean) / (sigma / 2)) < 1e-4


@pytest.mark.parametrize(
    ("play", "never"),
    [
        ({"nominal": "0 mm"}, True),  # an amplitude narrows to zero, below the limit
        ({"nominal": "25 mm"}, False),  # a hole narrows to 25.05 mm, above it
    ],
)
def test_never_follows_the_deviation_that_stays(tmp_path, play, never):
    tolerance = {"tolerance": "0..0.1 mm", "distribution": "uniform"}
    size = float(play["nominal"].split()[0])
    study = {**FIT, "settings": {"gap": "play + bar"},
             "links": {"play": play | tolerance, "bar": NARROW | {"nominal": "5 mm"}},
             "limits": {"gap": f">= {size + 5.04:g} mm"}}  # fmt: skip
    off = found_of(study, tmp_path)[0].responses["gap"].off_centre
    assert (off is not None and off.tolerances == NEVER) is never
