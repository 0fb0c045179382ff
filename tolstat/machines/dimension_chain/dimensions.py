"""A formula worked out in dimensions: what may be added, and what the gap is.

An angle stays one while it stands alone; with anything else it is a plain number, so
that the length of an arc is radius times angle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tolstat.units.conversion import dimension, si_unit

PLAIN, ANGLE = dimension("1"), dimension("rad")
NOTHING = object()  # the number 0: it is added to anything
OF_AN_ANGLE = ("sin", "cos", "tan")
TO_AN_ANGLE = ("asin", "acos", "atan")
ALIKE = ("abs", "hypot", "min", "max", "atan2")


@dataclass(frozen=True)
class Dimensions:
    """An algebra of dimensions.

    Attributes
    ----------
    units : mapping of str to str
        SI unit of each link.
    """

    units: Mapping[str, str]

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
    """Let an angle be a plain number beside anything else."""
    return PLAIN if given == ANGLE else given


def _words(given: Any) -> str:
    unit = si_unit(given)
    return "a plain number" if unit == "1" else f"a quantity in {unit}"
