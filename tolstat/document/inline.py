"""The parts of a sentence: words, names, commands, and numbers with their scale.

A sentence is worded once, with the numbers in it as numbers: a renderer writes each
with its unit and its interval, in one form everywhere.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import AS_IS, Ratio, Scale


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
    """A command to type; it never wraps."""

    text: str


@dataclass(frozen=True)
class Link:
    """The name of another page, and where it lies, as seen from this one."""

    text: str
    page: str


Inline = str | Number | Name | Word | Typed | Link
Parts = tuple[Inline, ...]
Said = Inline | Iterable["Said"] | None  # as a sentence is given


def text(*content: Said) -> Parts:
    """Return the parts of a sentence; None is left out, nested parts are flattened."""
    parts: list[Inline] = []
    for part in content:
        if isinstance(part, Inline):
            parts.append(part)
        elif part is not None:
            parts += text(*part)
    return tuple(parts)


def say(sentence: str, *content: Said) -> Parts:
    """Return the parts of a sentence whose braces are filled, in their order.

    Raises
    ------
    ValueError
        If there are more or fewer of them.
    """
    first, *rest = sentence.split("{}")
    pairs = zip(content, rest, strict=True)
    return text(first or None, [(part, words or None) for part, words in pairs])


def with_unit(number: Number | None) -> Parts:
    """Return a number of a table with its unit, where the head has none."""
    return (number, "") if number else ()


def counted(count: int, noun: str, plural: str = "") -> Parts:
    """Return a count with its noun: 1 trial, 2 trials."""
    return (Number(count), f" {noun if count == 1 else plural or noun + 's'}")


def listed(items: Sequence[Said], joint: str = "and") -> Parts:
    """Return a list in words: a; a and b; a, b and c. Without a joint only commas."""
    parts: list[Inline] = []
    for i, item in enumerate(items):
        if i:
            last = joint and i == len(items) - 1
            parts.append(f" {joint} " if last else ", ")
        parts += text(item)
    return tuple(parts)
