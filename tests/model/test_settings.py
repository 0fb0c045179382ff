"""Settings of every kind: read as typed, checked, printed back."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import tolstat
from tests.model.rich import WRITTEN, Rich
from tolstat import Description
from tolstat.errors import ModelError, StudyError
from tolstat.model.setting_kinds import Number
from tolstat.model.settings import make, read, settings_of
from tolstat.study.study import load

LINKS_A = {name: {"nominal": "12 cm", "teeth": 20} for name in ("A1", "A2")}
LINKS_B = {name: {"nominal": "13 cm", "teeth": 20} for name in ("A1", "A2")}


def test_every_kind_is_read_in_its_unit():
    found = read(Rich(), WRITTEN)
    assert found.masses == pytest.approx((2.0, 0.5, 1.5)) and found.teeth == (
        17,
        31,
        90,
    )
    assert found.formula == "A1 - A2 - B" and found.hoop is False and found.order == 4
    assert found.speeds == pytest.approx((6.283185, 62.83185))
    assert found.links["A1"] == {"nominal": pytest.approx(0.12), "teeth": 20}
    assert found.size == (pytest.approx(0.785398), "rad", "deg")
    assert found.load == ({"time": 0.02, "moment": 1500.0},)
    assert found.extra == {"C": {"nominal": 0.005}}  # one column: no second level


def test_python_passes_si_values():
    found = make(Rich(), {"masses": [3, 4.0], "speeds": (1, 2), "teeth": 9})
    assert found.masses == (3.0, 4.0) and found.speeds == (1.0, 2.0)
    assert found.teeth == (9,)  # a single one stands for a list of one
    again = make(Rich(), vars(read(Rich(), WRITTEN)))
    assert again == read(Rich(), WRITTEN)


def test_settings_are_printed_as_a_study_has_them():
    declared = settings_of(Rich())
    for name in (
        "masses",
        "teeth",
        "formula",
        "hoop",
        "order",
        "law",
        "speeds",
        "size",
    ):
        kind, value = declared[name].kind, getattr(make(Rich()), name)
        words = kind.words(value)
        assert words and kind.allowed
        if name in ("formula", "law", "speeds", "size"):  # what is typed as a text
            assert kind.read(words)[:2] == value[:2]
        elif name in ("hoop", "order"):
            assert kind.read(tomllib.loads(f"x = {words}")["x"]) == value
    assert declared["masses"].kind.words((2.0, 1.0)) == "[2 kg, 1 kg]"
    assert declared["speeds"].kind.words(make(Rich()).speeds) == "10..100 rad/s"
    assert declared["links"].kind.words({"A1": {"nominal": 0.1, "teeth": 9}}) == (
        "{ A1 = { nominal = 0.1 m, teeth = 9 } }"
    )
    assert declared["extra"].kind.words({"C": {"nominal": 0.1}}) == "{ C = 0.1 m }"
    assert declared["hoop"].kind.words(True) == "true"


WRONG = [
    ({"masses": ["2 kg", "-1 kg"]}, "number 2: it must be above 0"),
    ({"masses": [2.0]}, 'number 1: a quantity with its unit is expected, "2.0 kg"'),
    ({"masses": []}, "0 numbers; 1 to 4 are expected"),
    ({"masses": ["1 kg"] * 5}, "5 numbers; 1 to 4"),
    ({"teeth": [17.5]}, "number 1: a whole number"),
    ({"formula": 3}, "a text is expected, in quotes"),
    ({"hoop": "yes"}, "true or false is expected, without quotes"),
    ({"order": 10}, "at most 9"),
    ({"order": True}, "a number is expected"),
    ({"law": "smoth"}, "did you mean 'smooth'"),
    ({"speeds": "600..60 rpm"}, "lower end of a range comes first"),
    ({"speeds": "10 rad/s"}, "a range such as"),
    ({"speeds": 10}, "a range is expected"),
    (
        {"links": {"A1": {"nominal": "1 s", "teeth": 9}}},
        "A1: nominal = '1 s': 's' is of",
    ),
    (
        {"links": {"A1": {"nominal": "1 m"}}},
        "A1: the key teeth is missing: of its wheel",
    ),
    ({"links": {"A1": {"nominal": "1 m", "tooth": 9}}}, "did you mean 'teeth'"),
    ({"links": {"A1": "1 m"}}, "A1: nominal, teeth are expected"),
    ({"links": ["A1"]}, "a table by name is expected"),
    ({"links": {"B": {"nominal": "1 m", "teeth": 9}}}, "the chain has no link A1"),
    ({"load": {"time": "1 s"}}, "a list of rows is expected"),
    ({"load": [{"time": "1 s", "moment": "2 N"}]}, "row 1: moment = '2 N'"),
    ({"lod": 1}, "did you mean 'load'"),
]


@pytest.mark.parametrize(("settings", "words"), WRONG)
def test_a_wrong_setting_is_refused_by_its_name(settings, words):
    study = {"model": "rich", "trials": 3, "seed": 1, "settings": settings}
    with pytest.raises(StudyError) as error:
        load(study, model=Rich())
    assert words in str(error.value) and "[settings]" in str(error.value)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"masses": "heavy"}, "number 1: a number is expected"),
        ({"speeds": (2, 1)}, "the lower end of a range comes first"),
        ({"speeds": 3}, "two numbers are expected"),
        ({"links": {"B": {"nominal": 1.0, "teeth": 9}}}, "no link A1"),
    ],
)
def test_a_wrong_setting_in_python_is_refused(settings, words):
    with pytest.raises(ModelError, match=words):
        tolstat.evaluate(Rich(), {}, settings)


def test_settings_determine_contributors_and_responses(tmp_path):
    study = {
        "model": "rich", "trials": 40, "seed": 1, "settings": WRITTEN,
        "deviations": {"A1": "+-50 um", "C": "+-0.01 mm"},
        "limits": {"frequency": ">= 5 Hz"},
    }  # fmt: skip
    run = tolstat.run(study, model=Rich(), output=tmp_path / "rich.h5")
    assert [each.name for each in run.contributors] == ["A1", "B", "C"]
    assert [r.name for r in run.responses if r.unit == "Hz"] == [
        "frequency_1", "frequency_2", "frequency_3",
    ]  # fmt: skip
    assert set(run.limits) == {"frequency_1", "frequency_2", "frequency_3"}
    words = {name: chosen.words for name, chosen in run.settings.items()}
    assert words["speeds"] == "60..600 rpm" and words["hoop"] == "false"
    assert words["masses"] == "[2 kg, 500 g, 1.5 kg]"
    assert words["links"].startswith("{ A1 = { nominal = 12 cm, teeth = 20 }")
    assert run.settings["law"].given and run.study.table["settings"] == WRITTEN
    # the study as a file would have it, and the same run from it
    path = tmp_path / "again.toml"
    path.write_text(run.study.text)
    again = tolstat.run(path, model=Rich())
    assert again.frame().equals(run.frame())


def test_a_list_or_a_table_can_be_swept(tmp_path):
    study = {
        "model": "rich", "sampling": "grid",
        "grid": {"masses": [["2 kg", "1 kg"], ["3 kg", "1 kg"]], "A1": ["0 mm", "0.1 mm"]},
    }  # fmt: skip
    run = tolstat.run(study, model=Rich(), output=tmp_path / "grid.h5")
    assert set(run.column("masses")) == {"[2 kg, 1 kg]", "[3 kg, 1 kg]"}
    assert len(set(run.column("frequency_1"))) == 4
    for index in range(4):
        assert tolstat.replay(run, index, Rich()).differences == ()
    study["grid"]["masses"][1] = ["3 kg"]
    with pytest.raises(StudyError, match="change which contributors or responses"):
        load(study, model=Rich())


class Doubled(Rich):
    """A contributor bears the name of a setting: its nominal value."""

    def describe(self, settings):
        contributors, responses = super().describe(settings)
        order = replace(contributors[0], name="order", unit="1")
        return Description((order, *contributors[1:]), responses)

    def evaluate(self, deviations, settings):
        outcome = super().evaluate(deviations, settings)
        return outcome._replace(responses=outcome.responses + settings.order)


def test_a_setting_that_bears_the_name_of_a_contributor_can_be_swept(tmp_path):
    study = {
        "model": "rich", "sampling": "grid",
        "grid": {"order": [1, 2, 5], "deviations": {"order": ["0 %", "0.001 %"]}},
    }  # fmt: skip
    run = tolstat.run(study, model=Doubled(), output=tmp_path / "doubled.h5")
    assert run.grid == ("settings.order", "order") and run.trials == 6
    assert list(run.frame().columns[:3]) == ["settings.order", "order", "A2"]
    assert run.column("settings.order").tolist() == [1, 1, 2, 2, 5, 5]
    np.testing.assert_allclose(np.diff(run.column("share")[::2]), [1.0, 3.0])
    for index in range(6):
        assert tolstat.replay(run, index, Doubled()).differences == ()
    study["settings"] = {"order": 3}
    with pytest.raises(StudyError, match=r"\[grid\] settings.order: is also in"):
        load(study, model=Doubled())
    study["grid"]["deviations"] = {"odrer": ["1 %"]}
    with pytest.raises(StudyError, match="did you mean 'order'"):
        load(study, model=Doubled())


@pytest.mark.parametrize(
    ("name", "values", "kind"),
    [
        ("hoop", [True, False], "U"),
        ("teeth", [[17, 28], [20, 31]], "U"),
        ("links", [LINKS_A, LINKS_B], "U"),
        ("order", [1, 2], "i"),
        ("law", ["smooth", "sudden"], "U"),
    ],
)
def test_every_swept_setting_is_simulated_again(tmp_path, name, values, kind):
    study = {"model": "rich", "sampling": "grid", "grid": {name: values}}
    run = tolstat.run(study, model=Rich(), output=tmp_path / "swept.h5")
    assert run.column(name).dtype.kind == kind and len(set(run.column(name))) == 2
    for index in range(2):
        assert tolstat.replay(run, index, Rich()).differences == ()


@pytest.mark.parametrize(
    ("unit", "value", "words"),
    [
        ("rad", math.radians(20), "20 deg"), ("rad", 0.0, "0 deg"), ("m", 0.0, "0 mm"),
        ("N/m", 4e8, "4e8 N/m"), ("N m/rad", 8e6, "8e6 N m/rad"), ("1/s", 1e-3, "0.001 1/s"),
        ("Pa", 2.1e11, "210 GPa"), ("N", 5e5, "500 kN"), ("", 1e-8, "1e-8"),
        ("1", 0.3, "0.3"), ("rad/s", 850 * math.pi / 30, "850 rpm"),
    ],
)  # fmt: skip
def test_defaults_and_bounds_are_in_readable_units(unit, value, words):
    number = Number(unit, at_most=value)
    assert number.words(value) == words and number.allowed.endswith(words)
    with pytest.raises(ModelError, match=f"at most {re.escape(words)}$"):
        number.checked(2 * value + 1)


def test_a_number_typed_with_a_unit_it_has_not_is_explained():
    study = {"model": "ring", "trials": 1, "seed": 1, "settings": {"feed": "0.1 mm"}}
    with pytest.raises(StudyError) as refused:
        load(study)
    assert str(refused.value).endswith(
        '[settings] feed = "0.1 mm": a number is expected, without quotes and unit '
        "(feed S, mm per turn of the ring)"
    )
