"""Notations of drawings, handbooks, CAD and word processors: read right, or refused.

A refused one names what is wrong and, where it can, what to type.
"""

from __future__ import annotations

import math

import pytest

from tests.conftest import ROOT
from tests.study.chains import chain, problems_of
from tolstat.deviations.spread import spread_of
from tolstat.errors import TolstatError
from tolstat.study.study import load
from tolstat.units.grammar import limit, quantity, quantity_range, tolerance

MM, INCH, DEG, MINUTE = 1e-3, 25.4e-3, math.pi / 180, math.pi / 10800

# text of a link: nominal value, lower and upper deviation, and their unit
READ = {
    "25 +0.1/-0.05 mm": (25, -0.05, 0.1, MM),
    "25 +0,1/−0,05 mm": (25, -0.05, 0.1, MM),  # U+2212
    "25 –0.05/–0.10 mm": (25, -0.1, -0.05, MM),  # en dashes
    "25 ‐0.05/‐0.10 mm": (25, -0.1, -0.05, MM),  # U+2010
    "25 ＋0.1/－0.05 mm": (25, -0.05, 0.1, MM),  # of full width
    "25 + 0.1 / - 0.05 mm": (25, -0.05, 0.1, MM),
    "25 +0.1 −0.05 mm": (25, -0.05, 0.1, MM),
    "25 +.1/-.05 mm": (25, -0.05, 0.1, MM),
    "25 mm +0.1 mm/-0.05 mm": (25, -0.05, 0.1, MM),
    "25 +0.1mm/-0.05mm": (25, -0.05, 0.1, MM),
    "25 0 -0.1 mm": (25, -0.1, 0, MM),
    "25 +0/-0.1 mm": (25, -0.1, 0, MM),
    "25 +0.3/+0.1 mm": (25, 0.1, 0.3, MM),
    "25 ±0.1mm": (25, -0.1, 0.1, MM),
    "25 %%p0.1 mm": (25, -0.1, 0.1, MM),  # of AutoCAD
    "25\u202f±\u202f0,1\u202fmm": (25, -0.1, 0.1, MM),
    "25\u00a0±\u00a00,1\u00a0mm": (25, -0.1, 0.1, MM),
    "25 mm ± 50 µm": (25, -0.05, 0.05, MM),  # U+00B5
    "25 mm ± 50 μm": (25, -0.05, 0.05, MM),  # U+03BC
    "25 mm ±0.4 %": (25, -0.1, 0.1, MM),
    "−5 ±0.1 mm": (-5, -0.1, 0.1, MM),
    "R5 ±0.2 mm": (5, -0.2, 0.2, MM),
    "SØ10 ±0.05 mm": (10, -0.05, 0.05, MM),
    "□25 ±0.1 mm": (25, -0.1, 0.1, MM),
    "24.98-25.02 mm": (25, -0.02, 0.02, MM),
    "24.98–25.02 mm": (25, -0.02, 0.02, MM),
    "24.98 mm – 25.02 mm": (25, -0.02, 0.02, MM),
    "24.98…25.02 mm": (25, -0.02, 0.02, MM),
    "24.98...25.02 mm": (25, -0.02, 0.02, MM),
    "25.00/24.98 mm": (24.99, -0.01, 0.01, MM),
    "Ø25 h6 mm": (25, -0.013, 0, MM), "⌀25 h6 mm": (25, -0.013, 0, MM),
    "∅25 h6 mm": (25, -0.013, 0, MM), "φ25 h6 mm": (25, -0.013, 0, MM),
    "%%c25 h6 mm": (25, -0.013, 0, MM), "25h6mm": (25, -0.013, 0, MM),
    "30 H7 (+0.021/0) mm": (30, 0, 0.021, MM),
    "30 H7 +0.021/0 mm": (30, 0, 0.021, MM),
    "30 h6 (0 −0,013) mm": (30, -0.013, 0, MM),
    "30 mm IT7": (30, -0.0105, 0.0105, MM),
    "10 mm ISO 2768-mK": (10, -0.2, 0.2, MM),
    "10 mm DIN ISO 2768-mK": (10, -0.2, 0.2, MM),
    "10 mm ISO 2768 – m": (10, -0.2, 0.2, MM),
    "10 mm ISO 2768‑mK‑E": (10, -0.2, 0.2, MM),  # U+2011
    "10 ISO 2768-1:1989-m mm": (10, -0.2, 0.2, MM),
    "1.250 +.002/-.001 in": (1.25, -0.001, 0.002, INCH),
    "DIA. 1.250 ±.005 in": (1.25, -0.005, 0.005, INCH),
    "30°±0.5°": (30, -0.5, 0.5, DEG), "30º ±1º": (30, -1, 1, DEG),
    "30° +1°/-0.5°": (30, -0.5, 1, DEG), "30° +1°/0": (30, 0, 1, DEG),
    "30°±30'": (1800, -30, 30, MINUTE), "45°30′ ±15′": (2730, -15, 15, MINUTE),
    "30°±0°30'": (1800, -30, 30, MINUTE),
    "45° 30' 15\" ±15'": (2730.25, -15, 15, MINUTE),
    "11.5·10⁻⁶ 1/K ±5 %": (11.5e-6, -0.575e-6, 0.575e-6, 1),
    "210 kN/mm² ±5 %": (210e9, -10.5e9, 10.5e9, 1),
    "20 °C ±5 K": (20, -5, 5, 1), "20..60 K": (40, -20, 20, 1),
}  # fmt: skip

REFUSED = {
    "Ø25 h6": 'the unit is missing; write "Ø25 h6 mm"',
    "R5 ±0.2": 'the unit is missing; write "R5 ±0.2 mm"',
    "1.250 ±0,05 mm": "'1.250' beside a decimal comma may be 1.250 or 1250",
    "25+0.1-0.05 mm": 'stroke between them; write "25 +0.1/-0.05 mm"',
    "25 −0.02−0.05 mm": 'stroke between them; write "25 -0.02/-0.05 mm"',
    "25 +0.1|-0.05 mm": 'stroke between them; write "25 +0.1/-0.05 mm"',
    "1×45°": 'a chamfer has a height; write "1 mm"',
    "20 °F ±5 °F": "Fahrenheit is not read",
    "1-3/4 in": 'fractions are not read; write "1.75 in"',
    "5-1/2 in ±0.01 in": 'fractions are not read; write "5.5 in ±0.01 in"',
    "25 +0.1 mm": 'one deviation is typed; write both, such as "25 +0.1/0 mm"',
    "25 −0,05 mm": 'one deviation is typed; write both, such as "25 0/-0.05 mm"',
    "25.02-24.98 mm": "the smaller of two limits of size comes first",
    "25 +0.1 mm/-50 um": "one end is in mm, the other in um; give both in one",
    "3x Ø6 H7 mm": '3x counts features, and a link is one; write "Ø6 H7 mm"',
    "3× Ø6 H7 mm": '3x counts features, and a link is one; write "Ø6 H7 mm"',
    "3x6 mm": 'write "6 mm", or "3 x6 mm"',
    "30 H7-g6 mm": 'a fit is a hole and a shaft; write "30 H7/g6 mm"',
    "30 H7 g6 mm": 'a fit is a hole and a shaft; write "30 H7/g6 mm"',
    "30 H7 (+0,021) mm": 'limits behind a grade are two; write "H7 (+0.021/0)"',
    "R20 ISO 2768-m mm": "ISO 2768-1 has two tables of radii",
    "10 mm DIN 7168-m": "cannot be read; write a size and its tolerance as",
    "1/2 in": 'a fraction or two limits of size; write "0.5 in", or "1..2 in"',
    "1 1/2 in": 'fractions are not read; write "1.5 in"',
    '1.250" ±.005"': '" may be in or arcsec; write one of these in its place',
    "15' ±5'": "' may be ft or arcmin",
    "M8x1.25 mm": "a thread is no size; write the diameter that decides",
    "25 mm max": 'max gives no zone; write both ends, such as "24.9..25 mm"',
    "≤ 25 mm": "<= gives no zone; write both ends",
    "(25) mm": 'a size stands without brackets; write "25 mm"',
    "25 ± 0.4 % mm": "cannot be read; write a size and its tolerance as",
    "25 ±0.1 mm Cpk 1.33": "cannot be read; write a size and its tolerance as",
    "25 +-0.1/-0.2 mm": "cannot be read; write a size and its tolerance as",
    "1 250 ±0.5 mm": "thousands are not separated; write 1250",
    "1’250 ±0.5 mm": "thousands are not separated; write 1250",
    "25,000 ±0,010 mm": "'25,000' may be 25.000 or 25000; write one of these",
    "25 mm h6 Ⓔ": "'Ⓔ' (circled latin capital letter e, U+24BA) is no sign",
    "25\u200b ±0.1 mm": "a sign that cannot be seen (zero width space, U+200B)",
    "½ in": "(vulgar fraction one half, U+00BD) is no sign of a quantity; write 0.5",
    "25 ╧0.1 mm": "'╧' (box drawings",
}


@pytest.mark.parametrize("text", READ)
def test_a_notation_of_drawings_is_read(text):
    nominal, lower, upper, unit = READ[text]
    study = load(chain("x", {"x": text}))
    assert study.settings.nominal["x"] == pytest.approx(nominal * unit, rel=1e-12)
    zone = study.deviating.distributions["x"].tolerance
    assert zone == pytest.approx((lower * unit, upper * unit), rel=1e-9, abs=1e-18)
    assert study.editor().table["links"]["x"] == text  # as the drawing has it


def test_the_study_of_a_drawing_has_its_numbers():
    """Root sum square, mm: each normal at Cp = 1, the gasket uniform."""
    study = load(ROOT / "runs" / "drawing.toml")
    spreads = {n: spread_of(x) for n, x in study.deviating.distributions.items()}
    numbers = study.model.numbers(study.settings, spreads)
    values = {number.name: 1e3 * number.value for number in numbers}
    assert values["rss_mean_clearance"] == pytest.approx(0.0295)
    assert values["rss_sigma_clearance"] == pytest.approx(0.004947, abs=5e-7)
    mean = 60.025 + 0.5 - 12 - 1.975 - 8 - 25.4 * 1.2505
    assert values["rss_mean_room"] == pytest.approx(mean)
    halves = (0.075, 0.1, 0.025, 0.2, 25.4 * 0.0015, 0.05 * math.sqrt(3))
    assert values["rss_sigma_room"] == pytest.approx(math.hypot(*halves) / 3)


@pytest.mark.parametrize("text", REFUSED)
def test_a_notation_that_is_not_read_says_what_to_type(text):
    said = problems_of(chain("x", {"x": text, "y": "9 mm"}))
    assert REFUSED[text] in said and "[links] x" in said


@pytest.mark.parametrize(
    ("read", "text", "ends"),
    [
        (limit, "≤ 0.3 mm", (-math.inf, 0.3e-3)), (limit, "≥ 0 mm", (0, math.inf)),
        (limit, "0.1–0.3 mm", (0.1e-3, 0.3e-3)), (limit, "0.1-0.3 mm", (1e-4, 3e-4)),
        (limit, "−0.1 – 0.3 mm", (-0.1e-3, 0.3e-3)),
        (limit, "0,1 mm…0,3 mm", (1e-4, 3e-4)), (limit, "−1..2 mm", (-1e-3, 2e-3)),
        (quantity_range, "1–2 m", (1, 2)), (tolerance, "+0,1/–0,05 mm", (-5e-5, 1e-4)),
        (tolerance, "±50 μm", (-5e-5, 5e-5)), (tolerance, "0 −0,013 mm", (-13e-6, 0)),
        (tolerance, "+0.1 -0.05 mm", (-5e-5, 1e-4)),
        (tolerance, "–5..+20 um", (-5e-6, 2e-5)),
    ],
)  # fmt: skip
def test_zones_and_limits_are_read_with_signs_of_word_processors(read, text, ends):
    assert read(text, "m") == pytest.approx(ends)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("5 N·m", "N m", 5.0), ("5 N⋅m", "N m", 5.0), ("11.5×10^-6 m", "m", 11.5e-6),
        ("11,5·10⁻⁶ m", "m", 11.5e-6), ("−5 mm", "m", -5e-3), ("3 mm²", "m^2", 3e-6),
        ("4 kΩ", "ohm", 4e3), ("4 kΩ", "ohm", 4e3), ("2 µN", "N", 2e-6),
        ("45°30'", "rad", 45.5 * DEG), ("20 ℃", "K", 20.0),
    ],
)  # fmt: skip
def test_quantities_are_read_with_signs_of_word_processors(text, unit, value):
    assert quantity(text, unit) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    "formula",
    ["a − b", "a – b", "a‐b", "a\u00a0−\u202fb", "2×a ÷ 2 − 1·b", "a ＋ b − 2⋅b"],
)
def test_a_formula_is_read_with_signs_of_word_processors(formula):
    study = load(chain(formula, {"a": "10 mm", "b": "9 mm"}))
    (read,) = study.settings.formulas.values()
    assert read.text.isascii()
    assert study.settings.gap == formula


@pytest.mark.parametrize(
    ("formula", "words"),
    [
        ("a² / a - b", "character 2: '²' (superscript two, U+00B2)"),
        ("a² / a - b", "write **2"), ("√(a*b)", "write sqrt(...)"), ("π*a", "write pi"),
        ("if(a≤b, a, b)", "write <="), ("“a”-b", "left double quotation mark"),
        ("a −\u200b b", "cannot be seen (zero width space, U+200B); delete it"),
    ],
)  # fmt: skip
def test_a_sign_that_a_formula_lacks_is_named(formula, words):
    assert words in problems_of(chain(formula, {"a": "10 mm", "b": "9 mm"}))


EXPANSION = "L*(1 + a*dT) - S"
PARTS = {"L": "10 +-0.1 mm", "S": "9 mm", "a": "1e-5 1/K"}
MIXED = "both are differences of temperature; give both in one unit"


@pytest.mark.parametrize(
    ("formula", "dT", "more"),
    [
        (EXPANSION, "0 K", {"cases": {"cold": {"dT": "-40 °C"}}}),
        (EXPANSION, "20 degC", {"cases": {"dT": ["293 K", "20 degC"]}}),
        (EXPANSION, "0 K",
         {"cases": {"dT": {"from": "-40 °C", "to": "20 °C", "points": 3}}}),
        ("L*(1 + a*(dT - 20 K)) - S", "20 °C", {}),
        ("dT - 5 K", "10 K", {"limits": {"gap": "<= 60 degC"}}),
        ("dT*L/L", "20 °C", {"limits": {"gap": {"limit": "<= 293 K", "ppm": 9}}}),
    ],
)  # fmt: skip
def test_a_temperature_is_not_compared_with_one_of_the_other_scale(formula, dT, more):
    assert MIXED in problems_of(chain(formula, {**PARTS, "dT": dT}, **more))


@pytest.mark.parametrize(
    ("dT", "case"), [("20 °C ±5 K", "-40 degC"), ("0 +-5 K", "-40 K")]
)
def test_one_scale_of_temperatures_is_read_in_cases(dT, case):
    study = chain(
        EXPANSION,
        {**PARTS, "dT": dT},
        cases={"cold": {"dT": case}, "warm": {"S": "8 mm"}},
    )
    assert {"gap_at_cold", "gap_at_warm"} <= {
        response.name for response in load(study).description.responses
    }


def test_a_decimal_comma_of_the_tolerance_counts_for_the_size():
    """Both keys of an entry have one author, who may separate thousands by a point."""
    with pytest.raises(TolstatError, match=r"'1\.250' beside a decimal comma"):
        load(chain("x", {"x": {"nominal": "1.250 mm", "tolerance": "±0,1 mm"}}))
    load(chain("x", {"x": {"nominal": "0.250 mm", "tolerance": "±0,1 mm"}}))
