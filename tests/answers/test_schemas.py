"""The JSON Schema of each answer: stored as it is made, and what answers say is so.

python -m tests.answers.test_schemas        # writes those that changed
"""

from __future__ import annotations

import json

import pytest

import tolstat
from tests.answers.allocate.linear_stack import Linear, listed
from tests.conftest import ROOT
from tolstat.answers.allocate.allocation import Allocation
from tolstat.answers.compare.comparison import Comparison
from tolstat.answers.what_if.what_if_answer import WhatIf
from tolstat.render.json_schema import schema_of

SCHEMAS = ROOT / "tolstat" / "answers" / "schemas"
ANSWERS = {"allocate": Allocation, "compare": Comparison, "what_if": WhatIf}


def made(name):
    return json.dumps(schema_of(ANSWERS[name], name), indent=1) + "\n"


@pytest.mark.parametrize("name", ANSWERS)
def test_each_schema_is_stored_as_it_is_made(name):
    assert ANSWERS[name].answers == name
    assert (SCHEMAS / f"{name}.json").read_text() == made(name)


def test_no_other_schema_is_stored():
    assert {path.stem for path in SCHEMAS.iterdir()} == set(ANSWERS)


@pytest.fixture(scope="module")
def gears(tmp_path_factory):
    path = tmp_path_factory.mktemp("gears") / "gear.h5"
    return tolstat.run(ROOT / "runs/wave-gear.toml", trials=400, output=path)


def valid(answer):
    validators = pytest.importorskip("jsonschema")
    schema = json.loads((SCHEMAS / f"{answer.answers}.json").read_text())
    validators.Draft202012Validator(schema).validate(json.loads(answer.json()))


def test_a_what_if_is_as_its_schema_says(gears):
    line = {"tolerance": "+-0.012 mm", "distribution": "uniform"}
    valid(tolstat.what_if(gears, {"R_out": line}))
    valid(tolstat.what_if(gears, {"R_out": line}, limits={}))


def test_a_comparison_is_as_its_schema_says(gears, tmp_path):
    study, path = ROOT / "runs/wave-gear.toml", tmp_path / "other.h5"
    other = tolstat.run(study, trials=300, seed=2, output=path)
    valid(tolstat.compare(gears, gears, other))


def test_an_allocation_is_as_its_schema_says():
    valid(tolstat.allocate(listed(), trials=1000, model=Linear()))


if __name__ == "__main__":
    for each in ANSWERS:
        (SCHEMAS / f"{each}.json").write_text(made(each))
