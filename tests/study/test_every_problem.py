"""No problem of a study hides another, and a text of two things says what to type."""

import pytest

from tests.study.chains import CHAIN, problems_of
from tolstat.study.drawing_text import separated
from tolstat.study.settings_section import link_tables

ONE = {"model": "dimension_chain", "links": {"A": "1 mm"}}
STAND = {"model": "stand", "trials": 8, "seed": 1}


@pytest.mark.parametrize(
    ("text", "both"),
    [
        ("10 +-0.1 mm", ("10 mm", "+-0.1 mm")),
        ("10 mm +-0.1 mm", ("10 mm", "+-0.1 mm")),
        ("10 mm ±0.1", ("10 mm", "±0.1 mm")),
        ("10 mm +-100 um", ("10 mm", "+-100 um")),
        ("10 +0.2/-0.1 mm", ("10 mm", "+0.2/-0.1 mm")),
        ("10 mm (+0.2 / -0.1)", ("10 mm", "+0.2 / -0.1 mm")),
        ("10 +0.2 -0.1 mm", ("10 mm", "+0.2/-0.1 mm")),
        ("10,5 ±0,1 mm", ("10.5 mm", "±0.1 mm")),
        ("10 0/-0.1 mm", ("10 mm", "0/-0.1 mm")),
        ("10 -0.1..+0.3 mm", ("10 mm", "-0.1..+0.3 mm")),
        ("Ø10 H7", ("10", "H7")), ("10 mm h7", ("10 mm", "h7")),
        ("Ø30 g6 mm", ("30 mm", "g6")), ("30 H7 / g6 mm", ("30 mm", "H7/g6")),
        ("10 H7 (+0.015/0) mm", ("10 mm", "H7 (+0.015/0)")),
        ("10 mm H7 (+0.015/0)", ("10 mm", "H7 (+0.015/0)")),
        ("10 mm ISO 2768-m", ("10 mm", "ISO 2768-m")),
        ("10 ISO 2768-m radius mm", ("10 mm", "ISO 2768-m radius")),
        ("100 +-5 %", ("100", "+-5 %")), ("45 deg +-1 deg", ("45 deg", "+-1 deg")),
        ("1 kN +-5 %", ("1 kN", "+-5 %")),
    ],
)  # fmt: skip
def test_a_size_and_a_tolerance_are_told_apart(text, both):
    assert separated(text) == both


@pytest.mark.parametrize(
    "text", ["10 mm", "+-0.1 mm", "0..60 um", "-0.1..+0.3 mm", "IT7", "h7", "10 m/s^2",
             "-3 N", "1e-3 mm", "50", "10 furlong", "A - B", "",
             # one deviation is no tolerance, and a zero of the size is none either
             "10 -0.05 mm", "100 +0.2 mm", "20 +1e-1 mm", "90 -0.5 deg", "25 +0.05 mm"],
)  # fmt: skip
def test_other_texts_hold_one_thing(text):
    assert separated(text) is None


@pytest.mark.parametrize(
    ("link", "tables"),
    [
        ("2 mm", {"a": {"nominal": "2 mm"}}),
        (2, {"a": {"nominal": 2}}),
        ("25 +0.1/-0.05 mm", {"a": {"nominal": "25 mm", "tolerance": "+0.1/-0.05 mm"}}),
        (
            {"nominal": "25 +-0.1 mm", "cp": 1.33},
            {"a": {"nominal": "25 mm", "tolerance": "+-0.1 mm", "cp": 1.33}},
        ),
        (
            "30 H7/g6 mm",
            {"a_hole": {"nominal": "30 mm", "tolerance": "H7"},
             "a_shaft": {"nominal": "30 mm", "tolerance": "g6"}},
        ),
        (
            {"nominal": "30 mm", "tolerance": "H7/g6", "cp": 1.33},
            {"a_hole": {"nominal": "30 mm", "tolerance": "H7", "cp": 1.33},
             "a_shaft": {"nominal": "30 mm", "tolerance": "g6", "cp": 1.33}},
        ),
    ],
)  # fmt: skip
def test_a_link_in_one_text_is_a_table(link, tables):
    assert link_tables({"a": link}) == tables


@pytest.mark.parametrize(
    ("links", "words"),
    [
        (
            {"A": {"nominal": "9 mm", "tolerance": "9 +-0.1 mm"}},
            'a tolerance has no size; write { nominal = "9 mm", tolerance = "+-0.1 mm"',
        ),
        (
            {"A": {"nominal": "9 +-0.1 mm", "tolerance": "+-0.2 mm"}},
            "nominal holds a tolerance, too; give one of them",
        ),
        ({"A": "30 g6/H7 mm"}, "'g6/H7': a fit is a hole and a shaft, such as H7/g6"),
        ({"A": "30 H7/G6 mm"}, "'H7/G6': a fit is a hole and a shaft"),
        (
            {"A": "30 H7/g6 mm", "A_hole": "3 mm"},
            "a fit is two links, A_hole and A_shaft; A_hole is given twice",
        ),
        ({"A": "1,200 +-0.1 mm"}, "'1,200' may be 1.200 or 1200"),
        ({"A": "H7/g6"}, "cannot be read"),
        ({"A": "30 H7"}, "unit"),
        ({"A": {"tolerance": "H7/g6"}}, "the key nominal is missing"),
    ],
)
def test_a_link_that_holds_too_much_or_too_little(links, words):
    study = {**CHAIN, "settings": {"gap": "A - B"}, "links": {**links, "B": "1 mm"}}
    assert words in problems_of(study)


def test_a_deviation_with_a_size_says_what_to_type():
    said = problems_of({**STAND, "deviations": {"rod_length": "2450 +-1 mm"}})
    assert '[deviations] rod_length = "2450 +-1 mm": a deviation has no size' in said
    assert 'write "+-1 mm"' in said


def test_a_link_that_cannot_be_read_quotes_no_other():
    links = {"A": "ten mm", "B": "9 mm", "C": "9 mmm"}
    said = problems_of({**CHAIN, "settings": {"gap": "A - B"}, "links": links})
    assert '[links] A = "ten mm": ' in said and '[links] C = "9 mmm": ' in said
    assert "[links] B" not in said and "[settings]" not in said


REST = {
    "deviations": {
        "rod_length": "+-1 mmm",
        "crank_angle": {"tolerance": "+-1 mm", "distribution": "rectangular"},
        "crank_radius": {"tolerance": "+-1 mm", "std": 3},
    },
    "limits": {"yaw": "3 mrad", "rod_force": {"limit": "<= 3 kN", "cpk": 2}},
}
SAID = ["unknown unit 'mmm'", "'uniform'", "no key std", '[limits] yaw = "3 mrad"',
        "no key cpk"]  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "own"),
    [
        ({"model": "stnad"}, "did you mean 'stand'"),
        ({"modle": "stand", "model": None}, "model: missing"),
        ({"settings": {"cycles": 0}}, "[settings] cycles"),
        ({"settings": {"crank_sped": "7 rad/s"}}, "[settings] crank_sped"),
        ({"settings": "none"}, 'settings = "none"'),
        ({"links": {"A": True}}, "[links] A"),
        (
            {**ONE, "settings": {"gap": "A - "}},
            "formula such as",
        ),
        (
            {**ONE, "settings": {"gap": "A - C"}},
            "[links] has no C",
        ),
        (ONE, "gap is missing"),
    ],
)  # fmt: skip
def test_what_is_wrong_elsewhere_is_said_at_once(wrong, own):
    study = {k: v for k, v in {**STAND, **REST, **wrong}.items() if v is not None}
    said = problems_of(study)
    assert [each for each in [own, *SAID] if said.count(each) != 1] == []


def test_what_needs_the_model_is_no_problem_while_that_is_wrong():
    """Grades, data, batches and gears: right, or not known to be wrong."""
    study = {**STAND, "model": "stnad", "limits": {"yaw": "<= 3 mrad"}}
    study["deviations"] = {
        "rod_length": {"tolerance": "IT7", "common": True}, "friction": "+-5 %",
        "runout_7": {"iso1328": 7, "module": "12 mm"}, "crank_radius": "h7",
        "m": {"data": "none.csv", "column": "m"}, "phase": "+-180 deg",
        "k": {"distribution": "constant", "value": "3 N/mm"},
    }  # fmt: skip
    assert problems_of(study).count("\n") == 1


@pytest.mark.parametrize("limit", [">= 0", "<= 3", {"limit": "0..1", "ppm": 100}])
@pytest.mark.parametrize("broken", [{"A": "10 +-0.1 mmm"}, {"B": "ten"}])
def test_no_unit_is_claimed_of_a_response_that_is_not_known(limit, broken):
    study = {**CHAIN, "settings": {"gap": "A - B"}, "limits": {"gapp": limit}}
    said = problems_of({**study, "links": {"A": "10 mm", "B": "9 mm", **broken}})
    assert "gapp" not in said and "unit is missing" not in said
    wrong = {"gapp": ">= zero mm"}
    said = problems_of({**study, "limits": wrong, "links": {"A": "10 mm", **broken}})
    assert "[limits] gapp" in said
