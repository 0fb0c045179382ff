"""The unit that a quantity is shown in: as typed, as declared, or fitting its size."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal
from typing import NamedTuple

from tolstat.units.conversion import from_si

PLAIN, COUNT = "1", "count"
FIGURES = 4  # of a number that needs no interval, where its spread asks for no more
BOUND = 3  # of a bound, and of an estimate without a trustworthy interval
MOST_FIGURES = 10  # however narrow an interval or a spread is
KNOWN = 12  # what stands behind is of binary numbers, not of what they say
NOTHING = 1e-6  # of a size, up to the next power of ten: zero to an engineer
# of the width of an interval: zero beside it, of an end and of the estimate
SPECK = Decimal("1e-4"), Decimal("1e-5")
TOLD = 1e-3  # of a spread: how far a number without interval may be rounded
PLAINLY = 1e-3, 1e6  # between these numbers have no exponent

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
    most : int
        Figures at most, however narrow an interval is.
    place : int or None
        Behind the point of the unit shown: up to there at least numbers without
        interval are told apart. None: nothing is known of their spread.
    """

    unit: str
    shown: str
    least: float = 0.0
    most: int = MOST_FIGURES
    place: int | None = None

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

    def telling(self, spread: float, asked: Iterable[float] = ()) -> Scale:
        """Return it with the figures that tell a thousandth of a spread apart.

        Parameters
        ----------
        spread : float
            Of its numbers, SI; 0 or not finite where it is not known.
        asked : iterable of float
            Numbers that they are held against, SI: to one place more at least.
        """
        shown = (float(from_si(each, self.unit, self.shown)) for each in asked)
        places = [1 - int(_known(x).as_tuple().exponent) for x in shown if x]
        told = 2 * TOLD * abs(float(from_si(spread, self.unit, self.shown)))
        if told > 0 and math.isfinite(told):
            places.append(math.ceil(-math.log10(told) - NOTHING))
        return self._replace(place=max(places, default=None))

    @property
    def exact(self) -> Scale:
        """The same, with nothing too small to be said."""
        return self._replace(least=0.0)

    def nothing(self, value: float) -> bool:
        """Whether an SI number is not zero, but to an engineer."""
        return 0 < abs(float(from_si(value, self.unit, self.shown))) < self.least

    def number(self, value: float, count: int = 0) -> str:
        """Write an SI number in the unit shown, without it.

        It has `count` figures at most; else four, or as many as its place asks for.
        """
        shown = float(from_si(value, self.unit, self.shown))
        if self.nothing(value):
            return self._below(shown)
        if self.shown == COUNT and shown.is_integer():
            return f"{shown:.0f}"
        if not count:
            count = FIGURES
            if self.place is not None and shown and math.isfinite(shown):
                count = max(count, _known(shown).adjusted() + 1 + self.place)
        return figures(shown, min(count, self.most))

    def at_least(self, value: float) -> str:
        """Write what an SI number is at least: of three figures, no larger than it."""
        return self._bound(value, ROUND_FLOOR)

    def at_most(self, value: float) -> str:
        """Write what an SI number is at most: of three figures, no smaller than it."""
        return self._bound(value, ROUND_CEILING)

    def _bound(self, value: float, rounding: str) -> str:
        shown = float(from_si(value, self.unit, self.shown))
        if self.nothing(value):
            safe = shown > 0 if rounding == ROUND_CEILING else shown < 0
            shown = math.copysign(self.least, shown) if safe else 0.0
        return figures(shown, BOUND, rounding)

    def interval(
        self, value: float, lower: float, upper: float
    ) -> tuple[str, str, str]:
        """Write an estimate and the ends of its interval, as precisely as this allows.

        All three end where half the interval has its second figure; they have ten
        figures at most, and one of their own where zero is outside, but for what is a
        speck beside the width. Where the estimate is one end itself, the other is a
        bound: of three figures of the width, rounded outwards; so is the end of an open
        interval. Without a width they are numbers like any other, and what has no
        interval is of three figures.

        Parameters
        ----------
        value, lower, upper : float
            SI; NaN where there is no interval.
        """
        given = (value, lower, upper)
        three = [float(from_si(x, self.unit, self.shown)) for x in given]
        whole = self.shown == COUNT and all(map(float.is_integer, three))
        if math.isnan(three[1]) or math.isnan(three[2]):
            return self.number(value, BOUND), self.number(lower), self.number(upper)
        if math.isinf(three[1]) or math.isinf(three[2]):
            return self.number(value, BOUND), self.at_least(lower), self.at_most(upper)
        middle, below, above = known = [_known(x) for x in three]
        width = abs(above - below)
        if whole or not width:
            return self.number(value), self.number(lower), self.number(upper)
        size = max(abs(x) for x in known if x.is_finite())
        bound = middle in (below, above)
        place = min(
            BOUND - 1 - width.adjusted() if bound else 1 - (width / 2).adjusted(),
            self.most - 1 - size.adjusted(),
        )
        own = below > 0 or above < 0  # a figure, for zero is outside
        # where figures end before, what is nothing is rounded to zero
        least = self.least if own or 10.0**-place <= self.least else 0.0
        plain = PLAINLY[0] <= size <= PLAINLY[1]
        roundings = (
            ROUND_HALF_EVEN,
            ROUND_FLOOR if middle == above else ROUND_HALF_EVEN,
            ROUND_CEILING if middle == below else ROUND_HALF_EVEN,
        )
        words = []
        for x, rounding in zip(known, roundings, strict=True):
            if not x.is_finite():
                words.append(self.number(value))
            elif 0 < abs(x) < least:
                words.append(self._below(float(x)))
            else:
                seen = own and abs(x) > SPECK[x == middle] * width
                last = max(place, -x.adjusted()) if seen else place
                if bound and x == middle:  # exactly there: no zeros behind
                    last = min(last, -int(x.as_tuple().exponent))
                words.append(to_place(x, last, rounding, plain))
        a, b, c = words
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

    @property
    def factor(self) -> float:
        """What an SI number is multiplied with to be shown."""
        return self.above.factor / self.below.factor

    def number(self, value: float) -> str:
        """Write an SI number in the units shown, without them: of four figures."""
        return figures(value * self.above.factor / self.below.factor)


PER_CENT, PPM, AS_IS = Scale("1", "%"), Scale("1", "ppm"), Scale("1", PLAIN)
# of some machines, or of a variance: no share of all
PART = PER_CENT._replace(most=BOUND)


def figures(value: float, count: int = FIGURES, rounding: str = ROUND_HALF_EVEN) -> str:
    """Write a number that has no interval: 0.4 as it is, and 1/3 as 0.3333.

    Parameters
    ----------
    value : float
        In the unit to be shown.
    count : int
        How many figures it has at most; of four one less with an exponent, and as many
        as stand before its point.
    rounding : str
        Of `decimal`.
    """
    if math.isnan(value):
        return "failed"
    if math.isinf(value):
        return str(value)
    known = _known(value)
    plain = value == 0 or PLAINLY[0] <= abs(value) <= PLAINLY[1]
    if plain and count >= FIGURES:
        count = max(count, 1 + known.adjusted())
    elif count == FIGURES:
        count -= 1
    rounded = Context(count, rounding).plus(known)
    return f"{rounded:f}" if plain else _tidy(f"{rounded:e}")


def _known(value: float) -> Decimal:
    """Return the figures of a number that are no noise of binary ones."""
    return Decimal(f"{value:.{KNOWN}g}").normalize()


def to_place(value: Decimal, place: int, rounding: str, plain: bool) -> str:
    """Write a number up to a place behind its point; before it if that is negative.

    Parameters
    ----------
    value : Decimal
        In the unit to be shown.
    place : int
        Of the last figure.
    rounding : str
        Of `decimal`.
    plain : bool
        Whether it has no exponent, unless it has six zeros behind its point.
    """
    rounded = value.quantize(Decimal(1).scaleb(-place), rounding)
    if rounded == 0:
        return "0"
    plain = plain and abs(rounded) >= NOTHING
    return f"{rounded:f}" if plain else _tidy(f"{rounded:e}")


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
