"""Texts that hold a size and a tolerance together: "10 +-0.1 mm", "25 mm H7"."""

import re
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from tolstat.deviations import iso286
from tolstat.errors import UnitError
from tolstat.study.problems import Problems, toml_of
from tolstat.study.study_schema import Document
from tolstat.units.conversion import dimension
from tolstat.units.grammar import unit_of

NUMBER = r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
UNIT = r"[^\W\d_][\w/*^ .]*?|%|°|\"|'"
MIXED = re.compile(
    rf"[øØ⌀]?\s*(?P<size>[+-]?{NUMBER})\s*(?P<unit>{UNIT})?\s*\(?\s*(?:"
    rf"(?:\+-|\+/-|±)\s*(?P<half>{NUMBER})"
    rf"|(?P<one>[+-]\s*{NUMBER}|0)\s*(?:/|\.\.|\s)\s*(?P<other>[+-]\s*{NUMBER}|0)"
    rf"|(?P<grade>[A-Za-z]{{1,2}}\d{{1,2}})"
    rf")\s*\)?\s*(?P<last>{UNIT})?"
)


def separated(text: str) -> tuple[str, str] | None:
    """Return the size and the tolerance of a text that holds both; else None."""
    with suppress(UnitError):  # one quantity, or one range
        dimension(unit_of(text))
        return None
    parts = MIXED.fullmatch(text.strip())
    if parts is None:
        return None
    grade = parts["grade"]
    if grade and (parts["last"] or not iso286.looks_like_grade(grade)):
        return None
    last = parts["last"] or parts["unit"] or ""
    same = "" if last == "%" else last  # per cent is of the size
    unit = parts["unit"] or ("mm" if grade else same)
    size = f"{parts['size']} {unit}".strip()
    if grade:
        return size, grade
    ends = [(parts[name] or "").replace(" ", "") for name in ("one", "other")]
    zone = f"+-{parts['half']}" if parts["half"] else "..".join(sorted(ends, key=float))
    return size, f"{zone} {last}".strip()


def without_mixed(document: Document, problems: Problems) -> Document:
    """Return a study without entries whose text holds a size and a tolerance.

    A problem of each says how to write the two.
    """
    readable: dict[str, dict[str, Any]] = {}
    for section in ("links", "deviations"):
        entries = getattr(document, section)
        wrong = {n: words for n, e in entries.items() if (words := _wrong(section, e))}
        for name, words in wrong.items():
            problems.add(f"[{section}] {name}", entries[name], words)
        readable[section] = {n: e for n, e in entries.items() if n not in wrong}
    return document.model_copy(update=readable)


def _wrong(section: str, entry: Any) -> str:
    """Return what to write instead of an entry; empty if it holds no such text."""
    keys = dict(entry) if isinstance(entry, Mapping) else {"": entry}
    for key in ("", "nominal", "tolerance"):
        both = separated(keys[key]) if isinstance(keys.get(key), str) else None
        if both is None:
            continue
        size, zone = both
        typed = {key: value for key, value in keys.items() if key}
        if section == "links":
            typed = {"nominal": size, "tolerance": zone} | {
                k: value for k, value in typed.items() if value != keys[key]
            }
            return f"one text holds size and tolerance; write {toml_of(typed)}"
        written = toml_of(typed | {"tolerance": zone} if typed else zone)
        return f"a deviation has no size; write {written}"
    return ""
