"""Units of FMUs: by the exponents of their base units, as names differ between tools.

The names of FMI are spelled otherwise than ours: "kg.m2", "m/s2", "rev/min".
"""

import re
from collections.abc import Mapping
from typing import NamedTuple

from tolstat.errors import UnitError
from tolstat.units.conversion import check_si, dimension, from_si, si_unit

BASES = ("kg", "m", "s", "A", "K", "rad")
UNKNOWN = ("mol", "cd")  # to tolstat
NAMES = {"rev/min": "rpm", "1/min": "", "Ohm": "ohm", "degree": "deg"}


class BaseUnit(NamedTuple):
    """A unit of an FMU, by its base units: SI = factor * value + offset."""

    exponents: Mapping[str, int]
    factor: float
    offset: float

    @classmethod
    def read(cls, attributes: Mapping[str, str]) -> "BaseUnit":
        """Return the unit of the attributes of a BaseUnit."""
        exponents = {
            name: int(attributes[name])
            for name in (*BASES, *UNKNOWN)
            if int(attributes.get(name, "0"))
        }
        numbers = attributes.get("factor", "1"), attributes.get("offset", "0")
        return cls(exponents, *map(float, numbers))


class FmuUnit(NamedTuple):
    """How values of a variable are read: SI = factor * value + offset."""

    si: str  # our name; "1" for a plain number
    factor: float = 1.0
    offset: float = 0.0
    display: str = ""  # unit in which it is shown; by its size if empty
    own: str = ""  # the FMU's name of it, where tolstat has a plain number

    def to_si(self, value: float) -> float:
        """Return a value of the FMU in SI."""
        return self.factor * value + self.offset

    def from_si(self, value: float) -> float:
        """Return a value in SI as the FMU takes it."""
        if self.factor == 1.0 and self.offset == 0.0:
            return value
        return (value - self.offset) / self.factor

    def named_in(self, sentence: str) -> str:
        """Return a description with the FMU's unit of a plain number."""
        return f"{sentence} in {self.own}".strip() if self.own else sentence


PLAIN = FmuUnit("1", display="1")


def unit_of_variable(name: str, chosen: str, units: Mapping[str, BaseUnit]) -> FmuUnit:
    """Return the unit of a variable, by the name that the FMU gives it.

    A unit without base units is read by its name. One that tolstat does not know, such
    as of an amount of substance, is a plain number; so is one with an offset.
    """
    if not name:
        return PLAIN
    told = name.isprintable() and re.search(r"[^\W\d_]", name)  # not "-", "1"
    plain = PLAIN._replace(own=name) if told else PLAIN
    spelled = _spelled(name)
    if name not in units:
        if name == "degC":  # ours is a difference
            return plain
        try:
            si = si_unit(dimension(spelled))
            return FmuUnit(si, from_si(1.0, spelled, si), 0.0, spelled)
        except UnitError:
            return plain
    base = units[name]
    if base.offset or any(part in base.exponents for part in UNKNOWN):
        return plain
    words = " ".join(f"{part}^{abs(n)}" for part, n in base.exponents.items() if n > 0)
    words += "".join(f"/{part}^{abs(n)}" for part, n in base.exponents.items() if n < 0)
    try:
        kind = dimension(words or "1")
        si = si_unit(kind)
    except UnitError:
        return plain
    if si == "1":
        return FmuUnit("1", base.factor, base.offset, "1")
    if base[1:] == (1.0, 0.0) and _is_si(spelled, kind):
        si = spelled
    written = (_spelled(text) for text in (chosen, name if base.factor != 1.0 else ""))
    display = next((text for text in written if text and _same(text, kind)), "")
    return FmuUnit(si, base.factor, base.offset, display)


def _spelled(name: str) -> str:
    """Return the name of a unit as we spell it."""
    if name in NAMES:
        return NAMES[name]
    return re.sub(r"([A-Za-z])(-?\d)", r"\1^\2", name).replace(".", " ")


def _same(unit: str, kind: object) -> bool:
    """Return whether a unit is of a kind; degC is not, as ours is a difference."""
    try:
        return unit != "degC" and bool(dimension(unit) == kind)
    except UnitError:
        return False


def _is_si(unit: str, kind: object) -> bool:
    try:
        check_si(unit)
    except UnitError:
        return False
    return _same(unit, kind)
