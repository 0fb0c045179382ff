"""Costs by tolerance: the key `cost` of an entry of [deviations], read.

The price of one part follows a law of half the tolerance's width, T, or a list of
tolerances, of which one is chosen.
"""

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import tomli_w

from tolstat.deviations import iso286
from tolstat.deviations.distributions import Distribution, Tolerance
from tolstat.deviations.spread import half_of, in_zone, resized, unshifted, zone_of
from tolstat.errors import CostError, DistributionError, UnitError, allowed_names
from tolstat.study.distribution_entry import read_distribution, written_unit
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.study_schema import (
    MOST_PRICE,
    Exponential,
    Reciprocal,
    read_entry,
)
from tolstat.study.typed_zone import typed_places
from tolstat.units.scale import Scale, scale_of

EXAMPLE = (
    '{ law = "reciprocal", at = "+-0.02 mm", price = 10 }, or a list of tolerances, '
    '{ "+-1.2 mm" = 10, "+-0.6 mm" = 25 }'
)
LAWS: dict[str, type[Reciprocal]] = {
    "reciprocal": Reciprocal,
    "exponential": Exponential,
}
SHIFT = "shift of "  # before the name of an entry: the shift of its nominal
SPAN = 4.0, 2.0  # times tighter and looser than on the drawing, by default
DIGITS, MOST_DIGITS = 3, 12  # of half the width of a tolerance that is written
WIDEST = 1000  # times the tightest tolerance
MOST_RATES = 200  # of an exponential law: farther away its price overflows
MOST_APART = 100  # times the entry's tolerance: a price is not known so far from it
ROUNDING = 1e-9  # of a tolerance

Found = TypeVar("Found")


class Law(NamedTuple):
    """A price that falls continuously as the tolerance widens."""

    at: float  # half a width, SI
    price: float  # there
    tightest: float  # ends of the choice of half the width, SI
    loosest: float
    # 0: the price is reciprocal, price * at / T; else price * exp((at - T) / rate)
    rate: float = 0.0

    def of(self, half: float) -> float:
        """Return the price of one part with half a tolerance, SI."""
        if self.rate:
            return self.price * math.exp((self.at - half) / self.rate)
        return self.price * self.at / half


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
    law: Law | None  # of the price
    sized: bool = True  # as of `tolstat.deviations.spread.fixed_point`
    offered: tuple[Offered, ...] = ()  # without a law: all choices, the loosest first

    @property
    def specified_choice(self) -> float:
        """The choice specified in the study."""
        if self.law:
            return math.log(half_of(self.specified))
        halves = [half_of(each.distributions) for each in self.offered]
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
        law = self.law
        price = law.of(math.exp(choice)) if law else self.offered[round(choice)].price
        return len(self.specified) * price

    def distributions(
        self, choice: float, chosen: Mapping[str, Distribution] = MappingProxyType({})
    ) -> Mapping[str, Distribution]:
        """Return the distributions of the parts' deviations, by contributor, SI.

        Others may be `chosen` before: a shift moves them.
        """
        if not self.law:
            return self.offered[round(choice)].distributions
        half = math.exp(choice)
        return {
            name: resized(each, half, sized=self.sized)
            for name, each in self.specified.items()
        }

    def text(self, choice: float) -> str:
        """Return a chosen tolerance as text; the specified one as it is written.

        Half its width has three figures, or more where three would make it tighter than
        the tightest. Rounding never widens it.
        """
        if not self.law:
            return self.offered[round(choice)].words
        if self.is_specified(choice):
            return self.words
        low, high = self._written(choice)
        both = f"+-{high}" if low == f"-{high}" else f"{low}..{high}"
        return f"{both} {self.scale.mark}".strip()

    def places(self, choice: float) -> dict[str, str]:
        """Return the other keys of the entry that move with a chosen tolerance."""
        if not self.law or self.is_specified(choice):
            return {}
        ends = (float(end) / self.scale.factor for end in self._written(choice))
        first = unshifted(next(iter(self.specified.values())))
        return typed_places(in_zone(first, Tolerance(*ends)), self.scale)

    def _written(self, choice: float) -> tuple[str, str]:
        """Return the ends of a tolerance that follows a law, as they are written."""
        assert self.law
        zone = zone_of(unshifted(next(iter(self.distributions(choice).values()))))
        assert zone is not None
        scale = self.scale
        lower, upper = (end * scale.factor for end in zone)
        half, least = zone.half * scale.factor, self.law.tightest * (1 - ROUNDING)
        slack = ROUNDING * half  # for the rounding of binary numbers
        for figures in range(DIGITS, MOST_DIGITS + 1):
            place = math.floor(math.log10(half)) + 1 - figures
            ends = (
                Decimal(math.ceil((lower - slack) / 10.0**place)).scaleb(place),
                Decimal(math.floor((upper + slack) / 10.0**place)).scaleb(place),
            )
            if float(ends[1] - ends[0]) / 2 >= least * scale.factor:
                break
        low, high = (f"{end.normalize() if end else Decimal(0):f}" for end in ends)
        return low, high


def read_cost(
    name: str,
    given: dict[str, Any],
    keys: Mapping[str, Any],
    readers: Mapping[str, DeviationReader],
    specified: Mapping[str, Distribution],
) -> Priced:
    """Return the costs of an entry by tolerance; `keys` are its other keys."""
    graded, reader = "iso1328" in keys, next(iter(readers.values()))
    words = f"iso1328 = {keys['iso1328']}" if graded else str(keys["tolerance"])
    scale = scale_of(
        reader.contributor.unit, written_unit(keys, reader), half_of(specified)
    )
    sized = reader.is_sized(keys)
    if not set(given) & set(Exponential.model_fields):
        offered = _offered(given, keys, readers)
        if specified not in [each.distributions for each in offered]:
            known = ", ".join(each.words for each in offered)
            raise CostError(
                f"cost: the tolerance of the entry has no price; allowed: {known}"
            )
        return Priced(name, words, specified, scale, None, sized, offered)
    if len({zone_of(each) for each in specified.values()}) > 1:
        raise CostError(
            "cost: the parts have different tolerances; give each a separate entry, or "
            "a table of grades"
        )
    law = _law(given, specified, reader, sized)
    return Priced(name, words, specified, scale, law, sized)


def _offered(
    given: dict[str, Any],
    keys: Mapping[str, Any],
    readers: Mapping[str, DeviationReader],
) -> tuple[Offered, ...]:
    """Read tolerances on offer, the loosest first."""
    offered = []
    for each, price in given.items():
        number = isinstance(price, int | float) and not isinstance(price, bool)
        if not number or not 0 <= price <= MOST_PRICE:
            raise CostError(
                f'cost, "{each}": a price is a number from 0, such as 10; other keys: '
                f"{', '.join(Exponential.model_fields)}"
            )
        entry = with_tolerance(keys, each)
        made = {n: read_distribution(entry, reader) for n, reader in readers.items()}
        offered.append(Offered(each, float(price), made))
    offered.sort(key=lambda each: -half_of(each.distributions))
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
    return tuple(offered)


def _law(
    given: dict[str, Any],
    specified: Mapping[str, Distribution],
    reader: DeviationReader,
    sized: bool,
) -> Law:
    """Read a law of the price."""
    law = given.get("law")
    if not isinstance(law, str) or law not in LAWS:
        said = "no law is given" if law is None else f"law = {law}"
        raise CostError(f"cost, {said}: {allowed_names(str(law), LAWS)}")
    entry = read_entry(LAWS[law], given, f"the {law} law has")
    half, (tighter, looser) = half_of(specified), SPAN
    halves = {"tightest": half / tighter, "loosest": half * looser}
    for key in ("at", *halves):
        if text := getattr(entry, key):
            halves[key] = read(reader.zone, key, text).half
    rate = 0.0
    if isinstance(entry, Exponential):
        rate = read(reader.difference, "rate", entry.rate)
        if not rate > 0:
            raise CostError(
                "cost, rate: a quantity above zero is expected; the price is e times "
                "as much for each rate that the tolerance is tighter"
            )
    found = Law(price=entry.price, rate=rate, **halves)
    if not half / MOST_APART < found.at < half * MOST_APART:
        reader.warnings.append(
            f'{reader.contributor.name}: cost, at = "{entry.at}", is '
            f"{found.at / half:.3g} times the tolerance of the entry; check its unit"
        )
    if not found.tightest < found.loosest:
        raise CostError("cost: tightest must be tighter than loosest")
    if found.loosest > WIDEST * found.tightest:
        raise CostError(
            f"cost: loosest is more than {WIDEST} times tightest, and no run covers "
            "both; give a smaller range"
        )
    ends = found.tightest * (1 - ROUNDING), found.loosest * (1 + ROUNDING)
    if not ends[0] <= half <= ends[1]:
        raise CostError(
            "cost: the tolerance of the entry does not lie between tightest and "
            f"loosest; by default they are a {tighter:g}th and {looser:g} times it"
        )
    for key, end in (("tightest", found.tightest), ("loosest", found.loosest)):
        try:
            for each in specified.values():
                resized(each, end, sized=sized)
        except DistributionError as error:
            raise CostError(
                f"cost: with the {key} tolerance, {end / half:.3g} times that of the "
                f"entry, {error}; give cost another {key}"
            ) from None
        if abs(found.at - end) > MOST_RATES * rate > 0:
            raise CostError(
                f"cost, rate: the price at the {key} tolerance is too large; give a "
                "larger rate"
            )
    return found


def read(grammar: Callable[[str], Found], key: str, text: str) -> Found:
    """Read a tolerance or a quantity of a law."""
    try:
        return grammar(text)
    except (UnitError, DistributionError) as error:
        raise CostError(f'cost, {key} = "{text}": {error}') from None


def with_tolerances(
    text: str,
    chosen: Mapping[str, str],
    places: Mapping[str, dict[str, str]] = MappingProxyType({}),
    **keys: Any,
) -> str:
    """Return a study with other tolerances, shifts and keys; its comments are lost.

    Tolerances are named by entry of [deviations] or [links], shifts after `SHIFT`.
    `places` are other keys of entries that move with their tolerance.
    """
    table = tomllib.loads(text) | keys
    for full, words in chosen.items():
        name = full.removeprefix(SHIFT)
        section = table["links" if name in table.get("links", {}) else "deviations"]
        if name == full:
            section[name] = with_tolerance(section[name], words) | places.get(name, {})
        else:
            section[name] |= {"nominal_shift": words}
    return tomli_w.dumps(table)


def with_tolerance(entry: Mapping[str, Any], words: str) -> dict[str, Any]:
    """Return an entry of a study with another tolerance, all other keys as they are."""
    found: dict[str, Any] = {}
    graded = iso286.looks_like_grade(words)
    for key, value in entry.items():
        if key in ("tolerance", "iso1328"):
            found["tolerance"] = words
        elif key != "module" and (key != "size" or graded):
            found[key] = value
    return found
