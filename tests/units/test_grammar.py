"""Quantities as people write them, right and wrong."""

from __future__ import annotations

import math

import pint
import pytest

from tolstat.errors import UnitError
from tolstat.units.conversion import MEANINGS, dimension, from_si, si_unit, to_si
from tolstat.units.grammar import limit, measure, plain, quantity, tolerance

RIGHT = [
    (quantity, "7.5 rad/s", "rad/s", 7.5),
    (quantity, "60 rpm", "rad/s", 2 * math.pi),
    (quantity, "180 deg/s", "rad/s", math.pi),
    (quantity, "7.5rad/s", "rad/s", 7.5),
    (quantity, "-1.5e-3 m", "m", -1.5e-3),
    (quantity, "1 ms", "s", 1e-3),
    (quantity, "8e6 N m/rad", "N m/rad", 8e6),
    (quantity, "8 kN*m/rad", "N m/rad", 8e3),
    (quantity, "30 deg", "rad", math.pi / 6),
    (quantity, "12 %", "1", 0.12),
    # as pint has them
    (quantity, "20 degC", "K", 20.0),
    (quantity, "20 °C", "K", 20.0),
    (quantity, "3 lb", "kg", 1.36077711),
    (quantity, "20 mg", "kg", 2e-5),
    (quantity, "3 lbf", "N", 13.3446648457815),
    (quantity, "100 psi", "Pa", 689475.7293168361),
    (quantity, "2 bar", "Pa", 2e5),
    (quantity, "2 ft", "m", 0.6096),
    (quantity, "5 mil", "m", 1.27e-4),
    (quantity, "5 thou", "m", 1.27e-4),
    (quantity, "2 MHz", "Hz", 2e6),
    (quantity, "2 GHz", "Hz", 2e9),
    (quantity, "4.7 kΩ", "ohm", 4.7e3),
    (quantity, "10 V/A", "ohm", 10.0),
    (quantity, "2 pF", "F", 2e-12),
    (quantity, "2 uH", "H", 2e-6),
    (quantity, "3 V A", "W", 3.0),
    (quantity, "6 ohm F", "s", 6.0),
    (quantity, "0.12", "1", 0.12),
    (tolerance, "+-1.2 mm", "m", (-1.2e-3, 1.2e-3)),
    (tolerance, "±1.2 mm", "m", (-1.2e-3, 1.2e-3)),
    (tolerance, "+/-1.2 mm", "m", (-1.2e-3, 1.2e-3)),
    (tolerance, "-0.1..+0.3 mm", "m", (-1e-4, 3e-4)),
    (tolerance, "0 .. 60 µm", "m", (0.0, 60e-6)),
    (tolerance, "+0.1/-0.05 mm", "m", (-5e-5, 1e-4)),
    (tolerance, "0/-0.02 mm", "m", (-2e-5, 0.0)),
    (tolerance, "+0/-0.02 mm", "m", (-2e-5, 0.0)),
    (tolerance, "-0.03 / -0.01 mm", "m", (-3e-5, -1e-5)),
    (tolerance, "-20…50 um", "m", (-2e-5, 5e-5)),
    (tolerance, "±0,1 mm", "m", (-1e-4, 1e-4)),
    (tolerance, "+0,021/0 mm", "m", (0.0, 2.1e-5)),  # none writes 0,021 for 21
    (tolerance, "0,1..0,3 mm", "m", (1e-4, 3e-4)),
    (quantity, "1,2 mm", "m", 1.2e-3),
    (tolerance, "0..360 deg", "rad", (0.0, 2 * math.pi)),
    (tolerance, "+-10 %", "1", (-0.1, 0.1)),
    (limit, "<= 3 %", "1", (-math.inf, 0.03)),
    (limit, ">= 0 mm", "m", (0.0, math.inf)),
    (limit, "1..2 mm", "m", (1e-3, 2e-3)),
    (limit, "<= 180 kN", "N", (-math.inf, 180e3)),
]

WRONG = [
    (quantity, "7.5 Hz", "rad/s", "rpm"),
    (quantity, "72/min", "rad/s", "rpm"),
    (quantity, "72 1/min", "rad/s", "rpm"),
    (quantity, "7.5", "rad/s", "unit is missing"),
    (quantity, "1.57", "rad", "unit is missing"),
    (quantity, "3 kg", "m", "another kind"),
    (quantity, "1,200 mm", "m", "'1,200' may be 1.200 or 1200"),
    (quantity, "1,200,000 mm", "m", "thousands are not separated"),
    (quantity, "1.200,5 mm", "m", "thousands are not separated"),
    (quantity, "1e999 m", "m", "1e999 is too large"),
    (quantity, "nan m", "m", "cannot be read"),
    (quantity, "inf m", "m", "cannot be read"),
    (quantity, "9**9**9", "1", "cannot be read"),
    (quantity, "5 m^9", "m", "cannot be read"),
    (quantity, "5 furlong", "m", "unknown unit"),
    (quantity, "5 kNm", "N m", "did you mean"),
    (quantity, "5 degF", "K", "unknown unit 'degF'"),
    (quantity, "5 lb", "N", "another kind"),
    (quantity, "5 N/", "N", "the unit 'N/' cannot be read"),
    (quantity, "", "m", "cannot be read"),
    (quantity, "1 __import__('os')", "m", "cannot be read|unknown"),
    (tolerance, "+--1.2 mm", "m", "not negative"),
    (tolerance, "+-0 mm", "m", "width"),
    (tolerance, "0.3..-0.1 mm", "m", "lower end comes first"),
    (tolerance, "1.2 mm", "m", "a tolerance such as"),
    (tolerance, "0.1..0.05 mm", "m", 'a sign is missing, write "-0.1..0.05 mm"'),
    (tolerance, "0..0 mm", "m", "first; leave"),
    (tolerance, "+-1.2", "m", "unit is missing"),
    (tolerance, "+-90", "rad", "unit is missing"),
    (tolerance, "IT7", "m", "cannot be read"),
    (tolerance, "0.1/0.2 mm", "m", "cannot be read"),
    (tolerance, "0/0 mm", "m", "width"),
    (limit, "+0.1/-0.2 mm", "m", "a limit such as"),
    (quantity, "0/-0.2 mm", "m", "a quantity such as"),
    (limit, "2..1 mm", "m", "lower end of a range comes first"),
    (limit, "3 %", "1", "a limit such as"),
    (limit, "< 3 %", "1", "a limit such as"),
    (limit, "<= 3 kN", "1", "plain number"),
    (limit, "0,5..1.250 mm", "m", "'1.250' beside a decimal comma may be 1.250 or"),
    (tolerance, "+1.250/-0,5 mm", "m", "'1.250' beside a decimal comma may be 1.250"),
]


@pytest.mark.parametrize(("read", "text", "unit", "value"), RIGHT)
def test_right_quantities(read, text, unit, value):
    assert read(text, unit) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(("read", "text", "unit", "words"), WRONG)
def test_wrong_quantities(read, text, unit, words):
    with pytest.raises(UnitError, match=words):
        read(text, unit)


def test_units_are_those_of_pint():
    registry = pint.UnitRegistry()
    others = {"1", "count", "%", "ppm", "rpm", "degC", "mil"}  # a mil is an angle there
    for name in MEANINGS.keys() - others:
        known = registry.Quantity(1.0, name).to_base_units().magnitude
        value = to_si(1.0, name, si_unit(dimension(name)))
        assert value == pytest.approx(known, rel=1e-12), name


@pytest.mark.parametrize(
    ("typed", "unit"),
    [
        ("3 N/mm", "N/m"), ("3 kN m/rad", "N m/rad"), ("3 kg/s^2", "N/m"),
        ("2 N s/m", "N s/m"), ("1 m/s", "m/s"), ("1 V/A", "ohm"), ("1 W/K", "W/K"),
    ],
)  # fmt: skip
def test_a_product_of_units_has_the_name_that_people_use(typed, unit):
    assert measure(typed).unit == unit


def test_printed_quantities_are_read_back():
    for unit, shown in (("N", "kN"), ("rad", "mrad"), ("1", "%"), ("N m", "kN m")):
        assert from_si(quantity(f"3.7 {shown}", unit), unit, shown) == pytest.approx(
            3.7
        )


@pytest.mark.parametrize("text", [".0065...0135 in", ".0065..0135 in", ".2...6 mm"])
def test_dots_that_may_hold_a_decimal_point_are_refused(text):
    with pytest.raises(UnitError, match=r"may end at \d+ or at \.\d+; write '"):
        plain(text)


@pytest.mark.parametrize(
    ("text", "read"),
    [("0.2...0.6 mm", "0.2..0.6 mm"), ("10...20 mm", "10..20 mm"),
     (".2..6 mm", ".2..6 mm"), (".5...7.5 mm", ".5..7.5 mm"), ("0..10", "0..10")],
)  # fmt: skip
def test_three_dots_are_two(text, read):
    assert plain(text) == read
