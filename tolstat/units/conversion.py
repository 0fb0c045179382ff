"""Units: known names, combined with * / and small powers, converted by pint.

An angle is a dimension of its own: 7.5 Hz is not 7.5 rad/s, and a phase is not a plain
number.
"""

import math
import re
from functools import cache
from typing import Any

from tolstat.errors import UnitError, allowed_names
from tolstat.units.typography import typed_unit

POWERS = {"p": "1e-12", "n": "1e-9", "u": "1e-6", "m": "1e-3", "c": "1e-2", "": "1",
          "k": "1e3", "M": "1e6", "G": "1e9"}  # fmt: skip


def _prefixed(prefixes: str, name: str, meaning: str) -> dict[str, str]:
    """Return a unit with some prefixes, as defined; a blank is none."""
    letters = map(str.strip, prefixes)
    return {prefix + name: f"{POWERS[prefix]} {meaning}" for prefix in letters}


CELSIUS = "degC"
# what each known name means in SI base units (kg m s rad K A)
MEANINGS = {
    "1": "1",
    "count": "1",
    "%": "0.01",
    "ppm": "1e-6",
    **_prefixed(" kcmun", "m", "m"),
    "in": "0.0254 m",
    "ft": "0.3048 m",
    "mil": "25.4e-6 m",
    "thou": "25.4e-6 m",
    "kg": "kg",
    "g": "1e-3 kg",
    "mg": "1e-6 kg",
    "t": "1e3 kg",
    "lb": "0.45359237 kg",
    **_prefixed(" mu", "s", "s"),
    "min": "60 s",
    "h": "3600 s",
    **_prefixed("m kMG", "Hz", "/ s"),
    **_prefixed(" mu", "rad", "rad"),
    "deg": f"{math.pi / 180!r} rad",
    "arcmin": f"{math.pi / 10800!r} rad",
    "arcsec": f"{math.pi / 648000!r} rad",
    "rpm": f"{math.pi / 30!r} rad / s",
    **_prefixed("um kM", "N", "kg m / s^2"),
    "lbf": "4.4482216152605 kg m / s^2",
    **_prefixed("num kM", "J", "kg m^2 / s^2"),
    **_prefixed("um kM", "W", "kg m^2 / s^3"),
    **_prefixed(" kMG", "Pa", "kg / m / s^2"),
    "bar": "1e5 kg / m / s^2",
    "psi": f"{4.4482216152605 / 0.0254**2!r} kg / m / s^2",
    **_prefixed(" m", "K", "K"),
    CELSIUS: "K",  # a difference
    **_prefixed(" numk", "A", "A"),
    **_prefixed(" numkM", "V", "kg m^2 / s^3 / A"),
    **_prefixed(" umkMG", "ohm", "kg m^2 / s^3 / A^2"),
    **_prefixed(" pnum", "F", "s^4 A^2 / kg / m^2"),
    **_prefixed(" num", "H", "kg m^2 / s^2 / A^2"),
}

BASES = {"kg": "mass", "m": "length", "s": "time", "rad": "angle",
         "K": "temperature", "A": "current"}  # fmt: skip
# products of units that people name so
PRODUCTS = ("N/m", "N m/rad", "N s/m", "N m s/rad", "N/K", "W/K", "V/K", "V/m", "V s")

MOST_POWER = 4
FAHRENHEIT = "°F", "degF"
LONGEST_UNIT = 100  # characters

SPELLINGS = {"°": "deg", "°C": CELSIUS}
_LETTERS = str.maketrans({"µ": "u", "μ": "u", "Ω": "ohm"})

_NAME = r"([A-Za-zµμ%°Ω]+|1(?=\s*(?:/|$)))(?:(?:\^|\*\*)(-?[1-4]))?"
_FACTOR = re.compile(rf"([*/]?)\s*{_NAME}")
_UNIT = re.compile(rf"\s*(?:/?\s*{_NAME}(?:\s*[*/\s]\s*{_NAME})*)?\s*")


def to_si(value: float, given: str, unit: str) -> float:
    """Return a number in the expected SI unit; "" is a bare number.

    A unit that is unknown or of another kind is a UnitError.
    """
    if dimension(given) != dimension(unit):
        raise UnitError(_wrong_kind(given, unit))
    return from_si(value, given, unit)


def from_si(value: float, unit: str, shown: str) -> float:
    """Return a number of one unit in another of the same kind."""
    return value * (_measure(unit)[0] / _measure(shown)[0])


def same_unit(first: str, second: str) -> bool:
    """Return whether two spellings are one unit, such as µm and um."""
    return bool(_measure(first) == _measure(second))


def check_si(unit: str) -> None:
    """Refuse a unit that is unknown or not SI, such as mm: a UnitError."""
    if _measure(unit)[0] != 1.0 or unit == "count":
        raise UnitError(f"'{unit}' is not an SI unit; use one, and shown=\"{unit}\"")


def dimension(unit: str) -> Any:
    """Return the dimension of a unit, to be multiplied, divided, raised, compared."""
    return _measure(unit)[1]


def si_unit(dimension: Any) -> str:
    """Return the SI unit of a dimension, "N" or "m^2"; powers are whole, up to 4."""
    for name in MEANINGS:
        if name != "count" and _measure(name) == (1.0, dimension):
            return name
    if product := next((x for x in PRODUCTS if _measure(x)[1] == dimension), ""):
        return product
    numerator, denominator = "", ""
    for base, kind in BASES.items():
        power = dimension.get(f"[{kind}]", 0)
        if power != int(power) or abs(power) > MOST_POWER:
            raise UnitError(f"{dimension} has no unit: powers are whole, up to 4")
        word = base if abs(power) == 1 else f"{base}^{abs(power):.0f}"
        if power > 0:
            numerator += f" {word}"
        elif power < 0:
            denominator += f"/{word}"
    return (numerator.strip() or "1") + denominator


def known_name(written: str) -> str:
    """Return the name of a single unit that may be spelled otherwise, such as °C."""
    return SPELLINGS.get(written, written.translate(_LETTERS))


@cache
def _registry() -> Any:
    """Return pint with tolstat's names only: its defaults accept hm and Bq."""
    import pint

    return pint.UnitRegistry([f"{name} = [{kind}]" for name, kind in BASES.items()])


@cache
def _measure(unit: str) -> tuple[float, Any]:
    """Return the SI factor and the dimensions of a unit."""
    if len(unit) > LONGEST_UNIT:
        raise UnitError(f"'{unit[:20]}...' is not a unit: {len(unit)} characters")
    unit = typed_unit(unit)
    if not _UNIT.fullmatch(unit):
        raise UnitError(
            f"the unit '{unit}' cannot be read; units are known names joined by * and "
            "/, with powers such as ^2"
        )
    total = _registry().Quantity(1.0)
    for sign, written, power in _FACTOR.findall(unit):
        name = known_name(written)
        if name in FAHRENHEIT:
            raise UnitError(f"unknown unit '{name}': Fahrenheit is not read; give °C")
        if name not in MEANINGS:
            raise UnitError(f"unknown unit '{name}'; {allowed_names(name, MEANINGS)}")
        exponent = int(power or 1) * (-1 if sign == "/" else 1)
        total *= _registry()(MEANINGS[name]) ** exponent
    base = total.to_base_units()
    return float(base.magnitude), base.dimensionality


def _wrong_kind(given: str, unit: str) -> str:
    expected = f"in {unit}" if unit != "1" else "as a plain number or in %"
    same = [name for name in MEANINGS if dimension(name) == dimension(unit)]
    if len(same) > 1 and unit != "1":
        expected += f" (or {', '.join(u for u in same if u != unit)})"
    if dimension(unit) == dimension("rad/s"):
        hint = "rad/s, deg/s or rpm"
        if given and dimension(given) == dimension("Hz"):
            return (
                f"an angular speed is given in {hint}; '{given}' leaves open whether "
                "turns or radians are meant (1 Hz of turning is 60 rpm)"
            )
        expected = f"in {hint}"
    if not given:
        return f"the unit is missing; the value is expected {expected}"
    return f"'{given}' is of another kind; the value is expected {expected}"
