"""A formula differentiated: its value and its slope by every link, in one pass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from tolstat.machines.dimension_chain.values import Values


class Slope(NamedTuple):
    """A value, and its derivatives: float64[machine], float64[link, machine]."""

    value: Any
    by_link: Any


# derivative of each function of one argument x with value y
DERIVATIVES = {
    "sqrt": lambda x, y: 0.5 / y,
    "abs": lambda x, y: np.sign(x),
    "exp": lambda x, y: y,
    "log": lambda x, y: 1 / x,
    "sin": lambda x, y: np.cos(x),
    "cos": lambda x, y: -np.sin(x),
    "tan": lambda x, y: 1 + y * y,
    "asin": lambda x, y: 1 / np.sqrt(1 - x * x),
    "acos": lambda x, y: -1 / np.sqrt(1 - x * x),
    "atan": lambda x, y: 1 / (1 + x * x),
}


@dataclass(frozen=True)
class Slopes:
    """An algebra of slopes, by the chain rule.

    Attributes
    ----------
    links : mapping of str to float64[machine]
        SI.
    """

    links: Mapping[str, Any]
    _values: Values = field(init=False)

    def __post_init__(self) -> None:
        """Let the values be worked out as those of machines are."""
        object.__setattr__(self, "_values", Values(self.links))

    def constant(self, value: float) -> Slope:
        some = next(iter(self.links.values()))
        zero = np.zeros((len(self.links), *np.shape(some)))
        return Slope(self._values.constant(value), zero)

    def link(self, name: str) -> Slope:
        found = self.constant(0.0).by_link
        found[list(self.links).index(name)] = 1.0
        return Slope(self.links[name], found)

    def operation(self, sign: str, left: Slope, right: Any) -> Slope:
        other = right if sign == "**" else right.value
        value = self._values.operation(sign, left.value, other)
        with np.errstate(all="ignore"):
            if sign == "+":
                return Slope(value, left.by_link + right.by_link)
            if sign == "-":
                return Slope(value, left.by_link - right.by_link)
            if sign == "*":
                both = left.by_link * right.value + left.value * right.by_link
                return Slope(value, both)
            if sign == "/":
                over = left.by_link - value * right.by_link
                return Slope(value, over / right.value)
            power = 0.0 if right == 0 else right * left.value ** (right - 1)
            return Slope(value, power * left.by_link)

    def function(self, name: str, arguments: Sequence[Slope]) -> Slope:
        values = [each.value for each in arguments]
        value = self._values.function(name, values)
        with np.errstate(all="ignore"):
            if name in DERIVATIVES:
                outer = [DERIVATIVES[name](values[0], value)]
            elif name == "hypot":
                # at its tip it has none: no direction more than another
                outer = [x / np.where(value > 0, value, 1.0) for x in values]
            elif name == "atan2":
                y, x = values
                square = x * x + y * y
                outer = [x / square, -y / square]
            else:  # of the least or largest: the first that is it
                same = [each == value for each in np.broadcast_arrays(*values)]
                outer = [1.0 * (np.argmax(same, 0) == i) for i in range(len(values))]
            parts = [o * each.by_link for o, each in zip(outer, arguments, strict=True)]
        return Slope(value, sum(parts))
