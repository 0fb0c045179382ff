"""The key `shift` of a cost: shifts of a nominal that an entry permits."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from types import MappingProxyType
from typing import Any

import numpy as np

from tolstat.deviations.distributions import Distribution, Tolerance, Uniform
from tolstat.deviations.spread import Shifted, half_of, unshifted, zone_of
from tolstat.errors import CostError
from tolstat.study.cost_entry import DIGITS, EXAMPLE, SHIFT, Priced, read, read_cost
from tolstat.study.distribution_entry import OUTERMOST, written_unit
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.study_schema import ShiftKeys, read_entry
from tolstat.units.scale import scale_of


@dataclass(frozen=True)
class Shift(Priced):
    """A shift of the nominal of all parts of an entry.

    The choice is the shift, SI; NaN stands for parts all over the permitted shifts.
    """

    permitted: tuple[float, float] = (0.0, 0.0)  # both ends, the dearer first
    rate: float = 0.0  # the price of one part, by SI unit of the shift

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
            return {name: Shifted(each, choice) for name, each in parts.items()}
        ends = np.array([each.deviations(OUTERMOST) for each in parts.values()])
        low, high = ends.min() + min(self.permitted), ends.max() + max(self.permitted)
        return dict.fromkeys(parts, Uniform(Tolerance(low, high)))

    def text(self, choice: float) -> str:
        """Return a shift as text, with the digits of three figures of the tolerance."""
        if math.isnan(choice) or self.is_specified(choice):
            return self.words
        size = math.log10(half_of(self.specified) * self.scale.factor)
        place = math.floor(size) + 1 - DIGITS
        shown = Decimal(round(choice * self.scale.factor / 10.0**place)).scaleb(place)
        return f"{shown.normalize():f} {self.scale.mark}".strip()


def distributions_of(
    priced: Sequence[Priced], choice: Sequence[float]
) -> dict[str, Distribution]:
    """Return the distributions of chosen tolerances and shifts, by contributor, SI."""
    found: dict[str, Distribution] = {}
    for each, x in zip(priced, choice, strict=True):
        found.update(each.distributions(x, found))
    return found


def read_costs(
    name: str,
    given: Any,
    keys: Mapping[str, Any],
    readers: Mapping[str, DeviationReader],
    found: Mapping[str, Distribution],
) -> list[Priced]:
    """Return the choices of an entry by its cost: a tolerance, a shift, or both."""
    if not isinstance(given, dict) or not given:
        raise CostError(f"cost: a table is expected, {EXAMPLE}")
    specified = {name: found[name] for name in readers}
    if None in map(zone_of, specified.values()):
        raise CostError("cost needs a tolerance; add one to the entry")
    rest = {k: v for k, v in given.items() if k not in ShiftKeys.model_fields}
    priced = [read_cost(name, rest, keys, readers, specified)] if rest else []
    if len(rest) == len(given):
        return priced
    own = {k: v for k, v in given.items() if k not in rest}
    entry = read_entry(ShiftKeys, own, "cost has")
    reader = next(iter(readers.values()))
    low, high = read(reader.zone, "shift", entry.shift or "")
    price = entry.shift_price
    if not low <= 0 <= high or low == high or (price and low < 0 < high):
        words = 'a range around 0 is expected, such as "+-0.2 mm"'
        if price:
            words = 'with a shift_price it goes to one side, such as "-0.2..0 mm"'
        raise CostError(f'cost, shift = "{entry.shift}": {words}')
    scale = scale_of(
        reader.contributor.unit, written_unit(keys, reader), half_of(specified)
    )
    words = str(keys.get("nominal_shift", f"0 {scale.mark}".strip()))
    rate = price / max(-low, high)
    ends = (low, high) if -low > high else (high, low)
    shift = Shift(
        SHIFT + name, words, specified, scale, None, permitted=ends, rate=rate
    )
    return [*priced, shift]
