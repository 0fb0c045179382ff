"""Algebras that evaluate a formula: numbers of all trials, slopes, dimensions.

In dimensions an angle stays an angle among plain numbers and times; with anything else
it is a plain number, so that the length of an arc is radius times angle, and its speed
radius times speed of turning.
"""

import math
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Any, NamedTuple, Self

import numpy as np

from tolstat.units.conversion import dimension, si_unit, to_si

OPERATIONS = {
    "+": operator.add, "-": operator.sub, "*": operator.mul,
    "/": operator.truediv, "**": operator.pow,
}  # fmt: skip
OF_ONE: dict[str, Any] = {
    "sqrt": np.sqrt, "abs": np.abs, "exp": np.exp, "log": np.log,
    "sin": np.sin, "cos": np.cos, "tan": np.tan,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "tanh": np.tanh,
    "floor": np.floor, "ceil": np.ceil, "round": np.round, "sign": np.sign,
}  # fmt: skip
OF_TWO = {
    "atan2": np.arctan2, "hypot": np.hypot, "min": np.minimum, "max": np.maximum,
    "mod": np.mod, "power": np.power,
}  # fmt: skip
COMPARISONS: dict[str, Any] = {
    "<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal,
}  # fmt: skip
CHOICE = "IF"  # of a condition, what holds if it is met, and what if not
STEPS = ("floor", "ceil", "round")
SMALL = 1e-3  # of the terms: a larger error does not show that a value is none
WITH_ZEROS = ("sin", "cos", "tan", "log")  # where their argument is not zero
# where a function has no value
OUTSIDE = {
    "sqrt": "the root of less than nothing",
    "log": "the logarithm of no number above 0",
    "asin": "the arc sine of what lies beyond -1 and 1",
    "acos": "the arc cosine of what lies beyond -1 and 1",
}


class Quantity(float):
    """A number with its unit, typed in a formula: "30 deg", "0.5 mm"."""

    unit: str  # SI
    text: str

    def __new__(cls, number: float, unit: str) -> Self:
        """Return it from the number in that unit; `UnitError` if there is none."""
        si = si_unit(dimension(unit))
        if si == "K" and unit != "K":
            raise ValueError(
                f"{unit} leaves open whether a difference or a temperature is meant; "
                "write K, or make it a link"
            )
        quantity = super().__new__(cls, to_si(number, unit, si))
        quantity.unit, quantity.text = si, f"{number:g} {unit}"
        return quantity

    def __repr__(self) -> str:
        """Return it as typed."""
        return self.text


@dataclass(frozen=True)
class Values:
    """An algebra of float64[trial], or of one trial's numbers."""

    links: Mapping[str, Any]  # SI
    strict: bool = False  # refuses a step without a value; else it is NaN or infinite
    # what names that are no links stand for, as the algebra has it: solved unknowns
    solved: Mapping[str, Any] = field(default_factory=dict)

    def constant(self, value: Any) -> Any:
        return np.float64(value)

    def link(self, name: str) -> Any:
        return self.solved[name] if name in self.solved else self.links[name]

    def implicit(self, value: Any, parts: Sequence["Part"]) -> Any:
        """Return the solved unknown of equations, with its derivatives by these."""
        return value

    def operation(self, sign: str, left: Any, right: Any) -> Any:
        with np.errstate(all="ignore"):
            result = OPERATIONS[sign](left, right)
        reason = "the power has no value" if sign == "**" else "too large"
        by_zero = sign == "/" and np.any(right == 0)
        return self._checked(result, "division by zero" if by_zero else reason)

    def function(self, name: str, arguments: Sequence[Any]) -> Any:
        with np.errstate(all="ignore"):
            if name in OF_ONE:
                result = OF_ONE[name](arguments[0])
            elif name == CHOICE:
                result = np.where(*arguments)
            elif name in COMPARISONS:
                return COMPARISONS[name](*arguments)
            else:
                result = reduce(OF_TWO[name], arguments)
        return self._checked(result, OUTSIDE.get(name, "too large"))

    def _checked(self, result: Any, reason: str) -> Any:
        if self.strict and not np.all(np.isfinite(result)):
            raise ValueError(f"{reason}, with every link at its nominal value")
        return result


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
    "tanh": lambda x, y: 1 - y * y,
    **dict.fromkeys((*STEPS, "sign"), lambda x, y: 0.0 * x),
}


Part = tuple[Any, Any]  # the derivative of a step by one of its values, and that value


class Derived(Values):
    """An algebra of values that carry something along, by the chain rule."""

    def operation(self, sign: str, left: Any, right: Any) -> Any:
        other = right if sign == "**" else right.value
        value = super().operation(sign, left.value, other)
        with np.errstate(all="ignore"):
            if sign == "**":
                power = 0.0 if right == 0 else right * left.value ** (right - 1)
                return self.carried(sign, value, [(power, left)])
            outer = {"*": (other, left.value), "/": (1.0, -value), "-": (1.0, -1.0)}
            first, second = outer.get(sign, (1.0, 1.0))
            divisor = other if sign == "/" else 1.0
            return self.carried(sign, value, [(first, left), (second, right)], divisor)

    def function(self, name: str, arguments: Sequence[Any]) -> Any:
        if name == CHOICE:
            condition, *choices = arguments
            chosen = (np.where(condition, *both) for both in zip(*choices, strict=True))
            return type(choices[0])(*chosen)
        values = [argument.value for argument in arguments]
        if name in COMPARISONS:
            return super().function(name, values)
        value = super().function(name, values)
        with np.errstate(all="ignore"):
            outer = derivatives(name, values, value)
            return self.carried(name, value, [*zip(outer, arguments, strict=True)])

    def implicit(self, value: Any, parts: Sequence[Part]) -> Any:
        """Return it by the implicit function theorem."""
        return self.carried("", value, parts)

    def carried(
        self, name: str, value: Any, parts: Sequence[Part], divisor: Any = 1.0
    ) -> Any:
        """Return a step's value with what its parts carry, times their derivatives.

        A quotient's derivatives are still to be divided by its divisor.
        """
        raise NotImplementedError


class Slopes(Derived):
    """An algebra of values and their slopes by every link."""

    def constant(self, value: Any) -> Slope:
        link = next(iter(self.links.values()))
        zero = np.zeros((len(self.links), *np.shape(link)))
        return Slope(super().constant(value), zero)

    def link(self, name: str) -> Slope:
        if name in self.solved:
            solved: Slope = self.solved[name]
            return solved
        by_link = self.constant(0.0).by_link
        by_link[list(self.links).index(name)] = 1.0
        return Slope(self.links[name], by_link)

    def carried(
        self, name: str, value: Any, parts: Sequence[Part], divisor: Any = 1.0
    ) -> Slope:
        return Slope(value, sum(outer * x.by_link for outer, x in parts) / divisor)


def derivatives(name: str, arguments: Sequence[Any], value: Any) -> list[Any]:
    """Return the derivatives of a function by each of its arguments."""
    if name in DERIVATIVES:
        return [DERIVATIVES[name](arguments[0], value)]
    if name == "hypot":
        # no slope at the tip
        return [x / np.where(value > 0, value, 1.0) for x in arguments]
    if name == "mod":
        return [np.ones_like(value), -np.floor_divide(*arguments)]
    if name == "power":
        base, exponent = arguments
        return [exponent * base ** (exponent - 1), np.log(base) * value]
    if name == "atan2":
        y, x = arguments
        square = x * x + y * y
        return [x / square, -y / square]
    # of min or max: the first argument that attains it
    same = [argument == value for argument in np.broadcast_arrays(*arguments)]
    return [1.0 * (np.argmax(same, 0) == i) for i in range(len(arguments))]


class Rounded(NamedTuple):
    """A value, and the rounding error that it may have: float64[trial]."""

    value: Any
    error: Any
    size: Any  # what it would be if its terms did not take each other away


class Roundings(Derived):
    """An algebra of values without rounding errors: what is none but that is 0.

    Where terms take each other away, in a sum or at a zero of a function, an error of
    the terms stays: 72.5 - 16 - 16 - 38 - 2.5 is -4.8e-15. It is compared with the
    terms of the same trial: exp(-60) is small, and no rounding error. An error that is
    not small beside these terms proves nothing: tan(90 deg) is large, and not 0.
    """

    def constant(self, value: Any) -> Rounded:
        return Rounded(np.float64(value), self._unit * abs(value), abs(value))

    def link(self, name: str) -> Rounded:
        if name in self.solved:
            solved: Rounded = self.solved[name]
            return solved
        size = np.abs(self.links[name])
        return Rounded(self.links[name], self._unit * size, size)

    def function(self, name: str, arguments: Sequence[Any]) -> Any:
        if name in STEPS:  # what is whole but for rounding is whole
            x = arguments[0]
            nearest = np.round(x.value)
            whole_number = np.abs(x.value - nearest) <= x.error
            arguments = [x._replace(value=np.where(whole_number, nearest, x.value))]
        return super().function(name, arguments)

    @property
    def _unit(self) -> float:
        return len(self.links) * float(np.finfo(float).eps)

    def carried(
        self, name: str, value: Any, parts: Sequence[Part], divisor: Any = 1.0
    ) -> Rounded:
        error = sum(np.abs(outer) * x.error for outer, x in parts)
        sizes, under = [x.size for _, x in parts], np.abs(divisor)
        if name in ("+", "-"):
            return _without_rounding(value, error, np.maximum(*sizes))
        if name in WITH_ZEROS:  # of a size of one where they rise and fall
            return _without_rounding(value, error, np.maximum(np.abs(value), 1.0))
        if name == "*":
            return Rounded(value, error, sizes[0] * sizes[1])
        if name == "/":
            return Rounded(value, error / under, sizes[0] / under)
        return Rounded(value, error, np.abs(value))


def _without_rounding(value: Any, error: Any, size: Any) -> Rounded:
    """Return a value, 0 where it is a rounding error; an error may be unknown."""
    nothing = (np.abs(value) <= error) & (error < SMALL * size)
    if np.any(nothing):
        value = np.where(nothing, 0.0, value)
    return Rounded(value, error, size)


class CleanSlope(NamedTuple):
    """A value and its rounding error as `Rounded` has them, and its slopes."""

    value: Any
    error: Any
    size: Any
    by_link: Any


class CleanSlopes(Roundings, Slopes):
    """Slopes of values without rounding errors: what is none but that is 0, too.

    The slopes of S*S and of |S| are zero where the terms of S take each other away.
    """

    def constant(self, value: Any) -> Any:
        slope = Slopes.constant(self, value)
        return CleanSlope(*Roundings.constant(self, value), slope.by_link)

    def link(self, name: str) -> Any:
        if name in self.solved:
            return self.solved[name]
        return CleanSlope(*Roundings.link(self, name), Slopes.link(self, name).by_link)

    def carried(
        self, name: str, value: Any, parts: Sequence[Part], divisor: Any = 1.0
    ) -> Any:
        by_link = Slopes.carried(self, name, value, parts, divisor).by_link
        terms = sum(np.abs(outer * x.by_link) for outer, x in parts) / np.abs(divisor)
        clean = np.where(np.abs(by_link) <= self._unit * terms, 0.0, by_link)
        return CleanSlope(*Roundings.carried(self, name, value, parts, divisor), clean)


PLAIN, ANGLE, PER_TIME = dimension("1"), dimension("rad"), dimension("Hz")
OF_AN_ANGLE = ("sin", "cos", "tan")
TO_AN_ANGLE = ("asin", "acos", "atan")
ALIKE = ("abs", "hypot", "min", "max", "atan2", "mod", *COMPARISONS)
BARE = (
    "{} of a plain number leaves open whether degrees or radians are meant; make it a "
    'link with its unit, "30 deg" or "30 rad"; a number of degrees in a formula is '
    "written 30 deg, and a link of an angle needs no factor"
)


class Kind(NamedTuple):
    """What a step of a formula is: a dimension, and where a plain number comes from."""

    dimension: Any
    ratio: bool = False  # of quantities, such as arc over radius: an angle in radians

    @property
    def unit(self) -> str:
        """SI unit; that of a square of angles is a plain number."""
        return si_unit(_settled(self).dimension)


NOTHING = Kind(None)  # the number 0: it fits any unit


@dataclass(frozen=True)
class Dimensions:
    """An algebra of dimensions.

    It tells a bare number, as typed, from a ratio of quantities: what a sine takes.
    """

    units: Mapping[str, str]  # SI, of each link

    def constant(self, value: float) -> Kind:
        if isinstance(value, Quantity):
            return Kind(dimension(value.unit))
        if value == math.pi:
            return Kind(ANGLE)  # half a turn
        return Kind(PLAIN) if value else NOTHING  # 0 is nothing in any unit

    def link(self, name: str) -> Kind:
        return Kind(dimension(self.units[name]))

    def operation(self, sign: str, left: Kind, right: Any) -> Kind:
        if sign in "+-":
            verb = "added to" if sign == "+" else "taken from"
            return self._alike([right, left], f"cannot be {verb}")
        left = Kind(PLAIN) if left is NOTHING else left
        if sign == "**":
            return left._replace(dimension=left.dimension**right)
        right = Kind(PLAIN) if right is NOTHING else right
        first, second = left.dimension, right.dimension
        if _is_turning(first) and _is_turning(second):
            # 180/pi*angle is a plain number again: of degrees
            both = first * second if sign == "*" else first / second
            return Kind(both, both == PLAIN and (left.ratio or right.ratio))
        if sign == "/" and (first, second) == (PER_TIME, ANGLE):
            return left  # sqrt(k/m)/(2*pi): radians a second, of a turn
        first, second = _beside(first, second), _beside(second, first)
        both = first * second if sign == "*" else first / second
        return Kind(both, both == PLAIN)

    def function(self, name: str, arguments: Sequence[Kind]) -> Kind:
        if name in ALIKE:
            same = self._alike(arguments, "does not go with")
            return Kind(ANGLE) if name == "atan2" else same
        if name == CHOICE:
            return self._alike(arguments[1:], "does not go with")
        if name == "sign":
            return Kind(PLAIN)
        if name == "power":
            for kind in arguments:
                if kind is not NOTHING and kind.dimension != PLAIN:
                    raise ValueError(
                        "an exponent is a plain number, and so is the base of a link "
                        f"as exponent, not {_words(kind)}"
                    )
            return Kind(PLAIN)
        (kind,) = arguments
        if name in OF_AN_ANGLE:
            return self._of_an_angle(name, kind)
        kind = _settled(Kind(PLAIN) if kind is NOTHING else kind)
        if name == "sqrt":
            return kind._replace(dimension=kind.dimension**0.5)
        if kind.dimension != PLAIN:
            raise ValueError(f"{name} takes a plain number, not {_words(kind)}")
        return Kind(ANGLE if name in TO_AN_ANGLE else PLAIN)

    def _of_an_angle(self, name: str, kind: Kind) -> Kind:
        if kind is NOTHING or kind.dimension == ANGLE or kind.ratio:
            return Kind(PLAIN)
        if _is_turning(kind.dimension):
            raise ValueError(BARE.format(name))
        raise ValueError(
            f"{name} takes an angle, or a ratio such as arc over radius, not "
            f"{_words(kind)}"
        )

    def _alike(self, several: Sequence[Kind], verb: str) -> Kind:
        kinds = [_settled(kind) for kind in several if kind is not NOTHING]
        first, *others = kinds or [Kind(PLAIN)]
        for other in others:
            if other.dimension != first.dimension:
                hint, both = "", [first.dimension, other.dimension]
                if PLAIN in both:
                    unit = "30 deg" if ANGLE in both else "2 mm"
                    hint = f'; write the number with its unit, such as "{unit}"'
                raise ValueError(f"{_words(first)} {verb} {_words(other)}{hint}")
        return first._replace(ratio=all(kind.ratio for kind in kinds or [first]))


def _is_turning(dimension: Any) -> bool:
    """Tell a plain number, an angle, and its powers from what has another dimension."""
    return not set(dimension) - {"[angle]"}


def _beside(dimension: Any, other: Any) -> Any:
    """Return an angle, or its speed, without the angle beside what has none."""
    turning, others = {"[angle]", "[time]"}, set(other)
    if not set(dimension) <= turning or others <= turning or "[angle]" in others:
        return dimension
    return dimension / ANGLE ** dimension.get("[angle]", 0)


def _settled(kind: Kind) -> Kind:
    """Return a plain number for a power of an angle; anything else stays as it is."""
    plain = _is_turning(kind.dimension) and kind.dimension != ANGLE
    return kind._replace(dimension=PLAIN) if plain else kind


def _words(kind: Kind) -> str:
    unit = kind.unit
    return "a plain number" if unit == "1" else f"a quantity in {unit}"
