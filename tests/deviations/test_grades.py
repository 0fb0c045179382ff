"""ISO 286 and ISO 1328: values of the standards, and refusals outside them."""

from __future__ import annotations

import csv
import math
from fractions import Fraction
from itertools import product
from pathlib import Path

import pytest

from tolstat.deviations import gear_classes, grades
from tolstat.deviations.grades import ABOVE, BELOW, grade_zone
from tolstat.errors import GradeError

# values that workshop handbooks print: nominal size (mm), grade, um
KNOWN = [
    (3, 7, 10), (6, 6, 8), (10, 7, 15), (18, 7, 18), (25, 7, 21), (30, 8, 33),
    (40, 6, 16), (50, 7, 25), (80, 9, 74), (100, 7, 35), (120, 11, 220), (150, 8, 63),
    (180, 7, 40), (200, 6, 29), (350, 8, 89), (450, 7, 63), (500, 5, 27), (630, 7, 70),
    (1000, 7, 90), (2000, 9, 370), (2450, 7, 175), (3150, 8, 330), (3150, 18, 33000),
    (50, 12, 250), (1, 1, 0.8), (50, 1, 1.5),
]  # fmt: skip


@pytest.mark.parametrize(("size", "grade", "width"), KNOWN)
def test_widths_of_the_standard(size, grade, width):
    assert grades.width(grade, size / 1e3) == pytest.approx(width * 1e-6, rel=1e-12)


def test_a_size_at_the_end_of_a_range_belongs_to_it():
    assert grades.width(7, 0.050) == pytest.approx(25e-6)
    assert grades.width(7, 0.0500001) == pytest.approx(30e-6)
    assert grades.width(7, 0.1 + 0.2 - 0.25) == pytest.approx(25e-6)  # rounding


def formula(grade, low, high):
    """What the standard's formula gives before rounding, um (ISO 286-1, annex)."""
    units = (7, 10, 16, 25, 40, 64, 100, 160, 250, 400, 640, 1000, 1600, 2500)
    D = math.sqrt(low * high)
    i = 0.45 * D ** (1 / 3) + 0.001 * D if high <= 500 else 0.004 * D + 2.1
    return units[grade - 5] * i


def test_widths_come_from_the_table_not_the_formula():
    """From over 180 to 250 mm, IT9: the formula gives 116 um, the table 115."""
    assert round(formula(9, 180, 250)) == 116
    assert grades.width(9, 0.2) == pytest.approx(115e-6)
    assert round(formula(11, 3, 6)) == 73
    assert grades.width(11, 0.005) == pytest.approx(75e-6)


def test_the_table_is_consistent():
    """No slip of the pen: near the formula, tenfold every five grades, ascending."""
    ends = list(grades.WIDTHS[1])
    assert list(grades.WIDTHS) == list(grades.GRADES)
    for low, high in zip([1, *ends], ends, strict=False):
        row = [grades.WIDTHS[grade][high] for grade in range(1, 19)]
        assert list(row) == sorted(set(row))
        for grade in range(5, 19):
            off = row[grade - 1] / formula(grade, low, high) - 1
            assert abs(off) < {3: 0.16, 6: 0.12}.get(high, 0.065), (high, grade)
        for grade in range(6, 14):
            if (high, grade) != (6, 6):  # 8 and 75 um, in the standard too
                assert row[grade + 4] == pytest.approx(10 * row[grade - 1]), high
    for column in grades.WIDTHS.values():
        values = [x for x in column.values() if x == x]
        assert values == sorted(values)


@pytest.mark.parametrize(
    ("text", "ends"),
    [
        ("IT7", (-28.5, 28.5)), ("js7", (-28.5, 28.5)), ("JS7", (-28.5, 28.5)),
        ("h7", (-57, 0)), ("H7", (0, 57)), ("IT 7", (-28.5, 28.5)),
    ],
)  # fmt: skip
def test_positions(text, ends):
    assert [1e6 * end for end in grade_zone(text, 0.35)] == pytest.approx(ends)


def test_limits_of_the_standard():
    """1474 zones of 74 classes from 3 to 400 mm, transcribed by others."""
    path = Path(__file__).with_name("limits_and_fits.csv")
    (_, *sizes), *rows = csv.reader(path.read_text().splitlines()[1:])
    count = 0
    for name, *limits in rows:
        for size, both in zip(sizes, limits, strict=True):
            if both:
                upper, lower = map(float, both.split("/"))
                ends = [1e6 * end for end in grade_zone(name, float(size) / 1e3)]
                # js is printed in whole um
                assert ends == pytest.approx([lower, upper], abs=0.51), (name, size)
                count += 1
    assert count == 1474


# class, size (mm), upper and lower deviation (um): letters, grades and sizes that the
# file lacks, from workshop handbooks
@pytest.mark.parametrize(
    ("text", "size", "upper", "lower"),
    [
        ("A11", 50, 480, 320), ("a11", 3, -270, -330), ("B11", 100, 440, 220),
        ("c11", 50, -130, -290), ("D9", 50, 142, 80), ("d10", 500, -230, -480),
        ("CD9", 3, 59, 34), ("ef5", 6, -14, -19), ("FG6", 10, 17, 8),
        ("j5", 50, 6, -5), ("j8", 3, 8, -6), ("K7", 500, 18, -45), ("M6", 300, -9, -41),
        ("M7", 300, 0, -52), ("M8", 30, 4, -29), ("N9", 50, 0, -62), ("N9", 3, -4, -29),
        ("P7", 25, -14, -35), ("P7", 50, -17, -42), ("P9", 50, -26, -88),
        ("S7", 50, -34, -59), ("T7", 50, -45, -70), ("U7", 50, -61, -86),
        ("t6", 50, 70, 54), ("u7", 50, 95, 70), ("v6", 18, 50, 39),
        ("X7", 50, -88, -113), ("y6", 50, 130, 114), ("z8", 50, 175, 136),
        ("za8", 100, 389, 335), ("zb9", 10, 103, 67), ("ZC10", 200, -1150, -1335),
        ("ZC7", 200, -1133, -1179),
        ("k4", 500, 25, 5), ("k8", 30, 33, 0), ("H01", 50, 0.6, 0), ("IT0", 500, 3, -3),
        ("d8", 600, -260, -370), ("G7", 600, 92, 22), ("K7", 600, 0, -70),
        ("M7", 700, -30, -110), ("N9", 600, -44, -219), ("p6", 3000, 375, 240),
        ("R7", 3000, -580, -790), ("u6", 2000, 2092, 2000), ("f7", 1000, -86, -176),
    ],
)  # fmt: skip
def test_letters_of_the_standard(text, size, upper, lower):
    ends = [1e6 * end for end in grade_zone(text, size / 1e3)]
    assert ends == pytest.approx([lower, upper], abs=1e-6)


def test_fundamental_deviations_are_consistent():
    """No slip of the pen: they grow from letter to letter, and with the size."""
    for table in ([*BELOW.values()][::-1], [*ABOVE.values()]):
        for column in table:
            values = [x for x in column.values() if x == x]
            assert values == sorted(values) or column is ABOVE["k"]  # 0 over 500 mm
        for end in table[0]:
            values = [column[end] for column in table if column[end] == column[end]]
            assert values == sorted(set(values)), end


@pytest.mark.parametrize(
    "text", ["H7 (+0.025/0)", "H7 (+25/0 um)", "g6(-0.009/-0.025)"]
)
def test_limits_behind_a_grade_are_checked(text):
    grade_zone(text, 0.05)
    with pytest.raises(GradeError, match="ISO 286-1 has"):
        grade_zone(text, 0.02)


@pytest.mark.parametrize(
    ("text", "size", "words"),
    [
        ("IT7", 3.2, "3150 mm"),
        ("IT7", 0.0, "3150 mm"),
        ("IT19", 0.1, "IT1 to IT18"),
        ("IT0", 0.6, "up to 500 mm"),
        ("IT15", 0.0005, "over 1 mm"),
        ("w6", 0.05, "without i, l, o, q and w"),
        ("Js6", 0.05, "a to zc for a shaft"),
        ("t6", 0.02, "t6 of 20 mm: ISO 286-1 has no such class"),
        ("J9", 0.02, "no such class"),
        ("K9", 0.02, "no such class"),
        ("a11", 0.001, "no such class"),
        ("x6", 0.6, "no such class"),
    ],
)
def test_grades_that_are_refused(text, size, words):
    with pytest.raises(GradeError, match=words):
        grade_zone(text, size)


def test_classes_of_gears_by_hand():
    """D = 400 mm, m = 5 mm, class 7, from ISO 1328-1:2013 by pocket calculator."""
    # f_p: (0.4 + 2 + 5) * 2 = 14.8; F_p: (0.8 + 11 + 3.5 + 12) * 2 = 54.6
    assert gear_classes.single_pitch(0.4, 0.005, 7) == pytest.approx(15e-6)
    assert gear_classes.run_out(0.4, 0.005, 7) == pytest.approx(49e-6)
    # below 10 um to half a um, below 5 um to a tenth
    assert gear_classes.single_pitch(0.4, 0.005, 5) == pytest.approx(7.5e-6)
    assert gear_classes.single_pitch(0.4, 0.005, 2) == pytest.approx(2.6e-6)
    assert "2013" in gear_classes.ISO_1328


@pytest.mark.parametrize(
    ("diameter", "module", "flank_class", "pitch"),
    [
        (2.5, 0.005, 3, 4.8),  # (2.5 + 2 + 5) / 2 = 4.75
        (2.5, 0.02, 3, 8.0),  # (2.5 + 8 + 5) / 2 = 7.75
        (1.0, 0.01, 1, 2.5),  # (1 + 4 + 5) / 4 = 2.5, no tie
        (4.5, 0.01, 5, 14.0),  # 13.5
        (0.1 + 0.2 + 1.7, 0.005, 3, 4.5),  # 4.5 of a diameter that has been computed
        (4 * 0.625, 0.005, 3, 4.8),
    ],
)
def test_ties_of_the_rounding_go_up(diameter, module, flank_class, pitch):
    found = gear_classes.single_pitch(diameter, module, flank_class)
    assert found == pytest.approx(pitch * 1e-6, rel=1e-12)


def by_the_rule(micrometres):
    """Round an exact fraction as 5.2 says."""
    step = Fraction(1 if micrometres > 10 else "1/2" if micrometres > 5 else "1/10")
    return step * math.floor(micrometres / step + Fraction(1, 2))


def test_fractions_are_rounded_exactly():
    """Odd classes of gears; for the run-out those whose diameter is a square."""
    ties = 0
    modules = ("1/2", "1", "5/4", "5/2", "5", "12", "25")
    for flank_class, module in product(range(1, 12, 2), map(Fraction, modules)):
        of_class = Fraction(2) ** ((flank_class - 5) // 2)
        for diameter in (*range(25, 10_001, 25), *(k * k for k in range(3, 101))):
            if not 5 <= diameter / module <= 1000:
                continue
            lengths = float(diameter) / 1000, float(module) / 1000
            f_p = (Fraction(diameter, 1000) + module * Fraction(2, 5) + 5) * of_class
            known = by_the_rule(f_p)
            ties += known - f_p in (Fraction(1, 2), Fraction(1, 4), Fraction(1, 20))
            found = gear_classes.single_pitch(*lengths, flank_class)
            assert found == float(known / 10**6), (diameter, module)
            if math.isqrt(diameter) ** 2 == diameter:
                F_p = Fraction(diameter, 500) + Fraction("7/10") * module + 12
                F_p += Fraction("11/20") * math.isqrt(diameter)
                known = by_the_rule(F_p * of_class * Fraction("9/10"))
                found = gear_classes.run_out(*lengths, flank_class)
                assert found == float(known / 10**6), (diameter, module)
    assert ties > 100


def test_each_class_is_a_root_of_two_wider():
    for flank_class in (6, 8, 10):
        wide = gear_classes.run_out(1.092, 0.012, flank_class + 1)
        narrow = gear_classes.run_out(1.092, 0.012, flank_class)
        assert wide / narrow == pytest.approx(math.sqrt(2), abs=0.02)


def test_zones_of_a_class():
    lower, upper = gear_classes.gear_zone("run-out", 0.4, 0.005, 7)
    assert (lower, upper) == (0.0, pytest.approx(24.5e-6))  # half of what is indicated
    assert gear_classes.gear_zone("pitch", 0.4, 0.005, 7) == pytest.approx(
        (-15e-6, 15e-6)
    )


@pytest.mark.parametrize(
    ("diameter", "module", "flank_class", "words"),
    [
        (0.4, 0.005, 12, "classes 1 to 11"),
        (0.4, 0.005, 0, "classes 1 to 11"),
        (0.4, 0.1, 7, "0.5 to 70 mm"),
        (0.05, 0.02, 7, "module 20 mm: a wheel of 50 mm would have 2.5 teeth"),
    ],
)
def test_gears_that_are_refused(diameter, module, flank_class, words):
    with pytest.raises(GradeError, match=words):
        gear_classes.run_out(diameter, module, flank_class)
