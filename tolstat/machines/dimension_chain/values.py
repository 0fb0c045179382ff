"""A formula worked out in numbers: the closing link of all machines at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

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
    """An algebra of float64[machine], or of one machine's numbers.

    Attributes
    ----------
    links : mapping of str to float64[machine]
        SI.
    strict : bool
        Whether a step without a value is refused; else it is NaN or infinite.
    """

    links: Mapping[str, Any]
    strict: bool = False

    def constant(self, value: float) -> Any:
        return np.float64(value)

    def link(self, name: str) -> Any:
        return self.links[name]

    def operation(self, sign: str, left: Any, right: Any) -> Any:
        with np.errstate(all="ignore"):
            if sign == "+":
                return left + right
            if sign == "-":
                return left - right
            if sign == "*":
                return self._known(left * right, "too large")
            if sign == "/":
                reason = "division by zero" if np.any(right == 0) else "too large"
                return self._known(left / right, reason)
            return self._known(left**right, "the power has no value")

    def function(self, name: str, arguments: Sequence[Any]) -> Any:
        with np.errstate(all="ignore"):
            if name in OF_ONE:
                found = OF_ONE[name](arguments[0])
            else:
                found = reduce(OF_TWO[name], arguments)
        return self._known(found, OUTSIDE.get(name, "too large"))

    def _known(self, found: Any, reason: str) -> Any:
        if self.strict and not np.all(np.isfinite(found)):
            raise ValueError(f"{reason}, where every link is nominal")
        return found
