"""The links of a chain, each as a table: a nominal value, and how it deviates.

A link is typed as a drawing writes it, "25 +0.1/-0.05 mm" or "Ø30 g6 mm", as a quantity
or as a table. A fit, "30 H7/g6 mm", is two links.
"""

import re
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from tolstat.deviations.limits_and_fits import looks_like_grade
from tolstat.errors import ModelError, UnitError
from tolstat.study.problems import toml_of
from tolstat.units.conversion import dimension
from tolstat.units.grammar import plain, unit_of

NOMINAL, TOLERANCE = "nominal", "tolerance"
OF_A_FIT = "hole", "shaft"
_NUMBER = r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_UNIT = r"[^\W\d_][\w/*^ .]*?|%|°|\"|'"
_GRADE = r"[A-Za-z]{1,2}\d{1,2}"
_BOTH = re.compile(
    rf"[øØ⌀]?\s*(?P<size>[+-]?{_NUMBER})\s*(?P<unit>(?!{_GRADE}){_UNIT})?\s*\(?\s*(?:"
    rf"(?P<zone>(?:\+-|\+/-|±)\s*{_NUMBER}"
    rf"|(?:[+-]\s*{_NUMBER}|0)\s*(?:/|\.\.)\s*(?:[+-]\s*{_NUMBER}|0))"
    rf"|(?P<one>[+-]\s*{_NUMBER}|0)\s+(?P<other>[+-]\s*{_NUMBER}|0)"
    rf"|(?P<grade>{_GRADE}(?:\s*/\s*{_GRADE})?)"
    rf")\s*\)?\s*(?P<last>{_UNIT})?"
)


def separated(text: str) -> tuple[str, str] | None:
    """Return the size and the tolerance of a text that holds both; else None."""
    with suppress(UnitError):  # one quantity, or one range
        dimension(unit_of(text))
        return None
    parts = _BOTH.fullmatch(plain(text))
    if parts is None:
        return None
    last = parts["last"] or parts["unit"] or ""
    same = "" if last == "%" else last  # per cent is of the size
    size = f"{parts['size']} {parts['unit'] or same}".strip()
    if grade := parts["grade"]:
        fit = "".join(grade.split())
        return (size, fit) if all(map(looks_like_grade, fit.split("/"))) else None
    zone = parts["zone"] or f"{parts['one']}/{parts['other']}"
    return size, f"{zone} {last}".strip()


def link_tables(links: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the links of a study as tables, by name; a fit is two.

    Raises
    ------
    ModelError, UnitError
        If a text cannot be read, or a link is given twice.
    """
    tables = dict[str, dict[str, Any]]()
    for name, link in links.items():
        tables |= tables_of(name, link, links)
    return tables


def tables_of(
    name: str, link: Any, links: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """Return one of the links of a study as a table, or the two of a fit, by name."""
    keys = dict(link) if isinstance(link, Mapping) else {NOMINAL: link}
    nominal = keys.get(NOMINAL)
    if isinstance(nominal, str) and (both := separated(nominal)):
        if TOLERANCE in keys:
            raise ModelError(f"{NOMINAL} holds a tolerance, too; give one of them")
        size, zone = both
        typed = {NOMINAL: size, TOLERANCE: zone}
        keys = typed | {k: x for k, x in keys.items() if k != NOMINAL}
    zone = keys.get(TOLERANCE)
    if not isinstance(zone, str):
        return {name: keys}
    if both := separated(zone):
        right = toml_of({**keys, TOLERANCE: both[1]})
        raise ModelError(f"a tolerance has no size; write {right}")
    hole, slash, shaft = (part.strip() for part in zone.partition("/"))
    if not (slash and looks_like_grade(hole)):
        return {name: keys}
    if not (hole[:1].isupper() and shaft[:1].islower()):
        raise ModelError(f"'{zone}': a fit is a hole and a shaft, such as H7/g6")
    names = [f"{name}_{part}" for part in OF_A_FIT]
    if twice := [part for part in names if part in links]:
        raise ModelError(
            f"a fit is two links, {' and '.join(names)}; {twice[0]} is given twice"
        )
    return {
        part: {**keys, TOLERANCE: grade}
        for part, grade in zip(names, (hole, shaft), strict=True)
    }


def typed_link(keys: Mapping[str, Any]) -> Any:
    """Return a link as a person types it: a nominal value alone is no table."""
    return keys[NOMINAL] if keys.keys() == {NOMINAL} else dict(keys)


def with_link(
    links: Mapping[str, Any], name: str, keys: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the links of a study, one of them with other keys.

    Other links stay as they are written. A fit of which one part changes is two links.
    """
    changed = dict[str, Any]()
    for other, link in links.items():
        tables = tables_of(other, link, links)
        changed |= tables | {name: keys} if name in tables else {other: link}
    return changed
