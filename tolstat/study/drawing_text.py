"""A size with its tolerance, as a drawing has it: "25 +0.1/-0.05 mm", "Ø30 g6 mm".

Two limits of size, "24.98/25.02 mm", are their middle with half their distance. A text
that a drawing may have and a chain cannot take is refused with what to type.
"""

import re
from contextlib import suppress
from decimal import Decimal

from tolstat.deviations.grades import GENERAL, general_class, looks_like_grade
from tolstat.errors import ModelError, UnitError
from tolstat.units.conversion import dimension
from tolstat.units.grammar import (
    DASHED,
    SIDES,
    UNSIGNED,
    common_unit,
    plain,
    split,
    unit_of,
)

_NUMBER = rf"(?>{UNSIGNED})"  # "10 -0.05" is not 1 with the deviations 0 and -0.05
_GRADE = r"(?:IT|[A-Za-z]{1,2})\d{1,2}"
_UNIT = (
    rf"(?!{_GRADE}|ISO|DIN|EN|[xX]\s*[\dØR])"
    r"(?:(?:1\s*/\s*)?[^\W\d_](?:[^\W\d_]|\^-?\d|[/* .])*?|°[A-Za-z]?|%)"
)
_FEATURE = re.compile(r"(?:S?Ø|SR|R|□|dia(?:meter)?\b\.?)\s*(?=[0-9.])", re.IGNORECASE)
_ZONE = r"[+±0-].*"
_SIZED = re.compile(
    rf"(?P<size>[+-]?{_NUMBER})\s*(?P<unit>{_UNIT})?\s*"
    rf"(?:\((?P<inner>{_ZONE})\)\s*(?P<last>{_UNIT})?|(?P<zone>{_ZONE}))"
)
_BY_STANDARD = re.compile(
    rf"(?P<size>{_NUMBER})\s*(?P<unit>{_UNIT})?\s*"
    rf"(?P<grade>{_GRADE}(?:\s*/\s*{_GRADE})?|{GENERAL})"
    rf"\s*(?:\((?P<inner>[^()]*)\)|(?P<limits>(?:[+-]\s*[\d.]|0\s*[/ ]).*?))?\s*"
    rf"(?P<last>{_UNIT})?"
)
_STACKED = re.compile(rf"({_NUMBER})(?:\s*({_UNIT}))?\s*/\s*({_NUMBER})\s*({_UNIT})?")
_BLANK = re.compile(r"(?<=[\w.°%])\s+(?=[+-]\s*[0-9.]|0)")
_ONE_END = re.compile(rf"({_NUMBER}(?:\s*{_UNIT})?)\s*([+-])\s*({UNSIGNED})(.*)")
_TWO_ENDS = re.compile(  # no stroke between them
    rf"({_NUMBER}(?:\s*{_UNIT})?)\s*([+-])\s*({_NUMBER})\s*[|;\\]?\s*([+-])\s*"
    rf"({_NUMBER})(.*)"
)
_CHAMFER = re.compile(rf"({_NUMBER})\s*(?:mm)?\s*[xX]\s*45\s*(?:°|deg)\s*([^°]*)")
_CROSSED = re.compile(r"([0-9]+)([xX][0-9]{1,2})(?![0-9.])(?!\s*°)(.*)")
_COUNTED = re.compile(rf"([0-9]+)\s*[xX]\s*(\D*{_NUMBER}.*)")
_THREAD = re.compile(r"(?:M|Tr|G|UN[CF]?)\s*[0-9].*")
_BOUND = re.compile(r".*(\b(?:max|min|ref|basic|typ|theo)\b|[<>]=?).*", re.IGNORECASE)
_AUXILIARY = re.compile(r"[(\[]([^)\]]*)[)\]](.*)")
_MIXED = re.compile(r"([0-9]+)(?: +|-)([0-9]+)/([0-9]+)(?![0-9.])(.*)")
_NUMBERS = re.compile(rf"(?<![\w^.]){_NUMBER}")
_LONE_END = re.compile(rf"[+-]\s*{UNSIGNED}")
_PAIR = re.compile(rf"({_NUMBER}.*?)\s*({_GRADE})\s*[- ,]\s*({_GRADE})(.*)")


def separated(text: str) -> tuple[str, str] | None:
    """Return the size and the tolerance of a text that holds both; else None.

    The tolerance is a zone of deviations, a grade or a general tolerance.
    """
    with suppress(UnitError):  # one quantity, or one range
        dimension(unit_of(text))
        return None
    text = plain(text)
    size = _without_feature(text)
    if parts := _BY_STANDARD.fullmatch(size):
        return _by_standard(text, **parts.groupdict(default=""))
    parts = _SIZED.fullmatch(size)
    if parts is None:
        return None
    zone = (parts["inner"] or parts["zone"]).strip()
    sign, lower, upper, last = split(zone)
    if not upper and (sign in ("", *SIDES) or lower[0] in "+-"):
        return None
    if sign == "/" and "/" not in zone:
        zone = _BLANK.sub("/", zone)
    last = last or parts["last"] or ""
    if last and not re.fullmatch(_UNIT, last):
        return None
    unit = parts["unit"] or ("" if last == "%" else last)  # per cent is of the size
    tail = "" if zone.endswith(last) and last else last or unit
    return f"{parts['size']} {unit.strip()}".strip(), f"{zone} {tail}".strip()


def _without_feature(text: str) -> str:
    """Return a text without the sign of a diameter, radius or square."""
    feature = _FEATURE.match(text)
    return text[feature.end() :] if feature else text


def of_link(text: str) -> tuple[str, ...]:
    """Return the size in the text of a link, and its tolerance where it has one.

    Raises
    ------
    ModelError, UnitError
        If the text is that of a drawing and no size of a link.
    """
    size = _without_feature(plain(text))
    if parts := _CROSSED.fullmatch(size):
        first, second, rest = parts.groups()
        raise ModelError(
            f"{first}{second} may be a number of features or the class {second} of ISO "
            f'286-1; write "{second[1:]}{rest}", or "{first} {second}{rest}"'
        )
    if mixed := _decimal_of_mixed(size):
        raise ModelError(mixed)
    if both := separated(text):
        graded = looks_like_grade(both[1].partition("/")[0])
        if " " not in both[0] and (graded or size != plain(text)):
            raise ModelError(f'the unit is missing; write "{text.strip()} mm"')
        return both
    if stacked := _STACKED.fullmatch(size):
        first, inner, last, unit = stacked.groups(default="")
        unit = common_unit(inner, unit)
        least, largest = sorted((Decimal(first), Decimal(last)))
        if "." not in first + last:
            raise ModelError(
                f"{first}/{last} may be a fraction or two limits of size; write "
                f'"{_quotient(first, last)} {unit}", or "{least}..{largest} {unit}"'
            )
        return _limits(least, largest, unit)
    sign, lower, upper, unit = split(size)
    if sign in ("", DASHED) and upper:
        return _limits(Decimal(lower), Decimal(upper), unit)
    if words := _what_to_type(size):
        raise ModelError(words)
    return (size,)


def _decimal_of_mixed(text: str) -> str:
    """Return what to type for a mixed fraction, 1 3/4 or 1-3/4; empty for another."""
    parts = _MIXED.fullmatch(text)
    if not parts or not int(parts[2]) < int(parts[3]):
        return ""
    number = int(parts[1]) + int(parts[2]) / int(parts[3])
    return f'fractions are not read; write "{number:.10g}{parts[4]}"'


def _quotient(above: str, below: str) -> str:
    return f"{float(above) / float(below):.10g}" if float(below) else f"{above}/{below}"


def _limits(least: Decimal, largest: Decimal, unit: str) -> tuple[str, str]:
    """Return the middle of two limits of size, and the zone about it."""
    if not largest > least:
        raise ModelError("the smaller of two limits of size comes first")
    middle, half = (least + largest) / 2, (largest - least) / 2
    return f"{middle:f} {unit}".strip(), f"+-{half:f} {unit}".strip()


def _by_standard(
    text: str, size: str, unit: str, grade: str, inner: str, limits: str, last: str
) -> tuple[str, str] | None:
    """Return a size, and its tolerance by a standard; None if that is none."""
    general = general_class(grade)
    grades = [grade] if general else "".join(grade.split()).split("/")
    if not all(map(looks_like_grade, grades)) or last.startswith("°"):
        return None
    limits = (inner or limits).strip()
    if limits and (general or len(grades) > 1):
        raise ModelError(
            "limits are those of one part; write the fit without them, or two links"
        )
    if _LONE_END.fullmatch(limits):
        ends = f"{limits}/0" if limits[0] == "+" else f"0/{limits}"
        raise ModelError(f'limits behind a grade are two; write "{grade} ({ends})"')
    size = f"{size} {unit.strip() or last}".strip()
    if general and not general[1] and text[:1] == "R":
        raise ModelError(
            "ISO 2768-1 has two tables of radii; write, of a broken edge, "
            f'"{size} {grade} radius", of others "{size} {grade}"'
        )
    tolerance = "/".join(grades)
    return size, f"{tolerance} ({limits})" if limits else tolerance


def _what_to_type(text: str) -> str:
    """Return what to type for a text that a link cannot take; empty for another."""
    text = " ".join(text.split())
    if parts := _CHAMFER.fullmatch(text):
        height = f"{parts[1]} {parts[2]}".strip()
        unit = "" if re.search(_UNIT, parts[2]) else " mm"
        return f'a chamfer has a height; write "{height}{unit}" (an angle is "45°")'
    if parts := _COUNTED.fullmatch(text):
        return (
            f'{parts[1]}x counts features, and a link is one; write "{parts[2]}", and '
            "as many links as the chain passes"
        )
    if parts := _TWO_ENDS.fullmatch(text):
        size, sign, number, other, last, unit = parts.groups()
        return (
            "two deviations have a stroke between them; write "
            f'"{size} {sign}{number}/{other}{last}{unit}"'
        )
    if parts := _ONE_END.fullmatch(text):
        size, sign, number, unit = parts.groups()
        ends = f"+{number}/0" if sign == "+" else f"0/-{number}"
        return f'one deviation is typed; write both, such as "{size} {ends}{unit}"'
    if parts := _PAIR.fullmatch(text):
        size, hole, shaft, unit = parts.groups()
        return f'a fit is a hole and a shaft; write "{size} {hole}/{shaft}{unit}"'
    if _THREAD.fullmatch(text):
        return "a thread is no size; write the diameter that decides, with its unit"
    if parts := _BOUND.fullmatch(text):
        return f'{parts[1]} gives no zone; write both ends, such as "24.9..25 mm"'
    if parts := _AUXILIARY.fullmatch(text):
        return f'a size stands without brackets; write "{parts[1]}{parts[2]}"'
    with suppress(UnitError):
        dimension(unit_of(text))
        return ""
    if len(_NUMBERS.findall(text)) > 1:
        return (
            "cannot be read; write a size and its tolerance as "
            '"25 +0.1/-0.05 mm", "25 +-0.1 mm", "25 h7 mm" or "24.9..25 mm"'
        )
    return ""
