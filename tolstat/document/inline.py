"""The parts of a sentence: words, names, commands, and numbers with their scale.

A sentence is worded once, with the numbers in it as numbers. `in_line` and `in_cell`
write each with its digits and its interval, or the reason why there is none, in one
form everywhere.
"""

import math
import os
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import AS_IS, Ratio, Scale

FEW = 30  # trials: a share of fewer is a count


@dataclass(frozen=True)
class Number:
    """A number or an estimate, SI, and how it is shown."""

    value: Estimate | float  # an integer is written whole
    scale: Scale | Ratio = AS_IS
    bound: str = ""  # "at_least" or "at_most": rounded to its safe side
    of: int = 0  # trials that it is a share of: of few it is shown as a count


@dataclass(frozen=True)
class Name:
    """The name of a contributor or a response, as written; `link`: anchor."""

    text: str
    link: str = ""


@dataclass(frozen=True)
class Word:
    """Words with a tone: "strong", "limit", or a verdict ("met", "undecided", ...)."""

    text: str
    tone: str = "strong"


@dataclass(frozen=True)
class Typed:
    """A command of tolstat to type: its name, files and options; it never wraps."""

    words: tuple[object, ...]

    @property
    def text(self) -> str:
        """The command, quoted for a shell in this folder."""
        return shlex.join(["tolstat", *map(_argument, self.words)])

    def __str__(self) -> str:
        """Return its text."""
        return self.text


def _argument(word: object) -> str:
    """Return a word of a command; a file that begins with - is no option."""
    is_file = isinstance(word, Path) and str(word).startswith("-")
    return f".{os.sep}{word}" if is_file else str(word)


@dataclass(frozen=True)
class Link:
    """The name of another page, and where it lies, as seen from this one."""

    text: str
    page: str


Inline = str | Number | Name | Word | Typed | Link
Parts = tuple[Inline, ...]
Row = Mapping[str, Number | str | int]  # by head: "mean [unit]", "failed"
Said = Inline | Iterable["Said"] | None  # as a sentence is given


class Digits(NamedTuple):
    """A number as it is shown, and the number itself, SI."""

    text: str
    value: float


Written = tuple[str | Digits, ...]


def in_cell(number: Number) -> tuple[Written, Written]:
    """Return a number for a table without its unit, and its interval below.

    An estimate without interval has the reason below it.
    """
    estimate = number.value
    if not isinstance(estimate, Estimate):
        return (_digits(number, estimate),), ()
    if math.isnan(estimate.value):
        return (), (estimate.reason,) if estimate.reason else ()
    reason = () if estimate.sure else (estimate.reason or "no interval",)
    if reason and (estimate.needs_more or math.isinf(estimate.value)):
        return (), reason
    value, ends = _estimate(number, estimate)
    return value, ends or reason


def in_line(number: Number) -> Written:
    """Return a number for a sentence, with its unit: 3.1 kN m (2.9 to 3.3)."""
    estimate, mark = number.value, number.scale.mark
    unit = (f" {mark}",) if mark and not _count(number) else ()
    if not isinstance(estimate, Estimate):
        return (_digits(number, estimate), *unit)
    if math.isnan(estimate.value):
        return (estimate.reason or "none",)
    value, ends = _estimate(number, estimate)
    if not estimate.sure and estimate.reason:
        ends = (estimate.reason,)
    elif ends and mark and not unit:
        ends = (*ends, f" {mark}")
    return (*value, *unit, " (", *ends, ")") if ends else (*value, *unit)


def plain(written: Written) -> str:
    """Return a written number as text."""
    return "".join(part if isinstance(part, str) else part.text for part in written)


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


def _estimate(number: Number, estimate: Estimate) -> tuple[Written, Written]:
    """Return an estimate and its interval; an open interval is a bound."""
    assert isinstance(number.scale, Scale)
    middle, lower, upper = number.scale.interval(*estimate[:3])
    ends = Digits(lower, estimate.lower), " to ", Digits(upper, estimate.upper)
    if estimate.sure and math.isinf(estimate.upper):
        return ("at least ", ends[0]), ()
    if estimate.sure and math.isinf(estimate.lower):
        return ("at most ", ends[2]), ()
    best = Digits(_count(number) or middle, estimate.value)
    if math.isinf(estimate.value):
        best = _digits(number, estimate.value)
    return (best,), ends if estimate.sure and lower != upper else ()
