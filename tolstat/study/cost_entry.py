"""The key `cost` of a line of [deviations], read; tolerances written into a study."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from decimal import Decimal
from itertools import pairwise
from typing import Any

import tomli_w

from tolstat.deviations.distributions import Distribution
from tolstat.deviations.grades import iso286
from tolstat.deviations.prices import Law, Offered, Priced, half_of, resized, zone_of
from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import CostError, DistributionError, UnitError, allowed_names
from tolstat.units.grammar import quantity, tolerance
from tolstat.units.scale import scale_of

EXAMPLE = (
    '{ law = "reciprocal", at = "+-0.02 mm", price = 10 }, or what may be chosen, '
    '{ "+-1.2 mm" = 10, "+-0.6 mm" = 25 }'
)
LAWS = {"reciprocal": (), "exponential": ("rate",)}
OF_EVERY_LAW = ("law", "at", "price", "tightest", "loosest")
SPAN = 4.0, 2.0  # times tighter, and looser, than drawn, where nothing is said
DIGITS, MOST_DIGITS = 3, 12  # of half the width of a tolerance that is written
MOST_PRICE, MOST_LAW = 1e30, 1e100  # as given, and of a law at its ends
WIDEST = 1000  # times the tightest tolerance
ROUNDING = 1e-9

Make = Callable[[str], Mapping[str, Distribution]]


def read_cost(
    name: str,
    given: Any,
    drawn: Mapping[str, Distribution],
    make: Make,
    unit: str,
    shown: str,
    words: str,
) -> Priced:
    """Read what the parts of a line cost by their tolerance.

    `make` reads the line with another tolerance; `shown` is the unit in which the line
    writes its own, empty for a grade; `words` that tolerance.
    """
    if not isinstance(given, dict) or not given:
        raise CostError(f"cost: a table is expected, {EXAMPLE}")
    zones = {zone_of(each) for each in drawn.values()}
    if None in zones:
        raise CostError("cost is by tolerance, and the line has none")
    shown = shown or scale_of(unit, "", half_of(drawn)).shown
    if set(given) & {*OF_EVERY_LAW, "rate"}:
        if len(zones) > 1:
            raise CostError(
                "cost: the parts have different tolerances; give each a line of its "
                "own, or a table of grades"
            )
        law = _law(given, drawn, unit)
        return Priced(name, drawn, law, (), unit, shown, words)
    offered = [
        Offered(words, _price(f'"{words}"', price), make(words))
        for words, price in given.items()
    ]
    offered.sort(key=lambda each: -half_of(each.distributions))
    halves = [half_of(each.distributions) for each in offered]
    if any(a - b <= ROUNDING * a for a, b in pairwise(halves)):
        raise CostError("cost: two of its tolerances are the same")
    for looser, tighter in pairwise(offered):
        if looser.price > tighter.price:
            raise CostError(
                f'cost: "{looser.words}" = {looser.price:g} is looser than '
                f'"{tighter.words}" = {tighter.price:g}, and dearer; no one would '
                "choose it: correct a price, or leave it out"
            )
    if dict(drawn) not in [dict(each.distributions) for each in offered]:
        words = ", ".join(each.words for each in offered)
        raise CostError(
            f"cost: the tolerance of the drawing has no price; it has those of {words}"
        )
    return Priced(name, drawn, None, tuple(offered), unit, shown, words)


def _law(given: dict[str, Any], drawn: Mapping[str, Distribution], unit: str) -> Law:
    """Read a law of the price."""
    law = given.get("law")
    if not isinstance(law, str) or law not in LAWS:
        raise CostError(f"cost, law = {law}: {allowed_names(str(law), LAWS)}")
    known = (*OF_EVERY_LAW, *LAWS[law])
    for key in given:
        if key not in known:
            raise CostError(
                f"the {law} law has no key {key}; {allowed_names(key, known)}"
            )
    for key in ("at", "price", *LAWS[law]):
        if key not in given:
            raise CostError(f"cost: the {law} law needs the key {key}; {EXAMPLE}")
    half, (tighter, looser) = half_of(drawn), SPAN
    halves = {"tightest": half / tighter, "loosest": half * looser}
    for key in given.keys() & {"at", *halves}:
        halves[key] = Tolerance(*_read(tolerance, key, given[key], unit)).half
    tightest, loosest = halves["tightest"], halves["loosest"]
    if not tightest < loosest:
        raise CostError("cost: the tightest tolerance is no tighter than the loosest")
    if loosest > WIDEST * tightest:
        raise CostError(
            f"cost: the loosest tolerance is more than {WIDEST} times the tightest; no "
            "run covers both"
        )
    if not tightest * (1 - ROUNDING) <= half <= loosest * (1 + ROUNDING):
        raise CostError(
            "cost: the tolerance of the drawing does not lie between tightest and "
            f"loosest; they are a {tighter:g}th and {looser:g} times that of the "
            "drawing if not given"
        )
    rate = _read(quantity, "rate", str(given["rate"]), unit) if "rate" in given else 0.0
    if "rate" in given and not rate > 0:
        raise CostError(
            "cost, rate: a quantity above zero is expected: the price "
            "is e times as much for each rate that is taken off"
        )
    price = _price("price", given["price"], MOST_PRICE**-1)
    found = Law(halves["at"], price, tightest, loosest, rate)
    for key, end in (("tightest", tightest), ("loosest", loosest)):
        try:
            for each in drawn.values():
                resized(each, end)
            if not 0 < found.of(end) < MOST_LAW:
                raise OverflowError
        except DistributionError as error:
            raise CostError(
                f"cost: with the {key} tolerance, {end / half:.3g} times that of the "
                f"drawing, {error}; give cost another {key}"
            ) from None
        except OverflowError:
            raise CostError(
                f"cost: with rate = {given.get('rate')} the price at the "
                "tightest tolerance is no number; give a larger rate"
            ) from None
    return found


def _read(read: Callable[[str, str], Any], key: str, text: Any, unit: str) -> Any:
    """Read a tolerance or a quantity of a law."""
    if not isinstance(text, str):
        raise CostError(f'cost, {key}: a tolerance such as "+-0.02 mm" is expected')
    try:
        return read(text, unit)
    except UnitError as error:
        raise CostError(f'cost, {key} = "{text}": {error}') from None


def _price(key: str, price: Any, least: float = 0.0) -> float:
    """Read a price: a number without currency."""
    fits = isinstance(price, int | float) and not isinstance(price, bool)
    if not fits or not least <= price <= MOST_PRICE:
        over = "from 0" if least == 0 else "above 0"
        raise CostError(f"cost, {key}: a price is a number {over}, such as 10")
    return float(price)


def with_tolerances(text: str, chosen: Mapping[str, str], heading: str) -> str:
    """Write a study with other tolerances.

    By line of [deviations] or [links]; the heading stands above as a comment, other
    comments are gone.
    """
    table = tomllib.loads(text)
    for name, words in chosen.items():
        section = "links" if name in table.get("links", {}) else "deviations"
        line = with_tolerance(table[section][name], words)
        table[section][name] = line
    above = "".join(f"# {line}\n" for line in heading.splitlines())
    return f"{above}\n{tomli_w.dumps(table)}"


def with_tolerance(line: Mapping[str, Any], words: str) -> dict[str, Any]:
    """Return a line of a study with another tolerance, all other keys as they are."""
    found: dict[str, Any] = {}
    graded = iso286.looks_like_grade(words)
    for key, value in line.items():
        if key in ("tolerance", "iso1328"):
            found["tolerance"] = words
        elif key != "module" and (key != "size" or graded):
            found[key] = value
    return found


def tolerance_words(priced: Priced, choice: float) -> str:
    """Write a chosen tolerance: that of the drawing in its own words, else in figures.

    Three figures of half its width or, where they would be tighter than the tightest,
    as many as that needs; it reaches no farther to either side than what is chosen.
    """
    if not priced.law:
        return priced.offered[round(choice)].words
    if priced.is_drawn(choice):
        return priced.words
    zone = zone_of(next(iter(priced.distributions(choice).values())))
    assert zone is not None
    scale = scale_of(priced.unit, priced.shown)
    lower, upper = (end * scale.factor for end in zone)
    half, least = zone.half * scale.factor, priced.law.tightest * (1 - ROUNDING)
    for figures in range(DIGITS, MOST_DIGITS + 1):
        place = math.floor(math.log10(half)) + 1 - figures
        slack = ROUNDING * half  # binary numbers are a little off what they stand for
        ends = (
            Decimal(math.ceil((lower - slack) / 10.0**place)).scaleb(place),
            Decimal(math.floor((upper + slack) / 10.0**place)).scaleb(place),
        )
        if float(ends[1] - ends[0]) / 2 >= least * scale.factor:
            break
    low, high = (f"{end.normalize() if end else Decimal(0):f}" for end in ends)
    both = f"+-{high}" if zone.lower == -zone.upper else f"{low}..{high}"
    return f"{both} {scale.mark}".strip()
