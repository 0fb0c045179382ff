"""Kinds of settings: how each is read from a study, checked, and written."""

import json
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from tolstat.errors import ModelError, allowed_names
from tolstat.units import grammar
from tolstat.units.conversion import check_si
from tolstat.units.scale import tidy

MOST_WHOLE = 2**53  # up to this number floats hold every whole number


NO_ROWS = "{}"  # an empty table, as written


def as_typed(value: Any, *, quoted: bool = False) -> str:
    """Return a value as written in a study file; texts without quotes by default."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False) if quoted else value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        cells = [f"{k} = {as_typed(v, quoted=quoted)}" for k, v in value.items()]
        return "{ " + ", ".join(cells) + " }" if cells else NO_ROWS
    if isinstance(value, Sequence):
        return "[" + ", ".join(as_typed(item, quoted=quoted) for item in value) + "]"
    return tidy(f"{value}")


class Kind(ABC):
    """How a setting is read, checked and written."""

    @property
    @abstractmethod
    def allowed(self) -> str:
        """Allowed values, in words."""

    @property
    def schema(self) -> dict[str, Any]:
        """The JSON Schema of values in a study file."""
        return {"type": ["string", "number"]}

    @abstractmethod
    def checked(self, value: Any, *, typed: bool = False) -> Any:
        """Return a value of Python, SI, or as typed in a study; refuse a wrong one."""

    def read(self, value: Any) -> Any:
        """Return a value from a study file."""
        return self.checked(value, typed=True)

    def words(self, value: Any) -> str:
        """Return a value as text, as a study has it."""
        return as_typed(value)


@dataclass(frozen=True)
class Number(Kind):
    """A number, with its unit where it has one.

    Its bounds are excluded (`above`) or included.
    """

    unit: str = ""  # SI; empty or "1" without
    above: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    presets: Mapping[str, float | None] = field(default_factory=dict)  # words for it
    whole: bool = False

    @property
    def _has_unit(self) -> bool:
        return self.unit not in ("", "1")

    def checked(self, value: Any, *, typed: bool = False) -> Any:
        presets = self.presets
        if isinstance(value, str) and value in presets:
            return presets[value]
        if value is None and None in presets.values():
            return None
        if typed and self._has_unit and not isinstance(value, str):
            raise ModelError(
                f'a quantity with its unit is expected, "{value} {self.unit}"'
            )
        if typed and self.unit and isinstance(value, str):
            value = grammar.quantity(value, self.unit)
        if isinstance(value, bool) or not isinstance(value, int | float):
            words = f", or one of {', '.join(presets)}" if presets else ""
            bare = typed and isinstance(value, str)
            words += ", without quotes and unit" if bare and not words else ""
            raise ModelError(f"a number is expected{words}")
        if isinstance(value, float) and not math.isfinite(value):
            raise ModelError("a finite number is expected")
        if abs(value) > (most := MOST_WHOLE if self.whole else grammar.MOST_NUMBER):
            raise ModelError(f"it must be at most {most:g}")
        if self.whole and value != int(value):
            raise ModelError("a whole number is expected")
        value = int(value) if self.whole else float(value)
        if self.above is not None and not value > self.above:
            raise ModelError(f"it must be above {self._bound(self.above)}")
        if self.at_least is not None and not value >= self.at_least:
            raise ModelError(f"it must be at least {self._bound(self.at_least)}")
        if self.at_most is not None and not value <= self.at_most:
            raise ModelError(f"it must be at most {self._bound(self.at_most)}")
        return value

    def words(self, value: Any) -> str:
        for word, stands_for in self.presets.items():
            if value == stands_for:
                return word
        return self._bound(value)

    def _bound(self, value: float) -> str:
        return grammar.typed(self.unit or "1", value)

    @property
    def allowed(self) -> str:
        ends = {"above": self.above, "from": self.at_least, "to": self.at_most}
        bounds = [f"{w} {self._bound(b)}" for w, b in ends.items() if b is not None]
        unit = [self.unit] if self._has_unit and not bounds else []
        kind = "whole number" if self.whole else "number"
        words = " ".join([kind, *bounds, *unit])
        return f"{words}, or {', '.join(self.presets)}" if self.presets else words

    @property
    def schema(self) -> dict[str, Any]:
        if not self.unit and not self.presets:
            return {"type": "integer" if self.whole else "number"}
        return {"type": "string" if self._has_unit else ["number", "string"]}


@dataclass(frozen=True)
class Quantity(Kind):
    """A number with a unit of any kind: the size of a link."""

    allowed = "quantity with its unit"

    def checked(self, value: Any, *, typed: bool = False) -> grammar.Measure:
        if typed and isinstance(value, str):
            return grammar.measure(value)
        if typed:
            value = (value, "1", "1") if isinstance(value, int | float) else ()
        if isinstance(value, str) or not isinstance(value, Sequence):
            value = ()
        if len(value) not in (2, 3):
            example = '"60 mm"' if typed else '(0.06, "m")'
            raise ModelError(f"a quantity is expected, such as {example}")
        number, unit, *unit_typed = value
        check_si(unit)
        return grammar.Measure(Number().checked(number), unit, *unit_typed)

    def words(self, value: grammar.Measure) -> str:
        return Number(value.unit).words(value.value)


@dataclass(frozen=True)
class Word(Kind):
    """One of a few words."""

    choices: tuple[str, ...]

    def checked(self, value: Any, *, typed: bool = False) -> str:
        if value not in self.choices:
            raise ModelError(allowed_names(str(value), self.choices))
        return str(value)

    @property
    def allowed(self) -> str:
        return ", ".join(self.choices)

    @property
    def schema(self) -> dict[str, Any]:
        return {"enum": list(self.choices)}


@dataclass(frozen=True)
class Boolean(Kind):
    """True or false."""

    allowed = "true, false"

    @property
    def schema(self) -> dict[str, Any]:
        return {"type": "boolean"}

    def checked(self, value: Any, *, typed: bool = False) -> bool:
        if not isinstance(value, bool):
            raise ModelError("true or false is expected, without quotes")
        return value


@dataclass(frozen=True)
class Text(Kind):
    """Any text, such as a formula; the model checks it."""

    allowed = "text"

    def checked(self, value: Any, *, typed: bool = False) -> str:
        if not isinstance(value, str):
            raise ModelError("a text is expected, in quotes")
        return value


@dataclass(frozen=True)
class Interval(Kind):
    """A range, "850..1700 rpm"; each of its ends is a number of that kind."""

    each: Number

    def checked(self, value: Any, *, typed: bool = False) -> grammar.Range:
        unit = self.each.unit
        if typed and not isinstance(value, str):
            example = f"1..2 {unit if unit != '1' else ''}".strip()
            raise ModelError(f'a range is expected, such as "{example}"')
        if typed:
            value = grammar.quantity_range(value, unit)
        ends = tuple(value) if isinstance(value, Sequence) else ()
        if len(ends) != 2:
            raise ModelError("two numbers are expected: lower and upper end")
        lower, upper = (self.each.checked(end) for end in ends)
        if not lower < upper:
            raise ModelError("the lower end of a range comes first")
        return grammar.Range(lower, upper)

    def words(self, value: Any) -> str:
        return grammar.typed(self.each.unit, *value)

    @property
    def allowed(self) -> str:
        return f"range of {self.each.allowed}"


@dataclass(frozen=True)
class Numbers(Kind):
    """Several numbers of one kind; a single one stands for a list of one."""

    each: Number
    least: int = 1
    most: int = 10_000

    def checked(self, value: Any, *, typed: bool = False) -> tuple[Any, ...]:
        values = value.tolist() if isinstance(value, np.ndarray) else value
        several = isinstance(values, Sequence) and not isinstance(values, str)
        items = list(values) if several else [values]
        if not self.least <= len(items) <= self.most:
            most = "" if self.least == self.most else f" to {self.most}"
            words = f"{self.least}{most} are expected"
            raise ModelError(f"{len(items)} numbers; {words}")
        numbers = []
        for position, item in enumerate(items, start=1):
            try:
                numbers.append(self.each.checked(item, typed=typed))
            except ValueError as error:
                raise ModelError(f"number {position}: {error}") from None
        return tuple(numbers)

    def words(self, value: tuple[Any, ...]) -> str:
        return as_typed([self.each.words(item) for item in value])

    @property
    def allowed(self) -> str:
        return f"list: {self.each.allowed}"

    @property
    def schema(self) -> dict[str, Any]:
        items = self.each.schema
        return {"anyOf": [items, {"type": "array", "items": items}]}


class Column(NamedTuple):
    """One column of a table: its description, and its kind of setting."""

    sentence: str
    kind: Kind


@dataclass(frozen=True)
class Rows(Kind):
    """Rows of several columns: points in time, or by name the links of a chain."""

    columns: Mapping[str, Column]  # every row has all of them
    named: bool  # whether it is a table by name, or a list

    def checked(self, value: Any, *, typed: bool = False) -> Any:
        if self.named:
            if not isinstance(value, Mapping):
                words = "a table by name is expected, such as"
                raise ModelError(f"{words} {self._example}")
            return {str(n): self._row(str(n), row, typed) for n, row in value.items()}
        if isinstance(value, str | Mapping) or not isinstance(value, Sequence):
            raise ModelError(f"a list of rows is expected, such as {self._example}")
        return tuple(self._row(f"row {i}", r, typed) for i, r in enumerate(value, 1))

    def _row(self, name: str, row: Any, typed: bool) -> dict[str, Any]:
        if not isinstance(row, Mapping):  # a table of one column needs no second level
            if len(self.columns) > 1:
                raise ModelError(f"{name}: {', '.join(self.columns)} are expected")
            row = {next(iter(self.columns)): row}
        for key in row:
            if key not in self.columns:
                raise ModelError(
                    f"{name}: no key {key}; {allowed_names(key, self.columns)}"
                )
        cells = {}
        for key, column in self.columns.items():
            if key not in row:
                raise ModelError(f"{name}: the key {key} is missing: {column.sentence}")
            try:
                cells[key] = column.kind.checked(row[key], typed=typed)
            except ValueError as error:
                raise ModelError(f"{name}: {key} = {row[key]!r}: {error}") from None
        return cells

    def words(self, value: Any) -> str:
        def row_words(row: Mapping[str, Any]) -> str:
            cells = {k: c.kind.words(row[k]) for k, c in self.columns.items()}
            (first, *others) = cells.values()
            return as_typed(cells) if others or not self.named else first

        if self.named:
            return as_typed({name: row_words(row) for name, row in value.items()})
        return as_typed([row_words(row) for row in value])

    @property
    def schema(self) -> dict[str, Any]:
        return {"type": "object" if self.named else "array"}

    @property
    def _example(self) -> str:
        cells = ", ".join(f"{key} = ..." for key in self.columns)
        return f"{{ NAME = {{ {cells} }} }}" if self.named else f"[{{ {cells} }}]"

    @property
    def allowed(self) -> str:
        columns = self.columns.items()
        described = (f"{k} ({c.kind.allowed}): {c.sentence}" for k, c in columns)
        kind = "table by name" if self.named else "list of rows"
        return f"{kind} with {'; '.join(described)}"
