"""The key `cost` of an entry of [deviations]: choices of its tolerance and its shift.

The price of one part follows a law of half the tolerance's width, T, or a list of
tolerances, of which one is chosen. The key `shift` permits shifts of the nominal.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from itertools import pairwise
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import numpy as np

from tolstat.deviations.distributions import Distribution, Tolerance, Uniform
from tolstat.deviations.spread import Shifted, half_of, resized, unshifted, zone_of
from tolstat.errors import CostError, DistributionError, UnitError, allowed_names
from tolstat.study.distribution_entry import (
    OUTERMOST,
    Change,
    NominalShift,
    read_distribution,
    with_tolerance,
    written_unit,
)
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.study_schema import (
    MOST_PRICE,
    Exponential,
    Reciprocal,
    ShiftKeys,
    read_entry,
)
from tolstat.units.scale import Scale, scale_of

EXAMPLE = (
    '{ law = "reciprocal", at = "+-0.02 mm", price = 10 }, or a list of tolerances, '
    '{ "+-1.2 mm" = 10, "+-0.6 mm" = 25 }'
)
LAWS = {"reciprocal": Reciprocal, "exponential": Exponential}
SHIFT = "shift of "  # before the name of an entry: the shift of its nominal
SPAN = 4.0, 2.0  # times tighter and looser than on the drawing, by default
DIGITS, MOST_DIGITS = 3, 12  # of half the width of a tolerance that is written
WIDEST = 1000  # times the tightest tolerance
MOST_RATES = 200  # of an exponential law: farther away its price overflows
MOST_APART = 100  # times the entry's tolerance: a price is not known so far from it
ROUNDING = 1e-9  # of a tolerance

Value = TypeVar("Value")


class Law(NamedTuple):
    """A price that falls continuously as the tolerance widens."""

    at: float  # half a width, SI
    price: float  # there
    tightest: float  # ends of the choice of half the width, SI
    loosest: float
    # 0: the price is reciprocal, price * (at / T)**exponent; else exponential,
    # price * exp((at - T) / rate)
    rate: float = 0.0
    exponent: float = 1.0
    fixed: float = 0.0  # part of the price that no tolerance changes

    def price_of(self, half: float) -> float:
        """Return the price of one part with half a tolerance, SI."""
        varying, power = self.price - self.fixed, self.exponent
        if self.rate:
            return self.fixed + varying * math.exp((self.at - half) / self.rate)
        return float(self.fixed + varying * self.at**power / half**power)


class Offered(NamedTuple):
    """A tolerance on offer."""

    words: str  # as the study writes it: "+-1.2 mm", "IT9"
    price: float  # of one part
    distributions: Mapping[str, Distribution]  # with it, by contributor, SI


@dataclass(frozen=True)
class Priced:
    """An entry of a study with a price; its parts share one tolerance.

    The choice is a number: with a law the logarithm of half the tolerance's width (SI),
    else the place in the list of offers, the loosest first.
    """

    name: str  # of the entry
    words: str  # the specified tolerance, as written
    specified: Mapping[str, Distribution]  # by contributor, as in the study, SI
    scale: Scale  # of the tolerance, as written
    sized: bool = True  # as of `tolstat.deviations.spread.fixed_point`
    law: Law | None = None  # of the price
    offered: tuple[Offered, ...] = ()  # without a law: all choices, the loosest first

    @property
    def entry(self) -> str:
        """The name of the entry that a choice changes."""
        return self.name

    @property
    def specified_choice(self) -> float:
        """The choice specified in the study."""
        if self.law:
            return math.log(half_of(self.specified))
        halves = [half_of(offer.distributions) for offer in self.offered]
        return float(halves.index(half_of(self.specified)))

    def is_specified(self, choice: float) -> bool:
        """Tell whether a choice is that of the study."""
        return abs(choice - self.specified_choice) < ROUNDING

    @property
    def ends(self) -> tuple[float, float]:
        """The choices of the tightest and of the loosest tolerance."""
        if self.law:
            return math.log(self.law.tightest), math.log(self.law.loosest)
        return float(len(self.offered) - 1), 0.0

    def cost(self, choice: float) -> float:
        """Return the price of all parts of the entry."""
        if self.law:
            return len(self.specified) * self.law.price_of(math.exp(choice))
        return len(self.specified) * self.offered[round(choice)].price

    def distributions(
        self, choice: float, chosen: Mapping[str, Distribution] = MappingProxyType({})
    ) -> Mapping[str, Distribution]:
        """Return the distributions of the parts' deviations, by contributor, SI.

        Others may be `chosen` before: a shift moves them.
        """
        if not self.law:
            return self.offered[round(choice)].distributions
        return {
            name: resized(distribution, math.exp(choice), sized=self.sized)
            for name, distribution in self.specified.items()
        }

    def change(self, choice: float) -> Change:
        """Return the change of the entry that a choice is."""
        return self.text(choice)

    def text(self, choice: float) -> str:
        """Return a chosen tolerance as text; the specified one as it is written.

        Half its width has three figures, or more where three would make it tighter than
        the tightest. Rounding never widens it.
        """
        if not self.law:
            return self.offered[round(choice)].words
        if self.is_specified(choice):
            return self.words
        zone = zone_of(unshifted(next(iter(self.distributions(choice).values()))))
        assert zone is not None
        factor = self.scale.factor
        lower, upper, half = (factor * x for x in (zone.lower, zone.upper, zone.half))
        slack = ROUNDING * half  # for the rounding of binary numbers
        tightest = self.law.tightest * (1 - ROUNDING) * factor
        for figures in range(DIGITS, MOST_DIGITS + 1):
            place = math.floor(math.log10(half)) + 1 - figures
            ends = (
                Decimal(math.ceil((lower - slack) / 10.0**place)).scaleb(place),
                Decimal(math.floor((upper + slack) / 10.0**place)).scaleb(place),
            )
            if float(ends[1] - ends[0]) / 2 >= tightest:
                break
        low, high = (f"{end.normalize() if end else Decimal(0):f}" for end in ends)
        both = f"+-{high}" if low == f"-{high}" else f"{low}..{high}"
        return f"{both} {self.scale.mark}".strip()


@dataclass(frozen=True)
class Shift(Priced):
    """A shift of the nominal of all parts of an entry.

    The choice is the shift, SI; NaN stands for parts all over the permitted shifts.
    """

    permitted: tuple[float, float] = (0.0, 0.0)  # both ends, the dearer first
    rate: float = 0.0  # the price of one part, by SI unit of the shift

    @property
    def entry(self) -> str:
        """The name of the entry whose nominal is shifted."""
        return self.name.removeprefix(SHIFT)

    @property
    def specified_choice(self) -> float:
        """The shift specified in the study."""
        first = next(iter(self.specified.values()))
        return first.by if isinstance(first, Shifted) else 0.0

    @property
    def ends(self) -> tuple[float, float]:
        """No shift, and all over."""
        return 0.0, math.nan

    def cost(self, choice: float) -> float:
        """Return the price of all parts of the entry."""
        return len(self.specified) * self.rate * abs(choice)

    def distributions(
        self, choice: float, chosen: Mapping[str, Distribution] = MappingProxyType({})
    ) -> Mapping[str, Distribution]:
        """Return the distributions, as chosen before or specified, with the shift."""
        parts = {n: unshifted(chosen.get(n, x)) for n, x in self.specified.items()}
        if not math.isnan(choice):
            return {name: Shifted(part, choice) for name, part in parts.items()}
        ends = np.array([part.deviations(OUTERMOST) for part in parts.values()])
        low, high = ends.min() + min(self.permitted), ends.max() + max(self.permitted)
        return dict.fromkeys(parts, Uniform(Tolerance(low, high)))

    def change(self, choice: float) -> Change:
        """Return the change of the entry that a choice is."""
        return NominalShift(self.text(choice))

    def text(self, choice: float) -> str:
        """Return a shift as text, with the digits of three figures of the tolerance."""
        if math.isnan(choice) or self.is_specified(choice):
            return self.words
        size = math.log10(half_of(self.specified) * self.scale.factor)
        place = math.floor(size) + 1 - DIGITS
        shift = Decimal(round(choice * self.scale.factor / 10.0**place)).scaleb(place)
        return f"{shift.normalize():f} {self.scale.mark}".strip()


def distributions_of(
    priced: Sequence[Priced], choice: Sequence[float]
) -> dict[str, Distribution]:
    """Return the distributions of chosen tolerances and shifts, by contributor, SI."""
    chosen: dict[str, Distribution] = {}
    for entry, x in zip(priced, choice, strict=True):
        chosen.update(entry.distributions(x, chosen))
    return chosen


def read_costs(
    name: str,
    cost: Any,
    keys: Mapping[str, Any],
    readers: Mapping[str, DeviationReader],
    distributions: Mapping[str, Distribution],
) -> list[Priced]:
    """Return the choices of an entry by its cost: a tolerance, a shift, or both.

    `keys` are its other keys.
    """
    if not isinstance(cost, dict) or not cost:
        raise CostError(f"cost: a table is expected, {EXAMPLE}")
    specified = {member: distributions[member] for member in readers}
    graded = "iso1328" in keys
    if not (graded or "tolerance" in keys):
        raise CostError("cost needs a tolerance; add one to the entry")
    reader = next(iter(readers.values()))
    written = written_unit(keys, reader)
    scale = scale_of(reader.contributor.unit, written, half_of(specified))
    prices = {k: v for k, v in cost.items() if k not in ShiftKeys.model_fields}
    priced: list[Priced] = []
    if prices:
        words = f"iso1328 = {keys['iso1328']}" if graded else str(keys["tolerance"])
        entry = Priced(name, words, specified, scale, sized=reader.is_sized(keys))
        priced.append(
            _with_law(entry, prices, reader)
            if prices.keys() & Exponential.model_fields
            else _with_offers(entry, prices, keys, readers)
        )
    if len(prices) == len(cost):
        return priced
    shift = {k: v for k, v in cost.items() if k not in prices}
    permitted = read_entry(ShiftKeys, shift, "cost has")
    low, high = _read(reader.zone, "shift", permitted.shift or "")
    price = permitted.shift_price
    if not low <= 0 <= high or low == high or (price and low < 0 < high):
        expected = 'a range around 0 is expected, such as "+-0.2 mm"'
        if price:
            expected = 'with a shift_price it goes to one side, such as "-0.2..0 mm"'
        raise CostError(f'cost, shift = "{permitted.shift}": {expected}')
    words = str(keys.get("nominal_shift", f"0 {scale.mark}".strip()))
    ends = (low, high) if -low > high else (high, low)
    shifted = Shift(
        SHIFT + name,
        words,
        specified,
        scale,
        permitted=ends,
        rate=price / max(-low, high),
    )
    return [*priced, shifted]


def _with_offers(
    entry: Priced,
    prices: dict[str, Any],
    keys: Mapping[str, Any],
    readers: Mapping[str, DeviationReader],
) -> Priced:
    """Return an entry with tolerances on offer, the loosest first."""
    offered = []
    for tolerance, price in prices.items():
        number = isinstance(price, int | float) and not isinstance(price, bool)
        if not number or not 0 <= price <= MOST_PRICE:
            raise CostError(
                f'cost, "{tolerance}": a price is a number from 0, such as 10; other '
                f"keys: {', '.join(Exponential.model_fields)}"
            )
        distributions = {
            name: read_distribution(
                with_tolerance(keys, tolerance, reader.contributor), reader
            )
            for name, reader in readers.items()
        }
        offered.append(Offered(tolerance, float(price), distributions))
    offered.sort(key=lambda offer: -half_of(offer.distributions))
    for looser, tighter in pairwise(offered):
        half = half_of(looser.distributions)
        if half - half_of(tighter.distributions) <= ROUNDING * half:
            raise CostError("cost: two of its tolerances are the same")
        if looser.price > tighter.price:
            raise CostError(
                f'cost: "{looser.words}" = {looser.price:g} is looser than '
                f'"{tighter.words}" = {tighter.price:g}, and costs more; correct a '
                "price, or leave it out"
            )
    if entry.specified not in [offer.distributions for offer in offered]:
        allowed = ", ".join(offer.words for offer in offered)
        raise CostError(
            f"cost: the tolerance of the entry has no price; allowed: {allowed}"
        )
    return replace(entry, offered=tuple(offered))


def _with_law(priced: Priced, cost: dict[str, Any], reader: DeviationReader) -> Priced:
    """Return an entry with a law of its price."""
    if len({zone_of(distribution) for distribution in priced.specified.values()}) > 1:
        raise CostError(
            "cost: the parts have different tolerances; give each a separate entry, or "
            "a table of grades"
        )
    half = half_of(priced.specified)
    name = cost.get("law")
    if not isinstance(name, str) or name not in LAWS:
        wrong = "no law is given" if name is None else f"law = {name}"
        raise CostError(f"cost, {wrong}: {allowed_names(str(name), LAWS)}")
    entry = read_entry(LAWS[name], cost, f"the {name} law has")
    tighter, looser = SPAN
    halves = {"tightest": half / tighter, "loosest": half * looser}
    for key in ("at", *halves):
        if text := getattr(entry, key):
            halves[key] = _read(reader.zone, key, text).half
    rate = 0.0
    if isinstance(entry, Exponential):
        rate = _read(reader.difference, "rate", entry.rate)
        if not rate > 0:
            raise CostError(
                "cost, rate: a quantity above zero is expected; the price is e times "
                "as much for each rate that the tolerance is tighter"
            )
        if "exponent" in cost:
            raise CostError("cost, exponent: it is of the reciprocal law")
    if not entry.fixed < entry.price:
        raise CostError("cost, fixed: it is a part of price, and less")
    law = Law(
        price=entry.price, rate=rate, exponent=entry.exponent, fixed=entry.fixed,
        **halves,
    )  # fmt: skip
    if not half / MOST_APART < law.at < half * MOST_APART:
        reader.warnings.append(
            f'{reader.contributor.name}: cost, at = "{entry.at}", is '
            f"{law.at / half:.3g} times the tolerance of the entry; check its unit"
        )
    if not law.tightest < law.loosest:
        raise CostError("cost: tightest must be tighter than loosest")
    if law.loosest > WIDEST * law.tightest:
        raise CostError(
            f"cost: loosest is more than {WIDEST} times tightest, and no run covers "
            "both; give a smaller range"
        )
    if not law.tightest * (1 - ROUNDING) <= half <= law.loosest * (1 + ROUNDING):
        raise CostError(
            "cost: the tolerance of the entry does not lie between tightest and "
            f"loosest; by default they are a {tighter:g}th and {looser:g} times it"
        )
    for key in ("tightest", "loosest"):
        if abs(law.at - getattr(law, key)) > MOST_RATES * rate > 0:
            raise CostError(
                f"cost, rate: the price at the {key} tolerance is too large; give a "
                "larger rate"
            )
    return replace(priced, law=law)


def _read(grammar: Callable[[str], Value], key: str, text: str) -> Value:
    """Read a tolerance or a quantity of a law."""
    try:
        return grammar(text)
    except (UnitError, DistributionError) as error:
        raise CostError(f'cost, {key} = "{text}": {error}') from None
