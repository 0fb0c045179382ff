"""What no study can hold, whatever the key: the too deep, too long, too large."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from tolstat.study.problems import Problems
from tolstat.units.grammar import MOST

DEEPEST = 16  # tables and lists inside each other
LONGEST, LONGEST_KEY = 10_000, 200  # characters
TOO_DEEP = f"more than {DEEPEST} tables or lists inside each other"

Path = tuple[Any, ...]


def check_bounds(table: Mapping[str, Any], problems: Problems) -> None:
    """Refuse what no key of a study can hold."""
    left: list[tuple[Path, Any]] = [((), table)]
    while left:
        path, value = left.pop()
        if path and (wrong := _unusable(value, path)):
            number = isinstance(value, int | float)
            problems.add(_key(path), value if number else None, wrong)
        if len(path) > DEEPEST:
            continue
        if isinstance(value, Mapping):
            left += reversed([((*path, key), each) for key, each in value.items()])
        elif isinstance(value, list):
            numbered = enumerate(value, start=1)
            left += reversed([((*path, f"value {i}"), each) for i, each in numbered])


def _unusable(value: Any, path: Path) -> str:
    """Say why a study cannot hold a value there; empty where it can."""
    if len(path) > DEEPEST:
        return TOO_DEEP
    if not isinstance(path[-1], str):
        return "a name is expected, a text"
    if wrong := _unusable_text(path[-1], "key", LONGEST_KEY):
        return wrong
    if isinstance(value, str):
        return _unusable_text(value, "text", LONGEST)
    if isinstance(value, float) and not math.isfinite(value):
        return "a finite number is expected"
    if isinstance(value, int | float) and abs(value) > MOST:
        return f"a number of at most {MOST:g} is expected"
    return ""


def _unusable_text(text: str, what: str, longest: int) -> str:
    if len(text) > longest:
        return f"a {what} of {len(text)} characters; up to {longest} are read"
    if "\0" in text:
        return f"a {what} holds the character NUL; leave it"
    try:
        text.encode()
    except UnicodeEncodeError:
        return f"a {what} holds half a character; leave it"
    return ""


def _key(path: Path) -> str:
    """Name a place in a study: "trials", "[deviations] rod_length, cp"."""
    section, *rest = map(str, path)
    return f"[{section}] {', '.join(rest)}" if rest else section
