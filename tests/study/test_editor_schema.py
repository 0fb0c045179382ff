"""The JSON Schema for editors: it accepts every study here, and refuses slips."""

from __future__ import annotations

import json
import tomllib

import pytest
from jsonschema import Draft202012Validator

import tolstat
from tests.cli.command_line import call
from tests.conftest import ROOT
from tests.model.rich import Rich
from tolstat import catalogue
from tolstat.study.editor_schema import editor_schema

MODELS = [catalogue.find(name) for name in catalogue.names()]
STUDIES = sorted((ROOT / "runs").glob("*.toml"))


@pytest.fixture(scope="module")
def validator():
    return Draft202012Validator(editor_schema([*MODELS, Rich()]))


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_every_study_is_accepted(path, validator):
    validator.validate(tomllib.loads(path.read_text()))


@pytest.mark.parametrize("model", [*MODELS, Rich()], ids=lambda model: model.name)
def test_a_new_study_is_accepted(model, validator):
    validator.validate(tomllib.loads(tolstat.new_study(model)))


BASE = {"model": "stand", "trials": 16, "seed": 1}


@pytest.mark.parametrize(
    "slip",
    [
        {"trails": 16},
        {"trials": "16"},
        {"seed": -1},
        {"sampling": "randon"},
        {"settings": {"crank_sped": "7 rad/s"}},
        {"settings": {"variant": "equal"}},
        {"settings": {"crank_speed": 7.5}},
        {"settings": {"cycles": 2.5}},
        {"deviations": {"rod_length": {"tolerance": "+-1 mm", "distribution": "norm"}}},
        {"deviations": {"rod_length": {"tolerance": "+-1 mm", "cost": {"shift": 3}}}},
        {"deviations": {"rod_length": {"tolerance": "+-1 mm", "cost": {"IT9": "3"}}}},
        {"limits": {"extra_loss": 3}},
        {"limits": {"extra_loss": {"limit": "<= 3 %", "pmm": 100}}},
        {"document": {"projekt": "mill"}},
    ],
    ids=str,
)
def test_a_slip_is_refused(slip, validator):
    validator.validate(BASE)
    assert not validator.is_valid({**BASE, **slip})


def test_names_are_offered_with_their_meaning(validator):
    (stand,) = (
        each["then"]["properties"]
        for each in validator.schema["allOf"]
        if each["if"]["properties"]["model"]["const"] == "stand"
    )
    assert {"rod_length", "rod_length_1"} <= {*stand["deviations"]["properties"]}
    words = stand["limits"]["properties"]["extra_loss"]["description"]
    assert words == "share of the drive energy lost to guide friction"


def test_the_command_prints_it():
    found = json.loads(call("models", "--schema").stdout)
    Draft202012Validator.check_schema(found)
    assert found["properties"]["model"]["examples"] == list(catalogue.names())
