"""Algebras that evaluate a formula: numbers of all trials, slopes, dimensions.

In dimensions an angle stays an angle while it is alone; with anything else it is a
plain number, so that the length of an arc is radius times angle.
"""

import math
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from tolstat.units.conversion import dimension, si_unit

OPERATIONS = {
    "+": operator.add, "-": operator.sub, "*": operator.mul,
    "/": operator.truediv, "**": operator.pow,
}  # fmt: skip
OF_ONE = {
    "sqrt": np.sqrt, "abs": np.abs, "exp": np.exp, "log": np.log,
    "sin": np.sin, "cos": np.cos, "tan": np.tan,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
}  # fmt: skip
OF_TWO = {
    "atan2": np.arctan2, "hypot": np.hypot, "min": np.minimum, "max": np.maximum,
}  # fmt: skip
# where a function has no value
OUTSIDE = {
    "sqrt": "the root of less than nothing",
    "log": "the logarithm of no number above 0",
    "asin": "the arc sine of what lies beyond -1 and 1",
    "acos": "the arc cosine of what lies beyond -1 and 1",
}


@dataclass(frozen=True)
class Values:
    """An algebra of float64[trial], or of one trial's numbers."""

    links: Mapping[str, Any]  # SI
    strict: bool = False  # refuses a step without a value; else it is NaN or infinite

    def constant(self, value: float) -> Any:
        return np.float64(value)

    def link(self, name: str) -> Any:
        return self.links[name]

    def operation(self, sign: str, left: Any, right: Any) -> Any:
        with np.errstate(all="ignore"):
            found = OPERATIONS[sign](left, right)
        reason = "the power has no value" if sign == "**" else "too large"
        by_zero = sign == "/" and np.any(right == 0)
        return self._known(found, "division by zero" if by_zero else reason)

    def function(self, name: str, arguments: Sequence[Any]) -> Any:
        with np.errstate(all="ignore"):
            if name in OF_ONE:
                found = OF_ONE[name](arguments[0])
            else:
                found = reduce(OF_TWO[name], arguments)
        return self._known(found, OUTSIDE.get(name, "too large"))

    def _known(self, found: Any, reason: str) -> Any:
        if self.strict and not np.all(np.isfinite(found)):
            raise ValueError(f"{reason}, with every link at its nominal value")
        return found


class Slope(NamedTuple):
    """A value, and its derivatives: float64[trial], float64[link, trial]."""

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


class Slopes(Values):
    """An algebra of values and their slopes by every link, by the chain rule."""

    def constant(self, value: float) -> Slope:
        some = next(iter(self.links.values()))
        zero = np.zeros((len(self.links), *np.shape(some)))
        return Slope(super().constant(value), zero)

    def link(self, name: str) -> Slope:
        found = self.constant(0.0).by_link
        found[list(self.links).index(name)] = 1.0
        return Slope(self.links[name], found)

    def operation(self, sign: str, left: Slope, right: Any) -> Slope:
        other = right if sign == "**" else right.value
        value = super().operation(sign, left.value, other)
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
        value = super().function(name, values)
        with np.errstate(all="ignore"):
            if name in DERIVATIVES:
                outer = [DERIVATIVES[name](values[0], value)]
            elif name == "hypot":
                # no slope at the tip
                outer = [x / np.where(value > 0, value, 1.0) for x in values]
            elif name == "atan2":
                y, x = values
                square = x * x + y * y
                outer = [x / square, -y / square]
            else:  # of min or max: the first argument that attains it
                same = [each == value for each in np.broadcast_arrays(*values)]
                outer = [1.0 * (np.argmax(same, 0) == i) for i in range(len(values))]
            parts = [o * each.by_link for o, each in zip(outer, arguments, strict=True)]
        return Slope(value, sum(parts))


PLAIN, ANGLE = dimension("1"), dimension("rad")
NOTHING = object()  # the number 0: it fits any unit
OF_AN_ANGLE = ("sin", "cos", "tan")
TO_AN_ANGLE = ("asin", "acos", "atan")
ALIKE = ("abs", "hypot", "min", "max", "atan2")


@dataclass(frozen=True)
class Dimensions:
    """An algebra of dimensions."""

    units: Mapping[str, str]  # SI, of each link

    def constant(self, value: float) -> Any:
        if value == math.pi:
            return ANGLE  # half a turn
        return PLAIN if value else NOTHING  # 0 is nothing in any unit

    def link(self, name: str) -> Any:
        return dimension(self.units[name])

    def operation(self, sign: str, left: Any, right: Any) -> Any:
        if sign in "+-":
            verb = "added to" if sign == "+" else "taken from"
            return self._alike([right, left], f"cannot be {verb}")
        left = PLAIN if left is NOTHING else left
        if sign == "**":
            return left if right == 1 else _without_angle(left) ** right
        right = PLAIN if right is NOTHING else right
        if sign == "*":
            if PLAIN in (left, right):
                return left if right == PLAIN else right
            return _without_angle(left) * _without_angle(right)
        if right == PLAIN:
            return left
        return _without_angle(left) / _without_angle(right)

    def function(self, name: str, arguments: Sequence[Any]) -> Any:
        if name in ALIKE:
            found = self._alike(arguments, "does not go with")
            return ANGLE if name == "atan2" else found
        (given,) = (PLAIN if each is NOTHING else each for each in arguments)
        if name == "sqrt":
            return _without_angle(given) ** 0.5
        if given != PLAIN and not (given == ANGLE and name in OF_AN_ANGLE):
            angle = "an angle or " if name in OF_AN_ANGLE else ""
            raise ValueError(f"{name} takes {angle}a plain number, not {_words(given)}")
        return ANGLE if name in TO_AN_ANGLE else PLAIN

    def _alike(self, several: Sequence[Any], verb: str) -> Any:
        first, *others = [d for d in several if d is not NOTHING] or [PLAIN]
        for other in others:
            if other != first:
                hint = ""
                if PLAIN in (first, other):
                    hint = '; make the number a link with its unit, such as "2 mm"'
                raise ValueError(f"{_words(first)} {verb} {_words(other)}{hint}")
        return first


def _without_angle(given: Any) -> Any:
    """Return a plain number for an angle; anything else stays as it is."""
    return PLAIN if given == ANGLE else given


def _words(given: Any) -> str:
    unit = si_unit(given)
    return "a plain number" if unit == "1" else f"a quantity in {unit}"
