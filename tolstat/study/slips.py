"""Slips in a study, and what to write instead, beyond what its readers refuse.

Keys at the top that belong in a section; texts that hold a size and a tolerance
together, "10 +-0.1 mm", "25 mm H7"; and problems that show without the model.
"""

import re
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from tolstat import catalogue
from tolstat.deviations import grades
from tolstat.deviations.names import expand
from tolstat.errors import TolstatError, UnitError
from tolstat.model.checked import described
from tolstat.model.contract import Model
from tolstat.model.description import Contributor
from tolstat.model.setting_kinds import Text
from tolstat.model.settings import read, settings_of
from tolstat.study.distribution_entry import keys_of, read_distribution
from tolstat.study.limits_section import read_limit
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.problems import Problems, toml_of
from tolstat.study.settings_section import (
    NOMINAL,
    keys_of_link,
    link_columns,
    settings_with_links,
)
from tolstat.study.study_schema import Document
from tolstat.units.conversion import dimension, si_unit
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
# what depends on names, sizes or files of the study
DEPENDENT = ("size", "common", "cost", "nominal_shift", "iso1328", "module")


def section_of(
    name: str, value: Any, table: Mapping[str, Any], model: Model | None
) -> str:
    """Return the section where a key of a study belongs; empty if in none.

    A name of several kinds is what its value can be.
    """
    setting = None
    with suppress(TolstatError, AttributeError, TypeError):
        model = model or catalogue.find(str(table.get("model")))
        setting = settings_of(model).get(name)
        if setting and not isinstance(setting.kind, Text):
            with suppress(TolstatError):
                setting.kind.read(value)
                return "settings"
        if name in table.get("links", {}):
            return "links"
        settings = read(model, settings_with_links(table, model))
        contributors, responses = described(model, settings)
        with suppress(TolstatError):
            if expand(name, [part.name for part in contributors]):
                return "deviations"
        with suppress(TolstatError):
            by_name = {response.name: response for response in responses}
            response = by_name[expand(name, [*by_name])[0]]
            if not setting or read_limit(value, response.unit, response.shown):
                return "limits"
    return "settings" if setting else ""


def separated(text: str) -> tuple[str, str] | None:
    """Return the size and the tolerance of a text that holds both; else None."""
    with suppress(UnitError):  # one quantity, or one range
        dimension(unit_of(text))
        return None
    parts = MIXED.fullmatch(text.strip())
    if parts is None:
        return None
    grade = parts["grade"]
    if grade and (parts["last"] or not grades.looks_like_grade(grade)):
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


def note_readable(document: Document, model: Model | None, problems: Problems) -> None:
    """Note what is wrong in deviations and limits whatever the model's names are.

    For a study whose model or settings are wrong: an entry is read in the unit that it
    is written in. What needs the model is left for the next time.
    """
    columns = {NOMINAL}
    with suppress(TolstatError, AttributeError):
        columns |= {*link_columns(model)} if model else set()
    for section, read_keys in (("links", keys_of_link), ("deviations", keys_of)):
        for name, entry in getattr(document, section).items():
            keys = {
                k: value
                for k, value in read_keys(entry).items()
                if k not in {*columns, *DEPENDENT}
            }
            zone, key = str(keys.get("tolerance", "")), f"[{section}] {name}"
            shares = any("%" in str(value) for value in keys.values())
            of_a_size = shares or (zone and grades.looks_like_grade(zone))
            if not keys or "data" in keys or of_a_size or problems.noted(key):
                continue
            with problems.noting(key, keys):
                unit = _unit(str(keys.get("tolerance", keys.get("value", ""))))
                reader = DeviationReader(Contributor(name, unit, shown="1"))
                read_distribution(keys, reader)
    for name, entry in document.limits.items():
        text = entry if isinstance(entry, str) else str(entry.get("limit", ""))
        with problems.noting(f"[limits] {name}", entry):
            unit = _unit(text)
            read_limit(entry, unit, unit)  # in which it is shown, the model knows


def _unit(text: str) -> str:
    """Return the SI unit at the end of a text; that of a number where it has none."""
    written = re.search(r"[^\W\d_][^\s.]*$", text.strip())
    with suppress(UnitError):
        return si_unit(dimension(written[0] if written else "1"))
    return "1"
