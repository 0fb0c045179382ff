"""Entries of a study as they are typed: NAME=TOLERANCE, "NAME <= VALUE"."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from typing import Any

from tolstat.errors import StudyError

NAMED = re.compile(r"\s*([^\W\d]\w*)\s*(\W.*?)\s*", re.DOTALL)


def deviations_in(texts: Sequence[str]) -> dict[str, Any]:
    """Read deviations: NAME=TOLERANCE, or NAME={ ... } as in TOML."""
    found: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip():
            raise StudyError(f'{text}: NAME=TOLERANCE, such as rod_length="+-0.6 mm"')
        if name.strip() in found:
            raise StudyError(f"{text}: {name.strip()} is given twice")
        found[name.strip()] = value_in(value, text)
    return found


def limits_in(texts: Sequence[str]) -> dict[str, Any]:
    """Read limits: "NAME <= 120 kN", or NAME = { ... } as in TOML."""
    found: dict[str, Any] = {}
    for text in texts:
        named = NAMED.fullmatch(text)
        if not named:
            raise StudyError(f'--limit "{text}": such as "rod_force <= 120 kN"')
        if named[1] in found:
            raise StudyError(f'--limit "{text}": {named[1]} is given twice')
        rest = named[2].strip()
        found[named[1]] = value_in(rest[1:], text) if rest[0] == "=" else rest
    return found


def value_in(value: str, text: str) -> Any:
    """Read a value: as of TOML in braces or quotes, else a text."""
    value = value.strip()
    if value[:1] not in ("{", '"', "'"):
        return value
    try:
        return tomllib.loads(f"value = {value}")["value"]
    except (ValueError, RecursionError) as error:
        raise StudyError(f"{text}: {error}") from None
