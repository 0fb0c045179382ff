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
from tolstat.study.cost_entry import (
    DIGITS,
    EXAMPLE,
    SHIFT,
    Priced,
    read,
    read_cost,
    scale_of_entry,
)
from tolstat.study.distribution_entry import OUTERMOST
from tolstat.study.entry_change import Change, NominalShift
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.study_schema import ShiftKeys, read_entry


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
    """Return the choices of an entry by its cost: a tolerance, a shift, or both."""
    if not isinstance(cost, dict) or not cost:
        raise CostError(f"cost: a table is expected, {EXAMPLE}")
    specified = {member: distributions[member] for member in readers}
    if None in map(zone_of, specified.values()):
        raise CostError("cost needs a tolerance; add one to the entry")
    prices = {k: v for k, v in cost.items() if k not in ShiftKeys.model_fields}
    priced = [read_cost(name, prices, keys, readers, specified)] if prices else []
    if len(prices) == len(cost):
        return priced
    shift = {k: v for k, v in cost.items() if k not in prices}
    entry = read_entry(ShiftKeys, shift, "cost has")
    reader = next(iter(readers.values()))
    low, high = read(reader.zone, "shift", entry.shift or "")
    price = entry.shift_price
    if not low <= 0 <= high or low == high or (price and low < 0 < high):
        expected = 'a range around 0 is expected, such as "+-0.2 mm"'
        if price:
            expected = 'with a shift_price it goes to one side, such as "-0.2..0 mm"'
        raise CostError(f'cost, shift = "{entry.shift}": {expected}')
    scale = scale_of_entry(keys, reader, specified)
    words = str(keys.get("nominal_shift", f"0 {scale.mark}".strip()))
    ends = (low, high) if -low > high else (high, low)
    rate = price / max(-low, high)
    return [*priced, Shift(
        SHIFT + name, words, specified, scale, None, permitted=ends, rate=rate
    )]  # fmt: skip
