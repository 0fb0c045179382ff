"""Units that a study is written in, for quantities that it gives no unit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from tolstat.errors import UnitError
from tolstat.units.conversion import dimension, si_unit
from tolstat.units.grammar import unit_of
from tolstat.units.scale import SIZES

SECTIONS = ("settings", "links", "deviations", "grid", "limits")
INCH = "in"


def typed_units(study: Mapping[str, Any]) -> dict[str, str]:
    """Return the unit of each kind of quantity, by SI unit, where all entries agree.

    A study with all speeds in rpm has {"rad/s": "rpm"}. Where the size of a quantity
    decides its unit, mm or um, it is left out, unless all lengths are in inches.
    """
    found: dict[str, set[str]] = {}
    for text in _texts([study.get(section) for section in SECTIONS]):
        with suppress(UnitError):  # a word, a formula, the name of a file
            unit = unit_of(text)
            found.setdefault(si_unit(dimension(unit)), set()).add(unit)
    agreed = {si: units.pop() for si, units in found.items() if len(units) == 1}
    return {si: u for si, u in agreed.items() if si not in SIZES or u == INCH}


def _texts(given: Any) -> Iterator[str]:
    """Yield all texts of nested tables and lists."""
    if isinstance(given, str):
        yield given
    elif isinstance(given, Mapping):
        yield from _texts(list(given.values()))
    elif isinstance(given, list):
        for each in given:
            yield from _texts(each)
