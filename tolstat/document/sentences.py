"""Sentences: their parts joined, braces filled, things counted and listed."""

from collections.abc import Sequence

from tolstat.document.inline import Inline, Number, Parts, Said


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
