"""What is assumed of a deviation, as values: reports need no text of the study."""

import math
from collections.abc import Hashable, Iterable, Mapping
from typing import NamedTuple

import numpy as np

from tolstat.deviations.distributions import Tolerance
from tolstat.model.description import Contributor, kinds_of_part
from tolstat.statistics.sensitivity.named_causes import Effect

SCORES = np.linspace(-8.0, 8.0, 513)  # normal scores; hardly a part lies outside
ROUNDING = 1e-12  # of half a tolerance
EQUAL = 9  # digits in which equal distributions agree, however they are written
TURN = 2 * math.pi * (1 - 1e-9)


class Assumed(NamedTuple):
    """Assumptions on a deviation; all numbers are SI."""

    words: str  # its distribution, as the study writes it
    entry: str  # name of its entry in the study
    common: float  # share of the variance common to all parts of the entry
    # ends of the tolerance; of parts without one their quantiles at three sigma
    tolerance: Tolerance
    # where an ever narrower tolerance ends: `tolstat.deviations.spread.fixed_point`; of
    # parts without a tolerance its middle
    centre: float
    nominal_shift: float  # of the nominal value, with the tolerance
    has_places: bool  # whether other keys of the entry move with the tolerance: mode
    mean: float
    sigma: float
    parts: int  # measured parts that the distribution comes from; 0 for none
    quantiles: tuple[float, ...]  # deviations at the normal scores of `SCORES`

    @property
    def has_tolerance(self) -> bool:
        """Whether it has a tolerance; measured parts and constants have none."""
        return not self.parts and self.tolerance.half > 0

    def changed_zone(self, shift: float, ratio: float) -> Tolerance:
        """Return the tolerance, multiplied by a ratio about its centre and shifted.

        Beside the shift of its nominal, as an entry has it.
        """
        fixed, by = self.centre, shift - self.nominal_shift
        ends = (fixed + ratio * (end - fixed) + by for end in self.tolerance)
        least = ROUNDING * self.tolerance.half
        return Tolerance(*(end if abs(end) > least else 0.0 for end in ends))

    @property
    def distribution(self) -> Hashable:
        """Its values, rounded: the same for equal distributions."""
        size = self.tolerance.half or 1.0
        values = np.array([*self.tolerance, self.mean, self.sigma, *self.quantiles])
        values = np.round(values / size, EQUAL) + 0.0  # -0.0 is the same
        return float(f"{size:.{EQUAL}g}"), self.common, values.tobytes()


def is_turn(unit: str, zone: Tolerance) -> bool:
    """Return whether a deviation covers a full turn."""
    return unit == "rad" and zone.upper - zone.lower >= TURN


def effects_of(
    limited: Iterable[str],
    assumed: Mapping[str, Assumed],
    slopes: Mapping[str, Mapping[str, float]],
    contributors: Iterable[Contributor],
) -> dict[str, dict[str, Effect]]:
    """Return the effect of each contributor, by limited response.

    It is not known of one without an assumption, an input of a file of results.
    """
    contributors = [*contributors]
    unknown = {
        part.name: Effect(part.name, math.nan, "")
        for part in contributors
        if part.name not in assumed
    }
    kinds = kinds_of_part(list(assumed), contributors)
    kind_of = {name: kind for kind, members in kinds.items() for name in members}
    distributions = {name: part.distribution for name, part in assumed.items()}
    return {
        response: unknown
        | {
            name: Effect(
                distributions[name],
                slopes.get(response, {}).get(name, math.nan)
                * (part.tolerance.upper - part.tolerance.lower),
                kind_of.get(name, ""),
            )
            for name, part in assumed.items()
        }
        for response in limited
    }
