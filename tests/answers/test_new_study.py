"""A commented study of each model: it runs, and names all inputs of the model."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass

import pytest

import tolstat
from tests.cli.command_line import call
from tests.conftest import Toy
from tests.model.rich import Rich
from tolstat import catalogue
from tolstat.model import settings as model_settings
from tolstat.model.checked import described
from tolstat.study.study import load

# that of results needs a file: tests/study/test_results.py
MODELS = [*(n for n in catalogue.names() if n != "results"), Rich(), Toy()]
OPTIONAL = re.compile(r"^# (?=\w+ = \")", re.MULTILINE)


@pytest.fixture(params=MODELS, ids=lambda each: getattr(each, "name", each))
def model(request):
    return catalogue.find(request.param)


def test_a_new_study_loads_with_and_without_optional_entries(model):
    text = tolstat.new_study(model)
    for each in (text, OPTIONAL.sub("", text)):
        found = load(tomllib.loads(each), model=model)
        defaults = model_settings.make(model)
        for name, value in vars(defaults).items():
            # a quantity of any unit remembers how it was typed
            if name not in ("links", "size"):
                assert getattr(found.settings, name) == value
    contributors, responses = described(model, defaults)
    assert {*found.limits} == {each.name for each in responses}
    assert {*found.deviating.distributions} == {each.name for each in contributors}
    assert all(len(line) <= 90 for line in text.splitlines() if line[0:1] == "#")


def test_quantities_are_in_readable_units():
    text = tolstat.new_study("planetary")
    assert 'pressure_angle = "20 deg"' in text and "0.349" not in text
    assert 'speed_range = "850..1700 rpm"' in tolstat.new_study("rolling_block")


def test_the_command_writes_a_file_and_replaces_none(tmp_path):
    path = tmp_path / "mine.toml"
    assert call("new", "stand", "-o", path).exit_code == 0
    assert load(path).trials == 4096
    done = call("new", "stand", "-o", path)
    assert done.exit_code == 2 and "exists; give another name" in done.stderr
    assert call("new", "stand").stdout == path.read_text()
    done = call("new", "stant")
    assert done.exit_code == 2 and "no model is called 'stant'" in done.stderr


@dataclass(frozen=True)
class Quoted:
    mode: str = tolstat.setting('pl"ain', "how it\nis done")


class Hostile(Toy):
    title = "first line\n evil = 1"
    settings = Quoted


def test_texts_of_a_model_cannot_break_the_study():
    found = tomllib.loads(tolstat.new_study(Hostile()))
    assert found["settings"] == {"mode": 'pl"ain'} and "evil" not in found


def test_a_part_that_cannot_be_negative_has_a_zone_on_one_side():
    study = tolstat.new_study("stand")
    assert '# joint_clearance = "0..0.1 mm"' in study
    assert '# guide_clearance = "+-0.1 mm"' in study
