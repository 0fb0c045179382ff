"""Tolerances of sizes by the tables of standards: "H7", "IT9", "ISO 2768-m".

ISO 286-1 is here as its tables, whose values are rounded: its formulas give others for
many (180 to 250 mm, IT9: table 115 um, formula 116 um). The grade gives the width of a
zone; a letter the fundamental deviation, the distance of the nearer end from the
nominal size. Left out is ef of 18 to 30 mm, where transcriptions differ (25 or 28 um).

References
----------
ISO 286-1:2010, Tables 1 to 5.
K. L. Narayana et al., Machine Drawing, Tables 15.2 and 15.3 (up to 500 mm).
DME, Tables for determining metric tolerances, Table 5 (500 to 3150 mm).
ISO 2768-1:1989, Tables 1 (linear sizes), 2 (external radii, heights of chamfers) and 3
(angles, by the length of the shorter side).
"""

import math
import re
from bisect import bisect_left

from tolstat.deviations.distributions import Tolerance
from tolstat.errors import GradeError
from tolstat.units.grammar import tolerance
from tolstat.units.typography import typed_quantity

GRADES = range(-1, 19)  # IT01 is -1

# upper ends of ranges of sizes up to 500 mm; IT01 and IT0 there, um
COARSE = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
FINEST = {
    -1: (0.3, 0.4, 0.4, 0.5, 0.6, 0.6, 0.8, 1, 1.2, 2, 2.5, 3, 4),
    0: (0.5, 0.6, 0.6, 0.8, 1, 1, 1.2, 1.5, 2, 3, 4, 5, 6),
}
# upper end of a range of sizes, mm (above that of the row before): IT1 to IT18, um
_ROWS = """
3 0.8 1.2 2 3 4 6 10 14 25 40 60 100 140 250 400 600 1000 1400
6 1 1.5 2.5 4 5 8 12 18 30 48 75 120 180 300 480 750 1200 1800
10 1 1.5 2.5 4 6 9 15 22 36 58 90 150 220 360 580 900 1500 2200
18 1.2 2 3 5 8 11 18 27 43 70 110 180 270 430 700 1100 1800 2700
30 1.5 2.5 4 6 9 13 21 33 52 84 130 210 330 520 840 1300 2100 3300
50 1.5 2.5 4 7 11 16 25 39 62 100 160 250 390 620 1000 1600 2500 3900
80 2 3 5 8 13 19 30 46 74 120 190 300 460 740 1200 1900 3000 4600
120 2.5 4 6 10 15 22 35 54 87 140 220 350 540 870 1400 2200 3500 5400
180 3.5 5 8 12 18 25 40 63 100 160 250 400 630 1000 1600 2500 4000 6300
250 4.5 7 10 14 20 29 46 72 115 185 290 460 720 1150 1850 2900 4600 7200
315 6 8 12 16 23 32 52 81 130 210 320 520 810 1300 2100 3200 5200 8100
400 7 9 13 18 25 36 57 89 140 230 360 570 890 1400 2300 3600 5700 8900
500 8 10 15 20 27 40 63 97 155 250 400 630 970 1550 2500 4000 6300 9700
630 9 11 16 22 32 44 70 110 175 280 440 700 1100 1750 2800 4400 7000 11000
800 10 13 18 25 36 50 80 125 200 320 500 800 1250 2000 3200 5000 8000 12500
1000 11 15 21 28 40 56 90 140 230 360 560 900 1400 2300 3600 5600 9000 14000
1250 13 18 24 33 47 66 105 165 260 420 660 1050 1650 2600 4200 6600 10500 16500
1600 15 21 29 39 55 78 125 195 310 500 780 1250 1950 3100 5000 7800 12500 19500
2000 18 25 35 46 65 92 150 230 370 600 920 1500 2300 3700 6000 9200 15000 23000
2500 22 30 41 55 78 110 175 280 440 700 1100 1750 2800 4400 7000 11000 17500 28000
3150 26 36 50 68 96 135 210 330 540 860 1350 2100 3300 5400 8600 13500 21000 33000
"""
TABLE = {
    int(size): tuple(map(float, widths))
    for size, *widths in map(str.split, _ROWS.strip().splitlines())
}


def width(grade: int, size: float) -> float:
    """Return the width of a tolerance grade at a nominal size, m; IT01 is -1.

    Raises `GradeError` if the table of the standard lacks this grade or size.
    """
    if grade not in GRADES:
        raise GradeError("grades of ISO 286-1 are IT01, IT0 and IT1 to IT18")
    millimetres = round(1e3 * size, 9)
    if not 0 < millimetres <= 3150:
        raise GradeError(
            f"IT{grade} of {millimetres:g} mm: the table of ISO 286-1 ends at 3150 mm; "
            "give the tolerance in mm"
        )
    if grade >= 14 and millimetres <= 1:
        raise GradeError(
            f"IT{grade} of {millimetres:g} mm: ISO 286-1 has IT14 and above only over "
            "1 mm"
        )
    if grade < 1:
        if millimetres > COARSE[-1]:
            raise GradeError("ISO 286-1 has IT01 and IT0 up to 500 mm")
        return 1e-6 * FINEST[grade][bisect_left(COARSE, millimetres)]
    ends = list(TABLE)
    return 1e-6 * TABLE[ends[bisect_left(ends, millimetres)]][grade - 1]


# upper end of a range of sizes, mm; fundamental deviations of shafts, um, by letter: a
# to g below the nominal size, k to zc above it; those of holes follow from them
_BELOW = """
to a b c cd d e ef f fg g
3 270 140 60 34 20 14 10 6 4 2
6 270 140 70 46 30 20 14 10 6 4
10 280 150 80 56 40 25 18 13 8 5
18 290 150 95 70 50 32 23 16 10 6
30 300 160 110 85 65 40 - 20 12 7
40 310 170 120 100 80 50 35 25 15 9
50 320 180 130 100 80 50 35 25 15 9
65 340 190 140 - 100 60 - 30 - 10
80 360 200 150 - 100 60 - 30 - 10
100 380 220 170 - 120 72 - 36 - 12
120 410 240 180 - 120 72 - 36 - 12
140 460 260 200 - 145 85 - 43 - 14
160 520 280 210 - 145 85 - 43 - 14
180 580 310 230 - 145 85 - 43 - 14
200 660 340 240 - 170 100 - 50 - 15
225 740 380 260 - 170 100 - 50 - 15
250 820 420 280 - 170 100 - 50 - 15
280 920 480 300 - 190 110 - 56 - 17
315 1050 540 330 - 190 110 - 56 - 17
355 1200 600 360 - 210 125 - 62 - 18
400 1350 680 400 - 210 125 - 62 - 18
450 1500 760 440 - 230 135 - 68 - 20
500 1650 840 480 - 230 135 - 68 - 20
630 - - - - 260 145 - 76 - 22
800 - - - - 290 160 - 80 - 24
1000 - - - - 320 170 - 86 - 26
1250 - - - - 350 195 - 98 - 28
1600 - - - - 390 220 - 110 - 30
2000 - - - - 430 240 - 120 - 32
2500 - - - - 480 260 - 130 - 34
3150 - - - - 520 290 - 145 - 38
"""
_ABOVE = """
to k m n p r s t u v x y z za zb zc
3 0 2 4 6 10 14 - 18 - 20 - 26 32 40 60
6 1 4 8 12 15 19 - 23 - 28 - 35 42 50 80
10 1 6 10 15 19 23 - 28 - 34 - 42 52 67 97
14 1 7 12 18 23 28 - 33 - 40 - 50 64 90 130
18 1 7 12 18 23 28 - 33 39 45 - 60 77 108 150
24 2 8 15 22 28 35 - 41 47 54 63 73 98 136 188
30 2 8 15 22 28 35 41 48 55 64 75 88 118 160 218
40 2 9 17 26 34 43 48 60 68 80 94 112 148 200 274
50 2 9 17 26 34 43 54 70 81 97 114 136 180 242 325
65 2 11 20 32 41 53 66 87 102 122 144 172 226 300 405
80 2 11 20 32 43 59 75 102 120 146 174 210 274 360 480
100 3 13 23 37 51 71 91 124 146 178 214 258 335 445 585
120 3 13 23 37 54 79 104 144 172 210 254 310 400 525 690
140 3 15 27 43 63 92 122 170 202 248 300 365 470 620 800
160 3 15 27 43 65 100 134 190 228 280 340 415 535 700 900
180 3 15 27 43 68 108 146 210 252 310 380 465 600 780 1000
200 4 17 31 50 77 122 166 236 284 350 425 520 670 880 1150
225 4 17 31 50 80 130 180 258 310 385 470 575 740 960 1250
250 4 17 31 50 84 140 196 284 340 425 520 640 820 1050 1350
280 4 20 34 56 94 158 218 315 385 475 580 710 920 1200 1550
315 4 20 34 56 98 170 240 350 425 525 650 790 1000 1300 1700
355 4 21 37 62 108 190 268 390 475 590 730 900 1150 1500 1900
400 4 21 37 62 114 208 294 435 530 660 820 1000 1300 1650 2100
450 5 23 40 68 126 232 330 490 595 740 920 1100 1450 1850 2400
500 5 23 40 68 132 252 360 540 660 820 1000 1250 1600 2100 2600
560 0 26 44 78 150 280 400 600 - - - - - - -
630 0 26 44 78 155 310 450 660 - - - - - - -
710 0 30 50 88 175 340 500 740 - - - - - - -
800 0 30 50 88 185 380 560 840 - - - - - - -
900 0 34 56 100 210 430 620 940 - - - - - - -
1000 0 34 56 100 220 470 680 1050 - - - - - - -
1120 0 40 66 120 250 520 780 1150 - - - - - - -
1250 0 40 66 120 260 580 840 1300 - - - - - - -
1400 0 48 78 140 300 640 960 1450 - - - - - - -
1600 0 48 78 140 330 720 1050 1600 - - - - - - -
1800 0 58 92 170 370 820 1200 1850 - - - - - - -
2000 0 58 92 170 400 920 1350 2000 - - - - - - -
2240 0 68 110 195 440 1000 1500 2300 - - - - - - -
2500 0 68 110 195 460 1100 1650 2500 - - - - - - -
2800 0 76 135 240 550 1250 1900 2900 - - - - - - -
3150 0 76 135 240 580 1400 2100 3200 - - - - - - -
"""
# by class the distance to the far side of the nominal size, um, in ranges up to 500 mm
_J = {
    "j5": (2, 2, 2, 3, 4, 5, 7, 9, 11, 13, 16, 18, 20),
    "j6": (2, 2, 2, 3, 4, 5, 7, 9, 11, 13, 16, 18, 20),
    "j7": (4, 4, 5, 6, 8, 10, 12, 15, 18, 21, 26, 28, 32),
    "j8": (6,),
    "J6": (2, 5, 5, 6, 8, 10, 13, 16, 18, 22, 25, 29, 33),
    "J7": (4, 6, 8, 10, 12, 14, 18, 22, 26, 30, 36, 39, 43),
    "J8": (6, 10, 12, 15, 20, 24, 28, 34, 41, 47, 55, 60, 66),
}
_WRITTEN = re.compile(r"(IT|[A-Za-z]{1,2})\s*([0-9]{1,2})(?:\s*\((.+)\))?")
NAMES = {"01": -1, "0": 0, **{str(grade): grade for grade in range(1, 19)}}
FINE = 500  # mm: up to it holes differ from shafts of their letter


def _columns(table: str) -> dict[str, dict[int, float]]:
    """Return values by letter and range; NaN where the standard has none."""
    (_, *letters), *rows = map(str.split, table.strip().splitlines())
    return {
        letter: {int(row[0]): float(row[i].replace("-", "nan")) for row in rows}
        for i, letter in enumerate(letters, 1)
    }


BELOW, ABOVE = _columns(_BELOW), _columns(_ABOVE)
LETTERS = [*BELOW, "h", "js", "j", *ABOVE]


def looks_like_grade(text: str) -> bool:
    """Return whether a tolerance is one of a standard: "IT7", "h6", "ISO 2768-m"."""
    return bool(_WRITTEN.fullmatch(text.strip()) or general_class(text))


def grade_zone(text: str, size: float) -> Tolerance:
    """Return the zone of a grade on a drawing: deviations from the nominal size, m.

    "IT7" and "js7" lie half above and half below the nominal size, `size`, m. "g6" is
    of a shaft, "G7" of a hole. Limits behind it, "H7 (+0.021/0)", are checked.

    Raises
    ------
    GradeError
        If the grade is unknown, the standard's tables lack this size, or the limits
        are others.
    """
    match = _WRITTEN.fullmatch(text.strip())
    letter = match[1] if match else ""
    lower_case, upper_case = letter.lower(), letter.upper()
    is_letter = lower_case in LETTERS and letter in (lower_case, upper_case)
    if not match or not (is_letter or letter == "IT"):
        raise GradeError(
            f"'{text}': grades are IT01 to IT18, alone or behind a letter of ISO "
            "286-1, a to zc for a shaft, A to ZC for a hole, without i, l, o, q and w"
        )
    grade = NAMES.get(match[2], 99)
    full = round(1e6 * width(grade, size), 3)
    if letter == "IT" or lower_case == "js":
        lower = -full / 2
    else:
        lower = _lower_end(letter, grade, round(1e3 * size, 9), full)
    if math.isnan(lower):
        raise GradeError(
            f"{letter}{match[2]} of {1e3 * size:g} mm: ISO 286-1 has no such class; "
            "give the limits in mm"
        )
    ends = Tolerance(lower * 1e-6, (lower + full) * 1e-6)
    if match[3]:
        _check(text, match[3], ends)
    return ends


def _lower_end(letter: str, grade: int, size: float, full: float) -> float:
    """Return the lower end of a zone, um; NaN where the standard has none."""
    name, hole = letter.lower(), letter.isupper()
    step = bisect_left(COARSE, size)
    if name == "h":
        return 0.0 if hole else -full
    if name == "j":
        ends = _J.get(f"{letter}{grade}", ())
        distance = ends[step] if step < len(ends) else math.nan
        return distance - full if hole else -distance
    if name in BELOW:
        missing = name in "ab" and size <= 1
        distance = math.nan if missing else _value(BELOW[name], size)
        return distance if hole else -distance - full
    distance = _value(ABOVE[name], size)
    if not hole:
        return distance if name != "k" or 4 <= grade <= 7 else 0.0
    fine = 3 < size <= FINE
    if name == "k" and grade > 8:
        return math.nan if size > 3 else -full
    if name == "n" and grade > 8 and size <= FINE:
        return math.nan if size <= 1 else -full if fine else -distance - full
    if fine and grade <= (8 if name in "kmn" else 7):
        if grade < 3:
            return math.nan
        distance -= full - 1e6 * width(grade - 1, size * 1e-3)
        if (letter, grade, COARSE[step]) == ("M", 6, 315):
            distance = 9.0  # the exception of the standard: not 11
    return -distance - full


def _value(column: dict[int, float], size: float) -> float:
    """Return the value of the range of a size, mm."""
    ends = [*column]
    return column[ends[bisect_left(ends, size)]]


def _check(text: str, limits: str, ends: Tolerance) -> None:
    """Refuse limits behind a grade, in mm by default, that are not the standard's."""
    bare = not re.search("[A-Za-zµμ]", limits)
    typed = tolerance(f"{limits} mm" if bare else limits, "m")
    rounding = min(0.51e-6, 0.1 * (ends.upper - ends.lower))  # to micrometres
    if any(abs(a - b) > rounding for a, b in zip(typed, ends, strict=True)):
        lower, upper = (f"{1e3 * end:+.4g}" if end else "0" for end in ends)
        raise GradeError(
            f"'{text}': ISO 286-1 has {upper}/{lower} mm; correct grade, size or limits"
        )


# "ISO 2768-mK" has a class of form, too, and "-E" the envelope requirement
GENERAL = (
    r"(?:DIN\s+)?(?:EN\s+)?ISO\s*2768(?:-1)?(?::\d{4})?\s*[-–]?\s*"
    r"[fmcv][HKL]?(?:\s*-\s*E)?\b(?:\s+radius)?"
)
_CLASS = re.compile(r"(?<=[-\s\d])([fmcv])[HKL]?\b")
# upper ends of ranges of sizes, mm, and half the zone by class; None: not given
Table = tuple[tuple[float, ...], dict[str, tuple[float | None, ...]]]
LENGTHS: Table = (
    (3, 6, 30, 120, 400, 1000, 2000, 4000),
    {
        "f": (0.05, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, None),
        "m": (0.1, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2),
        "c": (0.2, 0.3, 0.5, 0.8, 1.2, 2, 3, 4),
        "v": (None, 0.5, 1, 1.5, 2.5, 4, 6, 8),
    },
)
RADII: Table = (
    (3, 6, math.inf),
    {"f": (0.2, 0.5, 1), "m": (0.2, 0.5, 1), "c": (0.4, 1, 2), "v": (0.4, 1, 2)},
)
ANGLES: Table = (  # minutes of arc
    (10, 50, 120, 400, math.inf),
    {
        "f": (60, 30, 20, 10, 5),
        "m": (60, 30, 20, 10, 5),
        "c": (90, 60, 30, 15, 10),
        "v": (180, 120, 60, 30, 20),
    },
)
LEAST = 0.5  # mm, of lengths and radii


def general_class(text: str) -> tuple[str, bool] | None:
    """Return the class of a general tolerance, and whether it is of a radius."""
    text = typed_quantity(text)
    if not re.fullmatch(GENERAL, text):
        return None
    *_, name = _CLASS.findall(text)
    return name, text.endswith("radius")


def general_zone(text: str, size: float, unit: str = "m") -> Tolerance:
    """Return the zone of a general tolerance, SI, of a length or an angle.

    Parameters
    ----------
    text : str
        As on a drawing, "ISO 2768-m" or "ISO 2768-mK"; "ISO 2768-m radius" is of an
        external radius or a chamfer.
    size : float
        Nominal size, m; of an angle the length of its shorter side.
    unit : str
        "m" or "rad".

    Raises
    ------
    GradeError
        If the standard has none of this size.
    """
    name, is_radius = general_class(text) or ("", False)
    ends, halves = ANGLES if unit == "rad" else RADII if is_radius else LENGTHS
    millimetres = round(1e3 * size, 9)
    step = bisect_left(ends, millimetres)
    small = unit == "m" and millimetres < LEAST
    half = None if small or step == len(ends) else halves[name][step]
    if half is None:
        raise GradeError(
            f"'{text}' of {millimetres:g} mm: ISO 2768-1 has none; give the tolerance"
        )
    half *= math.pi / 10800 if unit == "rad" else 1e-3
    return Tolerance(-half, half)
