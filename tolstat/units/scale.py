"""The unit that a quantity is shown in: as typed, as declared, or fitting its size."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from tolstat.units.conversion import from_si

PLAIN, COUNT = "1", "count"
FIGURES = 4  # of a number that has no interval
MOST_FIGURES = 6  # of one that has: machines are not integrated more precisely
NOTHING = 1e-6  # of a size, up to the next power of ten: zero to an engineer

# by SI unit: what it is shown in, the largest first, each from which size on (SI); the
# last also serves what is smaller
SIZES = {
    "1": (("%", 0.0),),
    "m": (("m", 100.0), ("mm", 1e-4), ("um", 1e-7), ("nm", 0.0)),
    "rad": (("rad", 10.0), ("mrad", 1e-5), ("urad", 0.0)),
    "N": (("MN", 1e7), ("kN", 10.0), ("N", 0.1), ("mN", 1e-4), ("uN", 0.0)),
    "J": (
        ("MJ", 1e7), ("kJ", 10.0), ("J", 0.1), ("mJ", 1e-4), ("uJ", 1e-7), ("nJ", 0.0),
    ),
    "W": (("MW", 1e7), ("kW", 10.0), ("W", 0.1), ("mW", 1e-4), ("uW", 0.0)),
    "N m": (("MN m", 1e7), ("kN m", 10.0), ("N m", 1e-2), ("mN m", 0.0)),
    "Pa": (("GPa", 1e10), ("MPa", 1e4), ("kPa", 10.0), ("Pa", 0.0)),
    "Hz": (("kHz", 1e5), ("Hz", 1e-2), ("mHz", 0.0)),
    "s": (("s", 0.1), ("ms", 1e-5), ("us", 0.0)),
}  # fmt: skip
# of these, what stands where no size is known
USUAL = {"m": "mm", "rad": "mrad", "N": "kN", "J": "kJ", "W": "kW", "N m": "kN m",
         "Pa": "MPa", "Hz": "Hz", "s": "s"}  # fmt: skip


class Scale(NamedTuple):
    """How a quantity is held and how it is shown.

    Attributes
    ----------
    unit : str
        SI unit of its numbers.
    shown : str
        Unit in which people read it; "1" is a plain number, "count" a whole one.
    least : float
        A power of ten, in the unit shown: what is smaller is said to be below it.
    """

    unit: str
    shown: str
    least: float = 0.0

    @property
    def factor(self) -> float:
        """What an SI number is multiplied with to be shown."""
        return from_si(1.0, self.unit, self.shown)

    @property
    def mark(self) -> str:
        """What stands behind a number: the unit, or nothing."""
        return "" if self.shown in (PLAIN, COUNT) else self.shown

    def beside(self, size: float) -> Scale:
        """Return it with what is nothing beside numbers of a size, SI."""
        shown = NOTHING * abs(float(from_si(size, self.unit, self.shown)))
        known = shown > 0 and math.isfinite(shown)
        least = 10.0 ** math.ceil(math.log10(shown)) if known else 0.0
        return self._replace(least=least)

    @property
    def exact(self) -> Scale:
        """The same, with nothing too small to be said."""
        return self._replace(least=0.0)

    def nothing(self, value: float) -> bool:
        """Whether an SI number is not zero, but to an engineer."""
        return 0 < abs(float(from_si(value, self.unit, self.shown))) < self.least

    def number(self, value: float) -> str:
        """Write an SI number in the unit shown, without it: with four figures."""
        shown = float(from_si(value, self.unit, self.shown))
        if self.nothing(value):
            return self._below(shown)
        if self.shown == COUNT and shown.is_integer():
            return f"{shown:.0f}"
        return four_figures(shown)

    def interval(
        self, value: float, lower: float, upper: float
    ) -> tuple[str, str, str]:
        """Write a number and the ends of its interval, as precisely as this allows.

        All three end where half the interval has its second figure; they have six
        figures at most. Where the interval has no width or no end, each has four.
        """
        given = (value, lower, upper)
        three = [float(from_si(x, self.unit, self.shown)) for x in given]
        half, size = (three[2] - three[1]) / 2, max(map(abs, three))
        whole = self.shown == COUNT and all(map(float.is_integer, three))
        if whole or not (math.isfinite(size) and half > 0):
            return self.number(value), self.number(lower), self.number(upper)
        place = min(
            1 - math.floor(math.log10(half)),
            MOST_FIGURES - 1 - math.floor(math.log10(size)),
        )
        # where figures end before, what is nothing is rounded to zero
        least = self.least if 10.0**-place <= self.least else 0.0
        a, b, c = (
            self._below(x) if 0 < abs(x) < least else to_place(x, place) for x in three
        )
        return a, b, c

    def _below(self, shown: float) -> str:
        least = _tidy(f"{self.least:g}")
        return f"below {least}" if shown > 0 else f"above -{least}"

    def words(self, value: float) -> str:
        """Write an SI number with its unit."""
        return f"{self.number(value)} {self.mark}".strip()

    def label(self, name: str) -> str:
        """Name a quantity with its unit, for an axis or a head."""
        return f"{name}, {self.mark}" if self.mark else name


class Ratio(NamedTuple):
    """How a slope is shown: in units of a response by those of a contributor.

    Attributes
    ----------
    above, below : Scale
        Of the response and the contributor.
    """

    above: Scale
    below: Scale

    @property
    def mark(self) -> str:
        """What stands behind a number, kN/mm."""
        below = self.below.mark
        if not below:
            return self.above.mark
        joined = any(sign in below for sign in "/* ")
        return f"{self.above.mark or 1}/{f'({below})' if joined else below}"

    def number(self, value: float) -> str:
        """Write an SI number in the units shown, without them: with four figures."""
        return four_figures(value * self.above.factor / self.below.factor)


def four_figures(value: float) -> str:
    """Write a number with four figures, three where it needs an exponent."""
    if math.isnan(value):
        return "failed"
    if value == 0:
        return "0"
    if not 1e-3 <= abs(value) <= 1e6:
        return _tidy(f"{value:.{FIGURES - 2}e}")
    digits = max(0, FIGURES - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}"


def to_place(value: float, place: int) -> str:
    """Write a number up to a place behind its point; before it if that is negative."""
    rounded = round(value, place)
    if rounded == 0:
        return "0"
    figures = math.floor(math.log10(abs(rounded))) + place  # behind the first
    if not 1e-3 <= abs(rounded) <= 1e6:
        return _tidy(f"{rounded:.{max(figures, 0)}e}")
    return f"{rounded:.{max(place, 0)}f}"


def _tidy(number: str) -> str:
    """Write 1e-05 as 1e-5."""
    return re.sub(r"e([+-])0+(?=\d)", r"e\1", number).replace("e+", "e")


def scale_of(unit: str, shown: str = "", size: float = math.nan) -> Scale:
    """Choose how a quantity of an SI unit is shown: SI itself where nothing is handier.

    What the study types or the machine declares goes first; else the size, the largest
    magnitude of its numbers, SI, decides the prefix. NaN or 0 is one that is not known.
    """
    if shown or unit not in SIZES:
        return Scale(unit, shown or unit)
    if not (math.isfinite(size) and size > 0):
        return Scale(unit, USUAL.get(unit, SIZES[unit][-1][0]))
    fitting = (name for name, least in SIZES[unit] if size >= least)
    return Scale(unit, next(fitting))
