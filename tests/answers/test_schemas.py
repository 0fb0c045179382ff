"""The JSON Schema of each answer: the stored one is current, and answers match it.

python -m tests.answers.test_schemas        # writes those that changed
"""

from __future__ import annotations

import json

import pytest

import tolstat
from tests.answers.allocate.linear_stack import Linear, listed
from tests.answers.conftest import chain
from tests.answers.schema_maker import schema_of
from tests.conftest import ROOT
from tolstat.answers.allocate.allocation import Allocation
from tolstat.answers.compare.comparison import Comparison
from tolstat.answers.parts.parts_answer import PartsAnswer
from tolstat.answers.rare.rare_answer import RareSummary
from tolstat.answers.report.full_report import Report
from tolstat.answers.report.report_answer import RunSummary
from tolstat.answers.run_entries import RunIndex, stored_runs
from tolstat.answers.sweep.extremes import Extremes
from tolstat.answers.views.replay import Replay
from tolstat.answers.what_if.what_if_answer import Scenarios, WhatIf
from tolstat.cli.check import LimitCheck, checked
from tolstat.render.serialize import as_json

SCHEMAS = ROOT / "tolstat" / "answers" / "schemas"
ANSWERS = {
    "allocate": Allocation, "check": LimitCheck, "compare": Comparison,
    "extremes": Extremes,
    "parts": PartsAnswer, "rare": RareSummary, "report": Report, "runs": RunIndex,
    "scenarios": Scenarios, "summary": RunSummary, "trial": Replay, "what_if": WhatIf,
}  # fmt: skip
WIDEST = 88


def made(name):
    return in_lines(schema_of(ANSWERS[name], name)) + "\n"


def in_lines(found, indent=1):
    """Write JSON to be read: what fits into a line stands in one."""
    line = json.dumps(found)
    if not isinstance(found, dict) or len(line) + indent <= WIDEST:
        return line
    inner = (
        f"{' ' * indent}{json.dumps(key)}: {in_lines(each, indent + 1)}"
        for key, each in found.items()
    )
    return "{\n" + ",\n".join(inner) + "\n" + " " * (indent - 1) + "}"


@pytest.mark.parametrize("name", ANSWERS)
def test_each_stored_schema_matches_its_answer(name):
    assert ANSWERS[name].answers == name
    assert (SCHEMAS / f"{name}.json").read_text() == made(name)


def test_no_unused_schema_is_stored():
    assert {path.stem for path in SCHEMAS.iterdir()} == set(ANSWERS)


ONE_KIND = (
    "all_limits", "trials_out_of_limit", "fractions_out_of_limit", "equivalent_ppk",
    "equivalent_ppks", "equivalent_ppk_difference", "within", "yields", "verdict",
    "effective_sample_size", "ran", "root_sum_square", "out_of_limit",
    "fraction_out_of_limit_difference",
)  # fmt: skip


def test_a_name_of_json_means_one_thing():
    """Of one type in all answers: a count, an estimate, or a record."""
    kinds = {}
    for name in ANSWERS:
        schema = schema_of(ANSWERS[name], name)
        for record in (schema, *schema["$defs"].values()):
            for key, each in record.get("properties", {}).items():
                either = json.dumps(each.get("anyOf", [each])[0])
                kinds.setdefault(key, set()).add(either)
    assert {key: kinds[key] for key in ONE_KIND if len(kinds[key]) > 1} == {
        "all_limits": {
            '{"$ref": "#/$defs/all_limits"}', '{"$ref": "#/$defs/all_limits_what_if"}'
        }
    }  # fmt: skip
    assert not kinds.keys() & {"equivalent", "yield_all_limits", "ended"}


@pytest.fixture(scope="module")
def gears(tmp_path_factory):
    path = tmp_path_factory.mktemp("gears") / "gear.h5"
    return tolstat.run(ROOT / "runs/wave-gear.toml", trials=400, output=path)


def valid(answer):
    validators = pytest.importorskip("jsonschema")
    schema = json.loads((SCHEMAS / f"{answer.answers}.json").read_text())
    found = json.loads(as_json(answer, answer.answers))
    validators.Draft202012Validator(schema).validate(found)


def test_a_trial_and_runs_match_their_schemas(gears):
    valid(tolstat.replay(gears, 3))
    valid(tolstat.replay(gears, None))
    valid(stored_runs(gears.path.parent))
    valid(checked([gears]))


def test_a_what_if_matches_its_schema(gears):
    line = {"tolerance": "+-0.012 mm", "distribution": "uniform"}
    valid(tolstat.what_if(gears, {"R_out": line}))
    valid(tolstat.what_if(gears, {"R_out": line}, limits={}))
    valid(tolstat.what_if(gears, {"R_out": line}, evaluate=False))
    valid(tolstat.what_if(gears, [{"R_out": line}, {"R_out": "+-0.01 mm"}]))


def test_a_comparison_matches_its_schema(gears, tmp_path):
    study, path = ROOT / "runs/wave-gear.toml", tmp_path / "other.h5"
    other = tolstat.run(study, trials=300, seed=2, output=path)
    valid(tolstat.compare(gears, gears, other))


def test_measured_parts_match_their_schema():
    drawing = {"unit": "mm", "nominal": "2450 mm", "tolerance": "+-1.2 mm"}
    valid(tolstat.parts(ROOT / "runs/rods.csv", **drawing))


def test_an_allocation_matches_its_schema():
    valid(tolstat.allocate(listed(), trials=1000, model=Linear()))


def test_a_summary_and_a_report_match_their_schemas(gears, small_as_run):
    for run in (gears, small_as_run):
        valid(tolstat.summary(run))
        valid(tolstat.report(run))


@pytest.mark.parametrize(("sampling", "trials"), [("saltelli", 2500), ("latin", 100)])
def test_a_report_matches_its_schema_for_any_sampling(toy, toy_study, sampling, trials):
    """Some trials fail, and nothing is known of the integration error."""
    toy_study.write_text(f'sampling = "{sampling}"\n{toy_study.read_text()}')
    run = tolstat.run(toy_study, model=toy, trials=trials)
    valid(tolstat.summary(run))
    valid(tolstat.report(run))


@pytest.mark.parametrize("limit", ["<= 2416.9 mm", "<= 9999 mm"])
def test_a_rare_answer_matches_its_schema(tmp_path, limit):
    study = chain({"limit": limit, "ppm": 100}, sampling="rare")
    valid(tolstat.summary(tolstat.run(study, output=tmp_path / "rare.h5")))


def test_extremes_match_their_schema(toy, tmp_path):
    study = {
        "model": "toy", "sampling": "grid", "grid": {"part_1": ["0 mm", "1 mm"]},
        "limits": {"gap": "<= 1 mm"},
    }  # fmt: skip
    valid(tolstat.summary(tolstat.run(study, model=toy, output=tmp_path / "g.h5")))


if __name__ == "__main__":
    for each in ANSWERS:
        (SCHEMAS / f"{each}.json").write_text(made(each))
