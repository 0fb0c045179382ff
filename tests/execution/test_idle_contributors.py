"""Names that miss: deviations that change nothing are said before the verdict."""

from __future__ import annotations

import json

import numpy as np
import pytest
import tomli_w

import tolstat
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.answers.report.gather import summary_of
from tolstat.answers.report.report_warnings import (
    FarLimit,
    IdleContributors,
    StudyWarning,
    UnchangedResponse,
)
from tolstat.answers.sampled_trials import drawn_trials

NAMES = ("linear", "even", "late", "product", "other", "idle", "cancelled")


class Mixed(Model):
    """Contributors that act in ways that no slope at the nominal shows."""

    name = "mixed"
    title = "ways to act"

    def describe(self, settings):
        parts = tuple(Contributor(name, "m") for name in NAMES)
        return Description(parts, (Response("gap", "m"), Response("aside", "m")))

    def evaluate(self, deviations, settings):
        linear, even, late, product, other, idle, cancelled = deviations.T
        gap = 1e-2 + linear + np.abs(even) + 0 * idle + (cancelled - cancelled)
        gap = gap + np.maximum(late - 0.8e-3, 0) + 1e3 * linear * product
        return Outcome(np.column_stack([gap, other]))


def summary(study, tmp_path, model=None):
    run = tolstat.run(
        study, model=model, output=tmp_path / "run.h5", workers=1, force=True
    )
    return summary_of(drawn_trials(run), ())


def study(deviations, **more):
    return {
        "model": "mixed", "trials": 256, "seed": 1, "limits": {"gap": "<= 20 mm"},
        "deviations": dict.fromkeys(deviations, "+-1 mm"), **more,
    }  # fmt: skip


def test_only_what_acts_nowhere_in_its_tolerance_is_idle(tmp_path):
    found = summary(study(NAMES), tmp_path, Mixed())
    assert found.warnings == (IdleContributors(("idle", "cancelled")),)


@pytest.mark.parametrize("name", ["linear", "even", "late", "other"])
def test_what_acts_alone_is_not_idle(tmp_path, name):
    found = summary(study(["linear", name]), tmp_path, Mixed())
    assert found.warnings == ()


def test_a_factor_of_what_does_not_deviate_is_idle(tmp_path):
    """A phase of a run-out that is zero in all trials."""
    found = summary(study(["even", "product"]), tmp_path, Mixed())
    assert found.warnings == (IdleContributors(("product",)),)


def test_a_limited_response_that_no_deviation_changes(tmp_path):
    found = summary(study(["other"]), tmp_path, Mixed())
    assert found.warnings == (
        UnchangedResponse("gap", 1e-2, found.stored_run.scales["gap"]),
    )
    found = summary(study(["idle"]), tmp_path, Mixed())
    assert found.warnings == (
        IdleContributors(("idle",)),
        UnchangedResponse("gap", 1e-2, found.stored_run.scales["gap"]),
    )


class Floor(Mixed):
    """A gap that a deviation changes beyond its tolerance only; it ends at zero."""

    name = "floor"

    def evaluate(self, deviations, settings):
        gap = np.maximum(deviations[:, 0] - 5e-3, 0.0)
        return Outcome(np.column_stack([gap, deviations[:, 4]]))


def test_a_response_that_stays_at_zero_is_ordinary_while_others_move(tmp_path):
    floor = {"model": "floor", "limits": {"gap": "<= 20 mm"}}
    found = summary({**study(["linear", "other"]), **floor}, tmp_path, Floor())
    assert found.warnings == (IdleContributors(("linear",)),)
    found = summary({**study(["linear"]), **floor}, tmp_path, Floor())
    assert found.warnings[1:] == (
        UnchangedResponse("gap", 0.0, found.stored_run.scales["gap"]),
    )


def test_a_full_turn_is_the_phase_of_a_run_out(tmp_path):
    """It acts with its run-out, and is no slip without it."""
    stand = {"model": "stand", "trials": 64, "seed": 1, "limits": {"yaw": "<= 9 mrad"}}
    stand["deviations"] = {
        "rod_length": "+-1 mm",
        "runout_phase": {"tolerance": "0..360 deg", "distribution": "uniform"},
    }
    warnings = summary(stand, tmp_path).early_warnings
    assert [w for w in warnings if w.kind != "errors"] == []


@pytest.mark.parametrize("sampling", ["latin", "sobol"])
def test_other_samplings_and_correlated_contributors(tmp_path, sampling):
    more = {"correlation": {"linear": {"idle": 0.9}}, "sampling": sampling}
    found = summary(study(["linear", "idle"], **more), tmp_path, Mixed())
    assert found.warnings == (IdleContributors(("idle",)),)


A = {"nominal": "10 mm", "tolerance": "+-0.1 mm"}
CHAIN = {"model": "dimension_chain", "trials": 64, "seed": 1}
LIMIT = {"limits": {"gap": "0.1..5 mm"}}


@pytest.mark.parametrize(
    ("gap", "links", "named"),
    [
        (
            "A - shaft",
            {"shaft": "9 mm", "shaft_1": {**A, "nominal": "9 mm"}},
            "shaft_1",
        ),
        ("A - shaft", {"shaft": "9 mm", "washer": "1 mm"}, "washer"),
        ("A - B_1", {"B_1": "9 mm", "B_2": "1 mm", "C": A}, "B_2, C"),
    ],
)
def test_links_that_the_formula_does_not_name(tmp_path, gap, links, named):
    chain = {**CHAIN, **LIMIT, "settings": {"gap": gap}, "links": {"A": A, **links}}
    (warning,) = summary(chain, tmp_path).warnings
    assert isinstance(warning, StudyWarning)
    assert f" {named}: " in warning.sentence


def test_what_acts_in_few_trials_with_others_is_not_idle():
    """In 89 of 4096 sixty are above 0.16 mm together; `even` changes nothing."""
    several = [f"c{i}" for i in range(60)]
    gap = f"a + 0*even + max(0 mm, {' + '.join(several)} - 0.16 mm)"
    links = {"a": "5 +-0.3 mm", **dict.fromkeys([*several, "even"], "0 +-0.03 mm")}
    chain = {**CHAIN, "settings": {"gap": gap}, "links": links, "trials": 4096}
    run = tolstat.run(chain, workers=1)
    assert run.diagnostics.idle == ("even",)


def test_a_chain_whose_tolerances_all_miss(tmp_path):
    links = {"A": "10 mm", "shaft": "9 mm", "shaft_1": A}
    chain = {**CHAIN, **LIMIT, "settings": {"gap": "A - shaft"}, "links": links}
    unused, unchanged = summary(chain, tmp_path).warnings
    assert "shaft_1" in unused.sentence
    assert unchanged.response == "gap" and unchanged.value == pytest.approx(1e-3)


def test_the_screen_says_it_before_the_verdict(tmp_path):
    found = summary(study(["linear", "idle"]), tmp_path, Mixed())
    said = [str(block) for block in found.document().blocks]
    (warning,) = (i for i, text in enumerate(said) if "No response depends" in text)
    assert warning < min(i for i, text in enumerate(said) if "The limit is" in text)
    assert json.loads(found.json())["warnings"][0]["contributors"] == ["idle"]


def test_rare_runs_and_tables_say_it_too(tmp_path):
    links = {"A": A, "B": "9 mm", "C": A}
    chain = {**CHAIN, **LIMIT, "settings": {"gap": "A - B"}, "links": links}
    rare = {**chain, "sampling": "rare", "trials": 5000}
    (tmp_path / "sizes.csv").write_text("A [mm],C [mm]\n0.1,0.2\n0.2,0.1\n")
    table = {"model": "dimension_chain", "sampling": "table", "table": "sizes.csv"}
    table |= {**LIMIT, "settings": {"gap": "A - B"}}
    table["links"] = {"A": "10 mm", "B": "9 mm", "C": "10 mm"}
    (tmp_path / "table.toml").write_text(tomli_w.dumps(table))
    for study in (rare, tmp_path / "table.toml"):
        run = tolstat.run(study, output=tmp_path / "run.h5", workers=1, force=True)
        found = tolstat.summary(run)
        (warning,) = found.warnings
        assert "name the link C:" in warning.sentence
        assert "name the link C:" in str(found.document().blocks[0])
        assert not any("link C" in note for note in run.notes)


@pytest.mark.parametrize(
    "limit, is_far",
    [
        ("<= 0.45 mm", False), ("<= 450 mm", False), ("<= 0.45 in", True),
        ("<= 0.45 m", True), (">= 0.05 um", True), (">= 0 m", False),
        ("0.02..0.45 m", True), ("<= 0.03 in", False),
    ],
)  # fmt: skip
def test_a_limit_in_a_unit_of_another_magnitude(limit, is_far):
    """The gap is 0.2 mm, all links are in mm."""
    chain = (
        tolstat.Chain(trials=64)
        .link("box", "60.2 +-0.1 mm")
        .link("ring", "60 +-0.05 mm")
        .gap("gap", "box - ring")
        .limit("gap", limit)
    )
    warnings = summary_of(drawn_trials(chain.run()), ()).warnings
    assert any(isinstance(warning, FarLimit) for warning in warnings) is is_far
