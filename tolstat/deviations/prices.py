"""What a part costs by its tolerance, and the parts that it would then be.

A price is of one part. It follows a law of half the tolerance's width, T, or stands in
a list of tolerances, of which one is to be chosen.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

from tolstat.deviations.distributions import Distribution
from tolstat.deviations.tolerance import Tolerance

SAME = 1e-9  # of a tolerance: what binary numbers are off


class Law(NamedTuple):
    """A price that falls steadily as the tolerance widens.

    Attributes
    ----------
    at : float
        Half width at which the price is given, SI.
    price : float
        There.
    tightest, loosest : float
        Half widths between which one may be chosen, SI.
    rate : float
        0: the price is reciprocal, price * at / T; else exponential,
        price * exp((at - T) / rate): e times as much for each `rate` that T is less.
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
    """One tolerance that can be had.

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
    """A line of a study that says what its parts cost: they share one tolerance.

    What can be chosen is a number: of a law the logarithm of half the tolerance's width
    (SI), else the place in the list of what is offered, the loosest first.

    Attributes
    ----------
    name : str
        As the line has it.
    drawn : mapping of str to Distribution
        By contributor, as the study has them, SI.
    law : Law or None
        Of the price.
    offered : tuple of Offered
        Where there is no law: all that may be chosen, the loosest first.
    unit, shown : str
        SI unit of the deviations, and the unit in which the tolerance is written.
    words : str
        The tolerance as drawn, as the line has it.
    """

    name: str
    drawn: Mapping[str, Distribution]
    law: Law | None
    offered: tuple[Offered, ...]
    unit: str
    shown: str
    words: str

    @property
    def as_drawn(self) -> float:
        """The choice that is the study's own."""
        if self.law:
            return math.log(half_of(self.drawn))
        halves = [half_of(each.distributions) for each in self.offered]
        return float(halves.index(half_of(self.drawn)))

    def is_drawn(self, choice: float) -> bool:
        """Tell whether a choice is the study's own."""
        return abs(choice - self.as_drawn) < SAME

    @property
    def ends(self) -> tuple[float, float]:
        """The choices of the tightest and of the loosest tolerance."""
        if self.law:
            return math.log(self.law.tightest), math.log(self.law.loosest)
        return float(len(self.offered) - 1), 0.0

    def half(self, choice: float) -> float:
        """Return half the width of a tolerance that is chosen, SI."""
        if self.law:
            return math.exp(choice)
        return half_of(self.offered[round(choice)].distributions)

    def cost(self, choice: float) -> float:
        """Return the price of all parts of the line."""
        if self.law:
            return len(self.drawn) * self.law.of(math.exp(choice))
        return len(self.drawn) * self.offered[round(choice)].price

    def distributions(self, choice: float) -> Mapping[str, Distribution]:
        """Return the distributions of the parts' deviations, by contributor, SI."""
        if not self.law:
            return self.offered[round(choice)].distributions
        half = math.exp(choice)
        return {name: resized(each, half) for name, each in self.drawn.items()}


def zone_of(distribution: Distribution) -> Tolerance | None:
    """Return the tolerance of a distribution; None where it has none."""
    return getattr(distribution, "tolerance", None)


def half_of(distributions: Mapping[str, Distribution]) -> float:
    """Return half the width of the tolerance of parts that share one, SI."""
    zone = zone_of(next(iter(distributions.values())))
    assert zone is not None  # checked when the study was loaded
    return zone.half


def zone_with(zone: Tolerance, half: float) -> Tolerance:
    """Return a zone made narrower or wider: towards zero, or its end nearest to it.

    +-0.2 mm becomes +-0.1 mm, 0..60 um becomes 0..30 um, as a halved tolerance does.

    Parameters
    ----------
    zone : Tolerance
        SI.
    half : float
        Half the width that it is to have, SI.
    """
    still, ratio = zone.nearest, half / zone.half
    return Tolerance(*(still + ratio * (end - still) for end in zone))


def resized(distribution: Distribution, half: float) -> Distribution:
    """Return a distribution with another tolerance, all other keys as they are.

    Raises
    ------
    DistributionError
        If another key does not fit that tolerance.
    """
    zone = zone_of(distribution)
    assert zone is not None  # checked when the study was loaded
    made = dataclasses.replace(cast(Any, distribution), tolerance=zone_with(zone, half))
    return cast(Distribution, made)
