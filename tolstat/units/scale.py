"""Units and significant figures of shown quantities."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal
from sys import float_info
from typing import NamedTuple

from tolstat.units.conversion import from_si

PLAIN, COUNT = "1", "count"
FIGURES = 4  # of a number without interval, unless its spread needs more
BOUND = 3  # of a bound, and of an estimate without a trustworthy interval
MOST_FIGURES = 10  # of any number
KNOWN = 12  # figures; the next ones are rounding errors of binary numbers
ZERO_SHARE = 1e-6  # of a size, up to the next power of ten: practically zero
ROUNDING_OF_ZERO = 1e-6  # of what is practically zero, by binary numbers
# of the width of an interval: an end, and an estimate, that is practically zero
SPECK = Decimal("1e-4"), Decimal("1e-5")
RESOLVED_SHARE = 1e-3  # of a spread: rounding of a number without interval
PLAINLY = 1e-3, 1e6  # between these numbers have no exponent

# by SI unit: the units shown, the largest first, each with its least size (SI); the
# last also serves smaller ones
SIZES = {
    "1": (("%", 0.0),),
    "m": (("m", 100.0), ("mm", 1e-4), ("um", 1e-7), ("nm", 0.0)),
    "rad": (("rad", 10.0), ("mrad", 1e-5), ("urad", 0.0)),
    "N": (("MN", 1e7), ("kN", 1e3), ("N", 0.1), ("mN", 1e-4), ("uN", 0.0)),
    "J": (
        ("MJ", 1e7), ("kJ", 1e3), ("J", 0.1), ("mJ", 1e-4), ("uJ", 1e-7), ("nJ", 0.0),
    ),
    "W": (("MW", 1e7), ("kW", 1e3), ("W", 0.1), ("mW", 1e-4), ("uW", 0.0)),
    "N m": (("MN m", 1e7), ("kN m", 1e3), ("N m", 1e-2), ("mN m", 0.0)),
    "Pa": (("GPa", 1e10), ("MPa", 1e4), ("kPa", 10.0), ("Pa", 0.0)),
    "Hz": (("kHz", 1e5), ("Hz", 1e-2), ("mHz", 0.0)),
    "s": (("s", 0.1), ("ms", 1e-5), ("us", 0.0)),
}  # fmt: skip
# of these, the unit where no size is known
USUAL = {"m": "mm", "rad": "mrad", "N": "kN", "J": "kJ", "W": "kW", "N m": "kN m",
         "Pa": "MPa", "Hz": "Hz", "s": "s"}  # fmt: skip


class Scale(NamedTuple):
    """How a quantity is stored and how it is shown."""

    unit: str  # SI unit of its numbers
    shown: str  # unit in which it is read; "1" is a plain number, "count" a whole one
    # a power of ten, in the unit shown: smaller numbers are written as below it
    least: float = 0.0
    most: int = MOST_FIGURES  # largest number of figures
    # least number of decimals of numbers without interval; None where their spread is
    # unknown
    place: int | None = None

    @property
    def factor(self) -> float:
        """Factor from SI to the unit shown."""
        return float(from_si(1.0, self.unit, self.shown))

    @property
    def mark(self) -> str:
        """The unit after a number, or nothing."""
        return "" if self.shown in (PLAIN, COUNT) else self.shown

    def beside(self, size: float) -> Scale:
        """Return the scale whose least number suits numbers of a size, SI."""
        negligible = ZERO_SHARE * self.factor * abs(size)
        defined = negligible > 0 and math.isfinite(negligible)
        least = 10.0 ** math.ceil(math.log10(negligible)) if defined else 0.0
        return self._replace(least=least)

    def telling(self, spread: float, exact: Iterable[float] = ()) -> Scale:
        """Return the scale with decimals that resolve a thousandth of a spread, SI.

        A spread of 0 or not finite is unknown. Numbers that are `exact`, such as ends
        of a limit, get one more decimal than they have.
        """
        numbers = (self.factor * number for number in exact)
        places = [1 - int(_decimal(x).as_tuple().exponent) for x in numbers if x]
        resolution = 2 * RESOLVED_SHARE * self.factor * abs(spread)
        if resolution > 0 and math.isfinite(resolution):
            places.append(math.ceil(-math.log10(resolution) - ZERO_SHARE))
        return self._replace(place=max(places, default=None))

    def number(self, value: float, count: int = 0) -> str:
        """Write an SI number in the unit shown, without it.

        It has at most `count` figures; by default four, or as many as its place needs.
        """
        number = self.factor * value
        if abs(number) < ROUNDING_OF_ZERO * self.least:
            return "0"
        if 0 < abs(number) < self.least:
            return self._below(number)
        if self.shown == COUNT and number.is_integer():
            return f"{number:.0f}"
        if not count:
            count = FIGURES
            if self.place is not None and number and math.isfinite(number):
                count = max(count, _decimal(number).adjusted() + 1 + self.place)
        return figures(number, min(count, self.most))

    def at_least(self, value: float) -> str:
        """Write an SI number as a lower bound: three figures, rounded down."""
        return self._bound(value, ROUND_FLOOR)

    def at_most(self, value: float) -> str:
        """Write an SI number as an upper bound: three figures, rounded up."""
        return self._bound(value, ROUND_CEILING)

    def _bound(self, value: float, rounding: str) -> str:
        number = self.factor * value
        if 0 < abs(number) < self.least:
            safe = number > 0 if rounding == ROUND_CEILING else number < 0
            number = math.copysign(self.least, number) if safe else 0.0
        return figures(number, BOUND, rounding)

    def interval(
        self, value: float, lower: float, upper: float
    ) -> tuple[str, str, str]:
        """Write an estimate and the ends of its interval, SI, NaN without one.

        Each has three figures, and more down to the second figure of half the width.
        What is practically zero beside the width is zero. If the estimate is one end,
        the other is a bound: three figures of the width, rounded outwards. So is the
        end of an open interval. Without width they are plain numbers; without an
        interval the estimate has three figures.
        """
        numbers = (value, lower, upper)
        three = [self.factor * x for x in numbers]
        is_count = self.shown == COUNT and all(map(float.is_integer, three))
        if math.isnan(three[1]) or math.isnan(three[2]):
            return (self.number(value, BOUND), self.number(lower), self.number(upper))
        if math.isinf(three[1]) or math.isinf(three[2]):
            return (
                self.number(value, BOUND),
                self.at_least(lower),
                self.at_most(upper),
            )
        middle, below, above = decimals = [_decimal(x) for x in three]
        width = abs(above - below)
        if is_count or not width:
            return self.number(value), self.number(lower), self.number(upper)
        size = max(abs(x) for x in decimals if x.is_finite())
        bound = middle in (below, above)
        last_place = (
            BOUND - 1 - width.adjusted() if bound else 1 - (width / 2).adjusted()
        )
        plain = PLAINLY[0] <= size <= PLAINLY[1]
        roundings = (
            ROUND_HALF_EVEN,
            ROUND_FLOOR if middle == above else ROUND_HALF_EVEN,
            ROUND_CEILING if middle == below else ROUND_HALF_EVEN,
        )
        words = []
        for x, rounding in zip(decimals, roundings, strict=True):
            seen = x.is_finite() and abs(x) > SPECK[x == middle] * width
            if not x.is_finite():
                words.append(self.number(value))
            elif seen and abs(x) < self.least:
                words.append(self._below(float(x)))
            else:
                last = max(last_place, BOUND - 1 - x.adjusted()) if seen else last_place
                last = min(last, self.most - 1 - x.adjusted()) if seen else last
                if bound and x == middle:  # exact: no trailing zeros
                    last = min(last, -int(x.as_tuple().exponent))
                words.append(_to_place(x, last, rounding, plain))
        a, b, c = words
        return a, b, c

    def _below(self, number: float) -> str:
        least = tidy(f"{self.least:g}")
        return f"below {least}" if number > 0 else f"above -{least}"

    def words(self, value: float) -> str:
        """Write an SI number with its unit."""
        return f"{self.number(value)} {self.mark}".strip()

    def label(self, name: str) -> str:
        """Return a name with its unit, for an axis or a heading."""
        return f"{name}, {self.mark}" if self.mark else name


class Ratio(NamedTuple):
    """How a slope is shown: in units of a response per those of a contributor."""

    above: Scale
    below: Scale

    @property
    def mark(self) -> str:
        """The unit after a number, kN/mm."""
        below = self.below.mark
        if not below:
            return self.above.mark
        joined = any(sign in below for sign in "/* ")
        return f"{self.above.mark or 1}/{f'({below})' if joined else below}"

    @property
    def factor(self) -> float:
        """Factor from SI to the units shown."""
        return self.above.factor / self.below.factor

    def number(self, value: float) -> str:
        """Write an SI number in the units shown, without them: four figures."""
        return figures(value * self.above.factor / self.below.factor)


PER_CENT, PPM, AS_IS = Scale("1", "%"), Scale("1", "ppm"), Scale("1", PLAIN)
PART = PER_CENT.beside(1.0)._replace(most=BOUND)  # of trials, of a variance, of chance


def share_words(share: float) -> str:
    """Return a typed share as text: 0.00135 is "0.135 %", only 1 is "100 %"."""
    return f"{100 * share:.{float_info.dig}g} %"


def figures(value: float, count: int = FIGURES, rounding: str = ROUND_HALF_EVEN) -> str:
    """Return a number without interval as text: 0.4 as 0.4, and 1/3 as 0.3333.

    It has at most `count` figures: of four one less with an exponent, and at least
    those before its point. The rounding is one of `decimal`.
    """
    if math.isnan(value):
        return "failed"
    if math.isinf(value):
        return str(value)
    decimal = _decimal(value)
    plain = value == 0 or PLAINLY[0] <= abs(value) <= PLAINLY[1]
    if plain and count >= FIGURES:
        count = max(count, 1 + decimal.adjusted())
    elif count == FIGURES:
        count -= 1
    rounded = Context(count, rounding).plus(decimal)
    return f"{rounded:f}" if plain else tidy(f"{rounded:e}")


def _decimal(value: float) -> Decimal:
    """Return the figures of a number, without rounding errors of binary numbers."""
    return Decimal(f"{value:.{KNOWN}g}").normalize()


def _to_place(value: Decimal, last: int, rounding: str, plain: bool) -> str:
    """Write a number up to a decimal place; before the point if that is negative.

    A plain number has no exponent, unless it begins with four zeros.
    """
    rounded = value.quantize(Decimal(1).scaleb(-last), rounding)
    if rounded == 0:
        return "0"
    plain = plain and abs(rounded) >= PLAINLY[0] / 10
    return f"{rounded:f}" if plain else tidy(f"{rounded:e}")


def tidy(number: str) -> str:
    """Write 1e-05 as 1e-5."""
    return re.sub(r"e([+-])0+(?=\d)", r"e\1", number).replace("e+", "e")


def scale_of(unit: str, shown: str = "", size: float = math.nan) -> Scale:
    """Return the scale of a quantity in an SI unit.

    Its unit is that of the study or of the model. Otherwise the size decides the
    prefix: the largest magnitude of its numbers, SI. A size of NaN or 0 is unknown.
    """
    if shown or unit not in SIZES:
        return Scale(unit, shown or unit)
    if not (math.isfinite(size) and size > 0):
        return Scale(unit, USUAL.get(unit, SIZES[unit][-1][0]))
    fitting = (name for name, least in SIZES[unit] if size >= least)
    return Scale(unit, next(fitting))
