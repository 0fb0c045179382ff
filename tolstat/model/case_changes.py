"""The cases of a study as they are typed: tables by case, or lists of values."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError, UnitError
from tolstat.model.setting_kinds import as_typed
from tolstat.units.conversion import from_si
from tolstat.units.grammar import measure

MOST_CASES = 500
AXIS_KEYS = "from", "to", "points"
AXIS = 'b = { from = "9.5 mm", to = "9.65 mm", points = 31 }'
EXAMPLE = 'cold = { dT = "-40 K" } or b = ["9.5 mm", "9.6 mm"]'


class CaseAxis(NamedTuple):
    """What cases change, where it is a number."""

    name: str
    unit: str  # SI
    shown: str  # the unit in which it is written
    values: Array  # float64[case], SI


def changes_of(cases: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return what each case changes, as typed, by its name.

    Raises
    ------
    ModelError
        If it is neither tables nor lists of the same length.
    """
    lists = {
        name: [*_values(name, values)]
        for name, values in cases.items()
        if isinstance(values, list)
        or (isinstance(values, Mapping) and "from" in values)
    }
    if not lists:
        for name, changes in cases.items():
            if not isinstance(changes, Mapping) or not changes:
                raise ModelError(f"{name}: a table or a list is expected, as {EXAMPLE}")
        return {name: dict(changes) for name, changes in cases.items()}
    if other := [name for name in cases if name not in lists]:
        raise ModelError(
            f"{next(iter(lists))} has a list, and {other[0]} has none; give tables of "
            f"cases, or lists: {EXAMPLE}"
        )
    lengths = {name: len(values) for name, values in lists.items()}
    if len({*lengths.values()}) > 1:
        words = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise ModelError(f"lists of cases have the same length, not {words}")
    rows = zip(*lists.values(), strict=True)
    return {
        str(number): dict(zip(lists, row, strict=True))
        for number, row in enumerate(rows, start=1)
    }


def condition_words(changes: Mapping[str, Any]) -> str:
    """Return what a case changes, in words."""
    return ", ".join(f"{key} {as_typed(value)}" for key, value in changes.items())


def case_axis(cases: Mapping[str, Any]) -> CaseAxis | None:
    """Return what cases change; None unless it is one number."""
    with suppress(ModelError, UnitError):
        changes = changes_of(cases)
        names = {name for row in changes.values() for name in row}
        if len(names) == 1 and len(changes) > 1:
            (name,) = names
            typed = [str(row[name]) for row in changes.values()]
            sizes = [measure(text) for text in typed]
            if len({size.unit for size in sizes}) == 1:
                values = np.array([size.value for size in sizes])
                return CaseAxis(name, sizes[0].unit, sizes[0].shown, values)
    return None


def _values(name: str, values: Any) -> Iterator[Any]:
    """Yield the values of a list, or of points between two ends, as typed."""
    if isinstance(values, list):
        if not values:
            raise ModelError(f"{name}: the list is empty; {EXAMPLE}")
        yield from values
        return
    points = values.get("points")
    if isinstance(points, int) and points > MOST_CASES:
        raise ModelError(f"{points} cases; at most {MOST_CASES}")
    if {*values} != {*AXIS_KEYS} or not isinstance(points, int) or points < 2:
        raise ModelError(f"{name}: {', '.join(AXIS_KEYS)} are expected, as {AXIS}")
    first, last = (measure(str(values[end])) for end in AXIS_KEYS[:2])
    if first.unit != last.unit or first.value == last.value:
        raise ModelError(f"{name}: two ends of one kind are expected, as {AXIS}")
    for value in np.linspace(first.value, last.value, points).tolist():
        number = f"{from_si(value, first.unit, first.shown):.12g}"
        if isinstance(values["from"], str):
            yield number if first.shown == "1" else f"{number} {first.shown}"
        else:
            yield int(number) if number.isdecimal() else float(number)
