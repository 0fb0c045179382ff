"""Costs of entries, and a study written with other tolerances."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from tolstat.deviations.spread import half_of
from tolstat.errors import StudyError
from tolstat.study.study import load

STUDY = {"model": "stand", "trials": 8, "seed": 1}


def study_of(cost, name="rod_length", **line):
    line = {"tolerance": "+-1.2 mm", **line, "cost": cost}
    return {**STUDY, "deviations": {name: line}}


def priced(cost, name="rod_length", **line):
    (found,) = load(study_of(cost, name, **line)).deviating.priced
    return found


def test_a_reciprocal_price_is_of_each_part():
    found = priced({"law": "reciprocal", "at": "+-0.6 mm", "price": 20})
    assert found.cost(found.specified_choice) == pytest.approx(2 * 10)
    assert found.cost(math.log(0.3e-3)) == pytest.approx(2 * 40)
    # from a quarter to twice as drawn where nothing is said
    assert np.exp(found.ends) == pytest.approx([0.3e-3, 2.4e-3])


def test_a_price_with_a_fixed_part_and_an_exponent():
    """A + B / T^k of A = 4, k = 2, and 10 at 0.6 mm."""
    law = {"law": "reciprocal", "at": "+-0.6 mm", "price": 10}
    found = priced(law | {"fixed": 4, "exponent": 2})
    assert found.cost(math.log(0.6e-3)) == pytest.approx(2 * 10)
    assert found.cost(math.log(0.3e-3)) == pytest.approx(2 * (4 + 6 * 4))
    assert found.cost(math.log(1.2e-3)) == pytest.approx(2 * (4 + 6 / 4))


def test_an_exponential_price_is_e_times_as_much_for_each_rate():
    law = {"law": "exponential", "at": "+-1.2 mm", "price": 5, "rate": "0.5 mm"}
    found = priced(law | {"tightest": "+-0.2 mm", "loosest": "+-3 mm"})
    assert found.cost(found.specified_choice) == pytest.approx(2 * 5)
    assert found.cost(math.log(0.7e-3)) == pytest.approx(2 * 5 * math.e)
    assert np.exp(found.ends) == pytest.approx([0.2e-3, 3e-3])


def test_grades_and_tolerances_that_are_offered():
    found = priced({"IT10": 4, "IT9": 7, "+-1.2 mm": 1}, tolerance="IT10", size="2 m")
    assert [each.words for each in found.offered] == ["+-1.2 mm", "IT10", "IT9"]
    assert found.specified_choice == 1.0 and found.cost(1.0) == 2 * 4
    assert half_of(found.distributions(2.0)) == pytest.approx(
        0.5 * 370e-6
    )  # IT9 of 2 m


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ({"tolerance": "+-1.2 mm"}, "+-0.876 mm"),
        ({"tolerance": "-0.1..0.3 cm"}, "-0.046..0.246 cm"),
        ({"tolerance": "0..60 um", "distribution": "uniform"}, "8.1..51.9 um"),
    ],
)
def test_a_tolerance_is_written_in_its_notation_and_no_wider(line, words):
    """About its middle, so that the mean of its parts stays."""
    law = {"law": "reciprocal", "at": "+-1 mm", "price": 20}
    found = priced(law, **line)
    assert found.text(found.specified_choice) == line["tolerance"]
    assert found.text(found.specified_choice + math.log(0.7304)) == words


@pytest.mark.parametrize(
    ("tolerance", "ratio", "words"),
    [
        ("1..1.0004 mm", 0.5, "1.0001..1.0003 mm"),
        ("1..1.1003 mm", 0.6, "1.0201..1.0802 mm"),
        ("1.0037..1.1003 mm", 0.6, "1.0231..1.0809 mm"),
        ("-1.1003..-1.00371 mm", 0.6, "-1.0809..-1.0231 mm"),
        ("999.99951..1000 mm", 0.5, "999.999633..999.999877 mm"),
        ("+-123.456 um", 1.5, "+-185 um"),
        ("+-0.00012 mm", 0.5, "+-0.00006 mm"),
        ("+-0.1009 mm", 1.0, "+-0.1009 mm"),
        ("+-1.12345 mm", 0.2500001, "+-0.2808626 mm"),
        ("+-1.12345 mm", 0.2515, "+-0.282 mm"),
    ],
)
def test_figures_follow_the_width_and_ends_do_not_widen(tolerance, ratio, words):
    law = {"law": "reciprocal", "at": "+-1 mm", "price": 20}
    found = priced(law, tolerance=tolerance, distribution="uniform")
    written = found.text(found.specified_choice + math.log(ratio))
    assert written == words
    again = priced(law, tolerance=written, distribution="uniform")
    (was, *_), (now, *_) = found.specified.values(), again.specified.values()
    if ratio < 1:
        least, most = was.tolerance
        assert least - 1e-15 <= now.tolerance[0] < now.tolerance[1] <= most + 1e-15
    assert found.law.tightest * (1 - 1e-9) <= half_of(again.specified)


def test_an_unchanged_entry_keeps_its_text():
    law = {"law": "reciprocal", "at": "+-1 mm", "price": 20}
    found = priced(law, tolerance="IT10", size="2 m")
    assert found.text(found.specified_choice) == "IT10"
    assert found.text(found.specified_choice - 0.01) == "+-0.297 mm"


def test_a_study_with_other_tolerances_is_the_same_except_for_them():
    given = study_of({"IT10": 4, "+-1.2 mm": 1}, tolerance="IT10", size="2 m", cp=1.33)
    study = load(given)
    editor = study.editor()
    editor.change("rod_length", "+-1.2 mm")
    line = tomllib.loads(editor.text)["deviations"]["rod_length"]
    assert line == {
        "tolerance": "+-1.2 mm",
        "cp": 1.33,
        "cost": {"IT10": 4, "+-1.2 mm": 1},
    }
    (found,) = load(tomllib.loads(editor.text)).deviating.priced
    assert found.specified_choice == 0.0
    editor.change("rod_length", "IT10")
    assert "size" not in tomllib.loads(editor.text)["deviations"]["rod_length"]


def test_a_cost_does_not_change_a_run():
    given = study_of({"+-1.2 mm": 1, "+-0.6 mm": 5})
    bare = {**given, "deviations": {"rod_length": "+-1.2 mm"}}
    costly, free = load(given), load(bare)
    assert np.array_equal(costly.deviations(), free.deviations())
    assert replace(costly.deviating, priced=[]) == free.deviating


LAW = {"law": "reciprocal", "at": "+-1 mm", "price": 1}


@pytest.mark.parametrize(
    ("cost", "words"),
    [
        (3, "a table is expected"),
        ({}, "a table is expected"),
        (LAW | {"fixed": 1}, "fixed: it is a part of price, and less"),
        (LAW | {"exponent": 0}, "expected a number such as exponent = 2"),
        (
            LAW | {"law": "exponential", "rate": "1 mm", "exponent": 2},
            "exponent: it is of the reciprocal law",
        ),
        ({"law": "linear"}, "allowed: reciprocal, exponential"),
        ({"law": "reciprocal", "at": "+-1 mm"}, "the key price is missing"),
        (LAW | {"prise": 1}, "did you mean 'price'?"),
        (LAW | {"rate": "1 mm"}, "has no key rate"),
        (LAW | {"law": "exponential"}, "the key rate is missing"),
        (LAW | {"law": "exponential", "rate": "1 um"}, "give a larger rate"),
        (LAW | {"law": "exponential", "rate": "-1 mm"}, "above zero is expected"),
        (LAW | {"price": 0}, "price = 0: expected a number above 0"),
        (LAW | {"price": "10 EUR"}, 'price = "10 EUR": expected a number above 0'),
        (LAW | {"at": "+-1 deg"}, "deg"),
        (LAW | {"at": 1}, "a tolerance such as"),
        (LAW | {"at": "0.6 mm"}, 'cost, at = "0.6 mm": cannot be read'),
        (LAW | {"loosest": "+-1 mm"}, "does not lie between"),
        (LAW | {"loosest": "+-1 km"}, "no run covers both"),
        (LAW | {"law": ["reciprocal"]}, "mean 'reciprocal'"),
        (LAW | {"tightest": "+-3 mm"}, "tightest must be tighter than loosest"),
        ({"+-1.2 mm": 1, "IT99": 2}, "IT99"),
        ({"+-1.2 mm": 1, "+-120e-2 mm": 2}, "are the same"),
        ({"+-1 mm": 1, "+-0.5 mm": 2}, "of the entry has no price"),
        ({"+-1.2 mm": -1}, "a price is a number"),
        ({"+-1.2 mm": 3, "+-1 mm": 2}, '"+-1.2 mm" = 3 is looser than "+-1 mm" = 2'),
        ({"+-1.2 mm": 1, "0.6 mm": 2}, "a tolerance such as"),
        ({"shift": 3}, "shift = 3: expected the permitted shifts, such as"),
        ({"shift_price": 3}, 'cost, shift = ""'),
        ({"shift": "0.2 mm"}, 'cost, shift = "0.2 mm": cannot be read'),
        ({"shift": "+-1 deg"}, "deg"),
        ({"shift": "0.1..0.2 mm"}, "a range around 0 is expected"),
        ({"shift": "+-1 mm", "shift_price": 3}, 'to one side, such as "-0.2..0 mm"'),
        ({"shift": "0..1 mm", "shift_price": -3}, "a number from 0, such as 5"),
        ({"shift": "+-1 mm", "tightest": "+-1 mm"}, "no law is given"),
        (LAW | {"shfit": "+-1 mm"}, "did you mean 'shift'?"),
        ({"+-1.2 mm": 1, "shfit": "+-1 mm"}, "other keys: shift, shift_price, law"),
    ],
)  # fmt: skip
def test_costs_that_are_refused(cost, words):
    with pytest.raises(StudyError) as refused:
        load(study_of(cost))
    assert "[deviations] rod_length = " in str(refused.value)
    assert words in str(refused.value)


def test_entries_without_tolerance_have_no_cost():
    value = {"distribution": "constant", "value": "1 mm", "cost": {"IT9": 1}}
    with pytest.raises(StudyError, match="cost needs a tolerance"):
        load({**STUDY, "deviations": {"rod_length": value}})
