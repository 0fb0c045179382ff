"""Tolerances of sizes by the tables of standards: "H7", "IT9", "ISO 2768-m".

ISO 286-1 is in `drawing_tables.txt` as its tables, whose values are rounded: its
formulas give others for many (180 to 250 mm, IT9: table 115 um, formula 116 um). The
grade gives the width of a zone; a letter the fundamental deviation, the distance of the
nearer end from the nominal size. Left out is ef of 18 to 30 mm, where transcriptions
differ (25 or 28 um).

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
from pathlib import Path

from tolstat.deviations.distributions import Tolerance
from tolstat.errors import GradeError
from tolstat.units.grammar import tolerance
from tolstat.units.typography import typed_quantity

GRADES = range(-1, 19)  # IT01 is -1
NAMES = {"01": -1, **{str(grade): grade for grade in GRADES[1:]}}
Column = dict[float, float]  # values by the upper ends of ranges of sizes, mm


def _read(section: str) -> dict[str, Column]:
    """Return the columns of a table by their heads; NaN where the standard has none."""
    _, (_, *heads), *rows = map(str.split, section.splitlines())
    return {
        head: {float(row[0]): float(row[i].replace("-", "nan")) for row in rows}
        for i, head in enumerate(heads, 1)
    }


_TEXT = Path(__file__).with_name("drawing_tables.txt").read_text("utf-8")
_GRADES, BELOW, ABOVE, _J, LENGTHS, RADII, ANGLES = map(_read, _TEXT.split("\n\n"))
WIDTHS = {NAMES[name]: column for name, column in _GRADES.items()}


def _value(column: Column, size: float) -> float:
    """Return the value of the range of a size, mm; NaN where there is none."""
    ends = [*column]
    step = bisect_left(ends, size)
    return column[ends[step]] if step < len(ends) else math.nan


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
    value = _value(WIDTHS[grade], millimetres)
    if math.isnan(value):
        raise GradeError("ISO 286-1 has IT01 and IT0 up to 500 mm")
    return 1e-6 * value


_WRITTEN = re.compile(r"(IT|[A-Za-z]{1,2})\s*([0-9]{1,2})(?:\s*\((.+)\))?")
FINE = 500  # mm: up to it holes differ from shafts of their letter
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
    if name == "h":
        return 0.0 if hole else -full
    if name == "j":
        distance = _value(_J.get(f"{letter}{grade}", {}), size)
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
        if (letter, grade) == ("M", 6) and 250 < size <= 315:
            distance = 9.0  # the exception of the standard: not 11
    return -distance - full


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
    halves = ANGLES if unit == "rad" else RADII if is_radius else LENGTHS
    millimetres = round(1e3 * size, 9)
    half = _value(halves[name], millimetres)
    if math.isnan(half) or (unit == "m" and millimetres < LEAST):
        raise GradeError(
            f"'{text}' of {millimetres:g} mm: ISO 2768-1 has none; give the tolerance"
        )
    half *= math.pi / 10800 if unit == "rad" else 1e-3
    return Tolerance(-half, half)
