"""Numbers in writing: digits, interval, or the reason why there is none."""

import math
from typing import NamedTuple

from tolstat.document.inline import Number
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import Scale

FEW = 30  # trials: a share of fewer is a count


class Digits(NamedTuple):
    """A number as it is shown, and the number itself, SI."""

    text: str
    value: float


Written = tuple[str | Digits, ...]


def in_cell(number: Number) -> tuple[Written, Written]:
    """Return a number for a table without its unit, and its interval below.

    An estimate without interval has the reason below it.
    """
    found = number.value
    if not isinstance(found, Estimate):
        return (_digits(number, found),), ()
    if math.isnan(found.value):
        return (), (found.reason,) if found.reason else ()
    why = () if found.sure else (found.reason or "no interval",)
    if why and (found.needs_more or math.isinf(found.value)):
        return (), why
    value, ends = _estimate(number, found)
    return value, ends or why


def in_line(number: Number) -> Written:
    """Return a number for a sentence, with its unit: 3.1 kN m (2.9 to 3.3)."""
    found, mark = number.value, number.scale.mark
    unit = (f" {mark}",) if mark and not _count(number) else ()
    if not isinstance(found, Estimate):
        return (_digits(number, found), *unit)
    if math.isnan(found.value):
        return (found.reason or "none",)
    value, ends = _estimate(number, found)
    if not found.sure and found.reason:
        ends = (found.reason,)
    elif ends and mark and not unit:
        ends = (*ends, f" {mark}")
    return (*value, *unit, " (", *ends, ")") if ends else (*value, *unit)


def plain(written: Written) -> str:
    """Return a written number as text."""
    return "".join(each if isinstance(each, str) else each.text for each in written)


def _count(number: Number) -> str:
    """Return a share of few trials as a count, 6 of 7; else nothing."""
    value = number.value[0] if isinstance(number.value, Estimate) else number.value
    if not 0 < number.of < FEW or math.isnan(value):
        return ""
    count = round(number.of * value)
    return f"{count} of {number.of}" if math.isclose(count, number.of * value) else ""


def _digits(number: Number, value: float) -> Digits:
    if words := _count(number):
        return Digits(words, value)
    if isinstance(value, int):  # a truth value too
        words = str(value)
    elif math.isnan(value):
        words = "none"
    elif math.isinf(value):
        words = "infinite" if value > 0 else "-infinite"
    elif number.bound and isinstance(number.scale, Scale):
        words = getattr(number.scale, number.bound)(value)
    else:
        words = number.scale.number(value)
    return Digits(words, value)


def _estimate(number: Number, found: Estimate) -> tuple[Written, Written]:
    """Return an estimate and its interval; an open interval is a bound."""
    assert isinstance(number.scale, Scale)
    value, lower, upper = number.scale.interval(*found[:3])
    ends = Digits(lower, found.lower), " to ", Digits(upper, found.upper)
    if found.sure and math.isinf(found.upper):
        return ("at least ", ends[0]), ()
    if found.sure and math.isinf(found.lower):
        return ("at most ", ends[2]), ()
    at = Digits(_count(number) or value, found.value)
    if math.isinf(found.value):
        at = _digits(number, found.value)
    return (at,), ends if found.sure and lower != upper else ()
