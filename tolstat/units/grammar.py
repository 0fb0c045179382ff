"""A small grammar of numbers, ranges and signs, which pint misreads.

pint alone reads "+-1.2 mm" as -1.2, "0..60 um" as 0 and "1,2 mm" as 12.
A decimal comma is read where it can be nothing else.
"""

import math
import re
from typing import NamedTuple

import numpy as np

from tolstat.errors import UnitError
from tolstat.units.conversion import dimension, from_si, si_unit, to_si
from tolstat.units.scale import MOST_FIGURES, figures, scale_of
from tolstat.units.typography import DASHES, typed_quantity

_NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
UNSIGNED = _NUMBER.removeprefix("[+-]?")
_UNIT = rf"\s*(1\s*/.*|[^0-9.,+\-<>=±\s{DASHES}].*)?"
_FIRST_UNIT = r"(?:\s*([^\W\d_]+|[°%]))?"  # of both ends: it stands behind one or both
_WRITTEN = re.compile(
    rf"(\+-|\+/-|±|<=|>=)?\s*({_NUMBER})"
    rf"(?:{_FIRST_UNIT}\s*\.\.\s*({_NUMBER}))?{_UNIT}"
)
_END = rf"[+-]\s*{UNSIGNED}|0(?:\.0*)?"  # 0 has no sign
_UPPER_LOWER = re.compile(  # as on drawings, beside or below each other
    rf"({_END}){_FIRST_UNIT}\s*/\s*({_END}){_UNIT}"
    rf"|([+-]{UNSIGNED}|0){_FIRST_UNIT}\s+([+-]{UNSIGNED}|0){_UNIT}"
)
_DASHED = re.compile(  # a range: blanks on both sides of its dash, or on none
    rf"((?>{UNSIGNED})|-(?>{UNSIGNED})(?=.*[{DASHES}])){_FIRST_UNIT}"
    rf"(?P<gap>\s*)[-{DASHES}](?P=gap)({UNSIGNED}){_UNIT}"
)
DASHED = "–"  # the sign of such a range
_TO_THE_POWER = re.compile(rf"({UNSIGNED})\s*[*x]\s*10\s*(?:\^|\*\*)([+-]?[0-9]+)")
_DEGREES = re.compile(  # minutes and seconds of arc behind them
    rf"({UNSIGNED})\s*(?:°|deg)\s*({UNSIGNED})\s*'\s*(?:({UNSIGNED})\s*(?:\"|''))?"
)
_GAPPED = re.compile(r"(?<![\w.])([0-9]{1,3})[ ']([0-9]{3})(?![0-9])")  # thousands
_DOTTED = re.compile(r"(?<![\w.])(\d*\.?\d+) ?(\.{2,3})(\d+)(?![\d.])")
_POINTED = re.compile(r"(?<![\d,])(?<!\d\.)[1-9]\d{0,2}\.\d{3}(?![\d,eE]|\.\d)")
_COMMA = re.compile(r"(?<![\d,])(?<!\d\.)(\d*),(\d+)(?!\d|,|\.\d)")

# by SI unit others that a value may be written in, the first of equally short ones
_WRITTEN_IN = {
    "m": ("mm", "um", "km"), "s": ("ms", "us"), "Hz": ("kHz", "mHz"),
    "rad": ("deg", "mrad"), "rad/s": ("rpm",), "N": ("kN", "MN"),
    "J": ("kJ", "MJ"), "W": ("kW", "MW"), "Pa": ("kPa", "MPa", "GPa"),
}  # fmt: skip
SIDES = "<=", ">="
_SAME = 1e-12  # of a value: rounding of writing and reading

# squares and products of numbers in this range are numbers too
LEAST_NUMBER, MOST_NUMBER = 1e-100, 1e100


class Range(NamedTuple):
    """Two ends, SI; an open end is infinite."""

    lower: float
    upper: float


class Measure(NamedTuple):
    """A number with a unit of any kind, SI, and the unit as written."""

    value: float
    unit: str
    shown: str = ""


def measure(text: str) -> Measure:
    """Read one quantity of any kind, such as "60 mm" or "45 deg"."""
    written = unit_of(text)
    unit = si_unit(dimension(written))
    return Measure(quantity(text, unit), unit, written)


def bare_number(text: str) -> float:
    """Read a bare number."""
    if not re.fullmatch(_NUMBER, text.strip()):
        raise UnitError(_unreadable(text, "a number such as 0.25"))
    return _computable(text, float(text))


def quantity(text: str, unit: str) -> float:
    """Read one quantity, such as "7.5 rad/s", as SI; a bare number for "1"."""
    match split(text):
        case "", value, "", written if value:
            return _si(value, written, unit)
    raise UnitError(_unreadable(text, f"a quantity such as {_example('7.5', unit)}"))


def tolerance(text: str, unit: str) -> Range:
    """Read a tolerance: the permitted zone, SI.

    It is "+-1.2 mm", "-0.1..+0.3 mm" or, as on drawings, "+0.3/-0.1 mm".
    """
    match split(text):
        case "+-" | "+/-" | "±", half, "", written if half[0] not in "+-":
            most = _si(half, written, unit)
            zone = Range(-most, most)
        case "" | "/", lower, upper, written if upper:
            zone = Range(_si(lower, written, unit), _si(upper, written, unit))
        case _:
            expected = f"{_example('+-1.2', unit)} or {_example('-0.1..+0.3', unit)}"
            raise UnitError(_unreadable(text, f"a tolerance such as {expected}"))
    if not zone.upper > zone.lower:
        unsigned = zone.lower > 0 and text[0].isdigit()
        signed = f'; if a sign is missing, write "-{text}"' * unsigned
        raise UnitError(
            f"a tolerance has a width, and its lower end comes first{signed}; "
            "leave the line out for a part without deviation"
        )
    return zone


def limit(text: str, unit: str, shown: str = "") -> Range:
    """Read a limit, "<= 3 %", ">= 0 mm" or "1..2 mm": the permitted values, SI.

    `shown` is the unit in which the response is shown.
    """
    _check_share(text, unit, shown)
    match split(text):
        case "<=", most, "", written:
            return Range(-math.inf, _si(most, written, unit))
        case ">=", least, "", written:
            return Range(_si(least, written, unit), math.inf)
        case "" | "–", _, upper, _ if upper:
            return quantity_range(text, unit)
    expected = ", ".join(_example(form, unit) for form in ("<= 3", ">= 0", "1..2"))
    raise UnitError(_unreadable(text, f"a limit such as {expected}"))


def quantity_range(text: str, unit: str) -> Range:
    """Read a range, such as "850..1700 rpm", as SI."""
    sign, lower, upper, written = split(text)
    if sign not in ("", DASHED) or not upper:
        raise UnitError(_unreadable(text, f"a range such as {_example('1..2', unit)}"))
    ends = Range(_si(lower, written, unit), _si(upper, written, unit))
    if not ends.upper > ends.lower:
        raise UnitError("the lower end of a range comes first")
    return ends


def unit_of(text: str) -> str:
    """Return the unit as it stands at the end of a quantity, tolerance or limit."""
    _, number, _, written = split(text)
    if not number:
        raise UnitError(_unreadable(text, "a quantity"))
    return written or "1"


def typed(unit: str, *values: float) -> str:
    """Return a quantity, or a range, as text in the unit with the fewest digits.

    Units are SI and the usual ones: 0.06 m is "60 mm", 0.349... rad "20 deg". A bare
    number has the unit "1".
    """

    def size(name: str) -> tuple[int, bool]:
        """Return the number of digits, and whether the number is a handy one."""
        numbers = [from_si(value, unit, name) for value in values]
        digits = sum(
            len(f"{x:.9e}"[:-4].strip("-0.").replace(".", "")) for x in numbers
        )
        return digits, not all(x == 0 or 0.1 <= abs(x) < 10_000 for x in numbers)

    best = min((unit, *_WRITTEN_IN.get(unit, ())), key=size)
    if not any(values):
        best = {"m": "mm", "rad": "deg"}.get(unit, unit)
    words = [figures(from_si(value, unit, best), MOST_FIGURES) for value in values]
    back = [to_si(float(word), best, unit) for word in words]
    if not np.allclose(back, values, rtol=_SAME, atol=0.0):
        words, best = [figures(value, MOST_FIGURES) for value in values], unit
    return f"{'..'.join(words)} {scale_of(best, best).mark}".strip()


def plain(text: str) -> str:
    """Return a text by the signs of keys, with points as decimal signs.

    A comma is a decimal sign, unless it may also separate thousands: a UnitError. The
    angle 45°30' is 45.5°.
    """
    text = _TO_THE_POWER.sub(r"\1e\2", typed_quantity(text))
    for first, last in _COMMA.findall(text):
        if len(last) == 3 and first.strip("0"):
            raise UnitError(
                f"'{first},{last}' may be {first}.{last} or {first}{last}; write one "
                "of these"
            )
    refuse_two_signs(text)
    for first, dots, last in _DOTTED.findall(text):
        bare = first.startswith(".") and dots == "..."
        if bare or len(last) > len(last.lstrip("0")) > 0:
            raise UnitError(
                f"'{first}{dots}{last}' may end at {last} or at .{last}; write "
                f"'{first} .. {last}' or '{first} .. .{last}'"
            )
    if gapped := _GAPPED.search(text):
        raise UnitError(
            f"thousands are not separated; write {gapped[1]}{gapped[2]}, or a sign "
            "between two numbers"
        )
    # of a template, CPython 3.11 keeps a string of each call in its cache of attributes
    text = _COMMA.sub(lambda number: ".".join(number.groups()), text)
    text = text.replace("...", "..")
    return _without_primes(text) if "'" in text or '"' in text else text


def refuse_two_signs(*texts: str) -> None:
    """Refuse a point before three digits beside a decimal comma: a UnitError.

    The point may be a decimal sign, or separate thousands. `texts` belong together.
    """
    if not any(_COMMA.search(text) for text in texts):
        return
    for text in texts:
        if pointed := _POINTED.search(text):
            number, whole = pointed[0], pointed[0].replace(".", "")
            raise UnitError(
                f"'{number}' beside a decimal comma may be {number} or {whole}; "
                f"write {whole}, or all decimal signs as points"
            )


def _without_primes(text: str) -> str:
    """Return an angle without the signs of its minutes and seconds.

    Without a degree they may be feet and inches: a UnitError.
    """
    angle = "°" in text or "deg" in text
    text = _DEGREES.sub(
        lambda parts: f"{_degrees(*parts.groups(default='0'))!r}°", text
    )
    for sign, minor, length in (("'", "arcmin", "ft"), ('"', "arcsec", "in")):
        if not angle and re.search(rf"[0-9]\s*{sign}(?![0-9])", text):
            raise UnitError(
                f"{sign} may be {length} or {minor}; write one of these in its place"
            )
        if angle:
            text = text.replace(sign, f" {minor}")
    return text


def _degrees(degrees: str, minutes: str, seconds: str) -> float:
    return float(degrees) + (float(minutes) + float(seconds) / 60) / 60


def split(text: str) -> tuple[str, str, str, str]:
    """Return sign, number, second number of a range, and unit of a text.

    The sign of an upper and a lower deviation is "/"; the lower one is first. That of
    two ends with a dash between them is "–".
    """
    text = plain(text)
    if match := _UPPER_LOWER.fullmatch(text):
        upper, inner, lower, last = (
            part or "" for part in match.groups()[0 if match[1] else 4 :][:4]
        )
        ends = (end.replace(" ", "") for end in (upper, lower))
        lower, upper = sorted(ends, key=float)
        return "/", lower, upper, common_unit(inner, last.strip())
    if match := _DASHED.fullmatch(text):
        lower, inner, _, upper, last = (part or "" for part in match.groups())
        return DASHED, lower, upper, common_unit(inner, last.strip())
    if match := _WRITTEN.fullmatch(text):
        sign, lower, inner, upper, last = (part or "" for part in match.groups())
        return sign, lower, upper, common_unit(inner, last.strip())
    return "", "", "", ""


def common_unit(first: str, last: str) -> str:
    """Return the unit of two ends; refuse two units."""
    if first and last and first != last:
        raise UnitError(f"one end is in {first}, the other in {last}; give both in one")
    return last or first


def _si(number: str, written: str, unit: str) -> float:
    value = _computable(number, float(number))
    return _computable(number, to_si(value, written, unit))


def _check_share(text: str, unit: str, shown: str) -> None:
    """Refuse a limit without unit of what is shown in per cent or ppm."""
    sign, first, last, written = split(text)
    scale = scale_of(unit, shown)
    if unit != "1" or scale.factor == 1 or written or not (sign in SIDES or last):
        return
    numbers = [float(number) for number in (first, last) if number]
    readings = dict.fromkeys(
        f"{sign} {'..'.join(figures(k * x, MOST_FIGURES) for x in numbers)}".strip()
        for k in (1.0, scale.factor)
    )
    both = " or ".join(f'"{reading} {scale.mark}"' for reading in readings)
    raise UnitError(
        f"the unit is missing, and the response is shown in {scale.mark}; write {both} "
        '(a model shows a plain number by shown="1")'
    )


def _computable(number: str, value: float) -> float:
    """Return a number that neither over- nor underflows; refuse any other."""
    if value != 0 and not LEAST_NUMBER <= abs(value) <= MOST_NUMBER:
        side = "small" if abs(value) < LEAST_NUMBER else "large"
        raise UnitError(
            f"{number} is too {side}: in SI, numbers other than 0 lie between "
            f"{LEAST_NUMBER:g} and {MOST_NUMBER:g}"
        )
    return value


def _example(number: str, unit: str) -> str:
    return f'"{number} {scale_of(unit).mark}"'


def _unreadable(text: str, expected: str) -> str:
    if "," in text:
        return f"thousands are not separated; write {expected}"
    if any(dash in text for dash in DASHES) or _DASHED.fullmatch(plain(text)):
        return f"a dash is no sign: write - for minus, and .. between ends; {expected}"
    if re.match(r"(\+-|\+/-|±)\s*[+-]", text):
        return f"a tolerance is not negative; write {expected}"
    return f"cannot be read; write {expected}"
