"""What an FMU says of itself, read without its library."""

from __future__ import annotations

import math
import zipfile

import numpy as np
import pytest

from tests.fmu.building import MODELS, description
from tolstat import catalogue
from tolstat.errors import ModelError
from tolstat.fmu.base_units import BaseUnit, unit_of_variable
from tolstat.fmu.model_xml import read_fmu
from tolstat.model.checked import described
from tolstat.model.settings import make, settings_of

UNITS = {
    "kg.m2": {"kg": "1", "m": "2"},
    "N.m": {"kg": "1", "m": "2", "s": "-2"},
    "J": {"kg": "1", "m": "2", "s": "-2"},
    "rev/min": {"s": "-1", "rad": "1", "factor": repr(2 * math.pi / 60)},
    "m/s2": {"m": "1", "s": "-2"},
    "mm": {"m": "1", "factor": "0.001"},
    "degC": {"K": "1", "offset": "273.15"},
    "mol": {"mol": "1"},
    "%": {"factor": "0.01"},
    "m6": {"m": "6"},
    "Ohm": {"kg": "1", "m": "2", "s": "-3", "A": "-2"},
}


@pytest.mark.parametrize(
    ("name", "si", "of_one"),
    [
        ("kg.m2", "kg m^2", 1.0),
        ("N.m", "N m", 1.0),
        ("J", "J", 1.0),
        ("rev/min", "rad/s", 2 * math.pi / 60),
        ("m/s2", "m/s^2", 1.0),
        ("mm", "m", 1e-3),
        ("degC", "1", 1.0),  # has an offset: a plain number
        ("Ohm", "ohm", 1.0),
        ("%", "1", 0.01),
        ("mol", "1", 1.0),  # not known to tolstat: a plain number
        ("m6", "1", 1.0),
        ("", "1", 1.0),
        ("N.m/rad", "N m/rad", 1.0),  # no base units: read by its name
        ("km", "m", 1000.0),
        ("furlong", "1", 1.0),
    ],
)
def test_units_by_their_base_exponents(name, si, of_one):
    units = {n: BaseUnit.read(facts) for n, facts in UNITS.items()}
    unit = unit_of_variable(name, "", units)
    assert unit.si == si
    assert unit.to_si(1.0) == pytest.approx(of_one, rel=1e-15)
    assert unit.from_si(unit.to_si(7.0)) == pytest.approx(7.0, rel=1e-13)


def packed(folder, text, name="m.fmu"):
    path = folder / name
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
    return path


@pytest.mark.parametrize("fmi", [2, 3])
def test_parameters_outputs_bounds_and_kinds(tmp_path, fmi):
    text = description("Backlash", MODELS["Backlash"], fmi)
    model = catalogue.load(str(packed(tmp_path, text)))
    settings = make(model)
    parts, responses = described(model, settings)
    assert [(p.name, p.unit, p.size) for p in parts] == [
        ("m1", "kg", 0.4), ("m2", "kg", 0.9), ("k", "N/m", 8e4), ("c", "N s/m", 15.0),
        ("gap", "m", 2e-4), ("F", "N", 12.0), ("v0", "m/s", 0.0),
    ]  # fmt: skip
    assert [(r.name, r.unit) for r in responses] == [
        ("peak", "N"), ("position", "m"), ("impacts", "1"),
    ]  # fmt: skip
    kinds = settings_of(model)
    assert kinds["material"].kind.allowed == "steel, nylon"
    assert kinds["teeth"].kind.allowed == "whole number from 5 to 200"
    assert (settings.material, settings.teeth, settings.damped) == ("steel", 23, True)
    assert (settings.stop, settings.max_step, settings.rtol) == (0.5, 0.01, 1e-6)
    rows = np.zeros((3, 7))
    rows[1, 4], rows[2, 0] = 9e-4, -0.5  # gap above its max, mass below its min
    outside = model.impossible(rows, settings)["outside its range"]
    assert outside.tolist() == [False, True, True]


VARIABLES = """
<ScalarVariable name='damper.d' valueReference='0' causality='parameter' variability='fixed'><Real start='10' declaredType='T'/></ScalarVariable>
<ScalarVariable name='damper_d' valueReference='1' causality='parameter' variability='fixed'><Real start='1'/></ScalarVariable>
<ScalarVariable name='lambda' valueReference='2' causality='parameter' variability='tunable'><Real start='1'/></ScalarVariable>
<ScalarVariable name='stop' valueReference='3' causality='input'><Real start='2' unit='mm'/></ScalarVariable>
<ScalarVariable name='free' valueReference='4' causality='input'><Real/></ScalarVariable>
<ScalarVariable name='fixed' valueReference='5' causality='parameter' variability='constant'><Real start='1'/></ScalarVariable>
<ScalarVariable name='calculated' valueReference='6' causality='calculatedParameter' variability='fixed'><Real/></ScalarVariable>
<ScalarVariable name='huge' valueReference='7' causality='parameter' variability='fixed'><Real start='1e200'/></ScalarVariable>
<ScalarVariable name='x[1]' valueReference='8' causality='output'><Real/></ScalarVariable>
<ScalarVariable name='status' valueReference='9' causality='output' variability='discrete'><Integer/></ScalarVariable>
"""  # noqa: E501
DOCUMENT = """<?xml version='1.0'?>
<fmiModelDescription fmiVersion='2.0' modelName='Rig.Test' guid='g'>
<CoSimulation modelIdentifier='Rig'/>
<UnitDefinitions><Unit name='mm'><BaseUnit m='1' factor='0.001'/></Unit></UnitDefinitions>
<TypeDefinitions><SimpleType name='T'><Real unit='mm' min='1' max='20'/></SimpleType></TypeDefinitions>
<ModelVariables>{}</ModelVariables></fmiModelDescription>"""  # noqa: E501


def test_a_unit_with_an_offset_is_a_plain_number(tmp_path):
    text = DOCUMENT.format(
        "<ScalarVariable name='T' valueReference='0' causality='parameter' "
        "variability='fixed' description='room'>"
        "<Real start='20' unit='degC' min='-40' max='60'/></ScalarVariable>"
        "<ScalarVariable name='hot' valueReference='1' causality='output'>"
        "<Real unit='degC'/></ScalarVariable>"
    ).replace(
        "</UnitDefinitions>",
        "<Unit name='degC'><BaseUnit K='1' offset='273.15'/></Unit></UnitDefinitions>",
    )
    model = catalogue.load(str(packed(tmp_path, text)))
    parts, responses = described(model, make(model))
    assert (parts[0].unit, parts[0].size, parts[0].sentence) == (
        "1", 20.0, "room in degC",
    )  # fmt: skip
    assert (responses[0].unit, responses[0].sentence) == ("1", "hot in degC at the end")
    outside = model.impossible(np.array([[39.0], [41.0]]), make(model))
    assert outside["outside its range"].tolist() == [False, True]
    with pytest.raises(ModelError, match="T"):
        make(model, {"T": "20 degC"})


def test_names_that_can_be_typed_and_declared_types(tmp_path):
    model = catalogue.load(str(packed(tmp_path, DOCUMENT.format(VARIABLES))))
    assert model.name == "Rig.Test"
    settings = make(model)
    parts, responses = described(model, settings)
    names = [part.name for part in parts]
    assert names == ["damper_d", "damper_d_parameter", "lambda_parameter",
                     "stop_parameter"]  # fmt: skip
    assert [r.name for r in responses] == ["x_1", "status_parameter"]
    assert parts[0].size == pytest.approx(0.01)
    assert parts[3].size == pytest.approx(2e-3)
    below = model.impossible(np.array([[-9.5e-3, 0, 0, 0]]), settings)
    assert below["outside its range"].all()  # of the declared type
    assert (settings.stop, settings.max_step) == (1.0, 0.002)


def test_settings_are_checked(tmp_path):
    text = description("Backlash", MODELS["Backlash"], 2)
    model = catalogue.load(str(packed(tmp_path, text)))
    for settings, words in (
        ({"gap": 0.1}, "at most 1 mm"),
        ({"material": "wood"}, "steel, nylon"),
        ({"teeth": 23.7}, "whole number"),
        ({"responses": {"x": {"taken": "max speed"}}}, "no variable speed"),
        ({"responses": {"x": {"taken": "time peak above 3 mm"}}}, "another kind"),
        ({"stop": 0.0}, "above 0 s"),
        ({"max_step": 0.6}, r"max_step is 0\.6 s, longer than .* stop, 0\.5 s"),
    ):
        with pytest.raises(ModelError, match=words):
            described(model, make(model, settings))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<fmiModelDescription fmiVersion='1.0'/>", "FMI 1.0"),
        ("<fmiModelDescription fmiVersion='2.0'/>", "neither co-simulation nor"),
        ("no XML", "is not an FMU"),
        (
            "<fmiModelDescription fmiVersion='2.0'>"
            "<CoSimulation modelIdentifier='../../x'/></fmiModelDescription>",
            "no name of a library",
        ),
        (DOCUMENT.format(""), "no outputs"),
        (DOCUMENT.format(VARIABLES.replace("'10'", "'ten'")), "'ten', not a number"),
    ],
)
def test_wrong_files_are_refused(tmp_path, text, words):
    with pytest.raises(ModelError, match=words):
        model = catalogue.load(str(packed(tmp_path, text)))
        described(model, make(model))


def test_no_zip_and_no_file(tmp_path):
    (tmp_path / "x.fmu").write_text("text")
    with pytest.raises(ModelError, match="is not an FMU"):
        read_fmu(tmp_path / "x.fmu")
    with pytest.raises(ModelError, match="No such file"):
        catalogue.load(str(tmp_path / "missing.fmu"))


def test_another_file_has_another_digest(tmp_path):
    text = description("Backlash", MODELS["Backlash"], 2)
    first = catalogue.load(str(packed(tmp_path, text)))
    other = text.replace("stopTime='0.5'", "stopTime='0.6'")
    second = catalogue.load(str(packed(tmp_path, other, "n.fmu")))
    assert first.source_digest != second.source_digest
