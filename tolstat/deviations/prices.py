"""The price of a part by its tolerance, and its distribution with that tolerance.

The price of one part follows a law of half the tolerance's width, T, or a list of
tolerances, of which one is chosen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from tolstat.deviations.distributions import Distribution
from tolstat.deviations.spread import half_of, resized

SAME = 1e-9  # of a tolerance: rounding errors


class Law(NamedTuple):
    """A price that falls continuously as the tolerance widens.

    Attributes
    ----------
    at, price : float
        Half a width, SI, and the price there.
    tightest, loosest : float
        Ends of the choice of half the width, SI.
    rate : float
        0: the price is reciprocal, price * at / T; else exponential,
        price * exp((at - T) / rate).
    """

    at: float
    price: float
    tightest: float
    loosest: float
    rate: float = 0.0

    def of(self, half: float) -> float:
        """Return the price of one part with half a tolerance, SI."""
        if self.rate:
            return self.price * math.exp((self.at - half) / self.rate)
        return self.price * self.at / half


class Offered(NamedTuple):
    """A tolerance on offer.

    Attributes
    ----------
    words : str
        As the study writes it: "+-1.2 mm", "IT9".
    price : float
        Of one part.
    distributions : mapping of str to Distribution
        Of the parts' deviations with it, by contributor, SI.
    """

    words: str
    price: float
    distributions: Mapping[str, Distribution]


@dataclass(frozen=True)
class Priced:
    """An entry of a study with a price; its parts share one tolerance.

    The choice is a number: with a law the logarithm of half the tolerance's width (SI),
    else the place in the list of offers, the loosest first.

    Attributes
    ----------
    name : str
        Of the entry.
    specified : mapping of str to Distribution
        By contributor, as specified in the study, SI.
    law : Law or None
        Of the price.
    offered : tuple of Offered
        Without a law: all choices, the loosest first.
    unit, shown : str
        SI unit of the deviations, and the unit in which the tolerance is written.
    words : str
        The specified tolerance, as written.
    """

    name: str
    specified: Mapping[str, Distribution]
    law: Law | None
    offered: tuple[Offered, ...]
    unit: str
    shown: str
    words: str

    @property
    def specified_choice(self) -> float:
        """The choice specified in the study."""
        if self.law:
            return math.log(half_of(self.specified))
        halves = [half_of(each.distributions) for each in self.offered]
        return float(halves.index(half_of(self.specified)))

    def is_specified(self, choice: float) -> bool:
        """Tell whether a choice is that of the study."""
        return abs(choice - self.specified_choice) < SAME

    @property
    def ends(self) -> tuple[float, float]:
        """The choices of the tightest and of the loosest tolerance."""
        if self.law:
            return math.log(self.law.tightest), math.log(self.law.loosest)
        return float(len(self.offered) - 1), 0.0

    def half(self, choice: float) -> float:
        """Return half the width of the chosen tolerance, SI."""
        if self.law:
            return math.exp(choice)
        return half_of(self.offered[round(choice)].distributions)

    def cost(self, choice: float) -> float:
        """Return the price of all parts of the entry."""
        if self.law:
            return len(self.specified) * self.law.of(math.exp(choice))
        return len(self.specified) * self.offered[round(choice)].price

    def distributions(self, choice: float) -> Mapping[str, Distribution]:
        """Return the distributions of the parts' deviations, by contributor, SI."""
        if not self.law:
            return self.offered[round(choice)].distributions
        half = math.exp(choice)
        return {name: resized(each, half) for name, each in self.specified.items()}
