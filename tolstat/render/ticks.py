"""Where the numbers along an axis stand, and where it ends."""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from tolstat.arrays import Array
from tolstat.document.plot import PlotAxis

LINEAR = 10.0  # up to here an axis "symlog" is linear
MARGIN = 0.05  # of an axis, beside what it shows
STEPS = 1.0, 2.0, 2.5, 5.0, 10.0
SHARES = (1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.5)  # along an axis of normal scores
NEAR = 1e-9  # of a step, or of an axis
DECADE = 0.6  # part of one, up to which a logarithmic axis has even numbers
POWERS = "log", "symlog"  # scales whose numbers are powers of ten
LEAST_POWER, MOST_POWER = -323.0, 308.25  # of a float
MOST_WORDS = 32  # along an axis; of more some are written


def _logarithm(x: Array) -> Array:
    return np.log10(np.where(x > 0, x, np.nan))


def _symmetric(x: Array) -> Array:
    far = 1 + np.log10(np.maximum(np.abs(x), LINEAR) / LINEAR)
    return np.where(np.abs(x) > LINEAR, np.sign(x) * far, x / LINEAR)


TRANSFORMS: dict[str, Callable[[Array], Array]] = {
    "": np.asarray, "log": _logarithm, "symlog": _symmetric, "normal": ndtri,
}  # fmt: skip


INVERSES: dict[str, Callable[[Array], Array]] = {  # of all but normal scores
    "": np.asarray, "log": lambda x: 10.0**x, "normal": np.asarray,
    "symlog": lambda x: np.where(
        np.abs(x) > 1, np.sign(x) * LINEAR * 10.0 ** (np.abs(x) - 1), LINEAR * x
    ),
}  # fmt: skip


class Tick(NamedTuple):
    """Words along an axis, and where they stand: from 0 to 1."""

    part: float
    words: str


class Ruler(NamedTuple):
    """An axis in the picture: where values are, between its ends."""

    axis: PlotAxis
    low: float  # ends, transformed
    high: float

    @classmethod
    def over(cls, axis: PlotAxis, shapes: Iterable[tuple[Array, bool]]) -> "Ruler":
        """Return the axis that has room for values; some are based on zero."""
        transform, based, every = TRANSFORMS[axis.scale], False, [np.empty(0)]
        for values, on_zero in shapes:
            places = transform(values[np.isfinite(values)])
            every.append(places[np.isfinite(places)])
            based |= on_zero
        if axis.ends:
            low, high = transform(np.array(axis.ends)).tolist()
            return cls(axis, low, high)
        places = np.concatenate(every)
        low, high = places.min(initial=np.inf), places.max(initial=-np.inf)
        if not len(places):
            low, high = 0.0, 1.0
        if axis.scale == "normal":
            score = float(ndtri(ndtr(-max(abs(low), abs(high))) / 2))
            return cls(axis, score, -score)
        margin = MARGIN * ((high - low) or abs(low) or 1.0)
        at_zero = based and low < high  # bars of no height still have an axis
        low = low if at_zero and low == 0 else low - margin
        high = high if at_zero and high == 0 else high + margin
        if axis.scale in POWERS:
            least = -MOST_POWER if axis.scale == "symlog" else LEAST_POWER
            low, high = max(low, least), min(high, MOST_POWER)
        return cls(axis, float(low), float(high))

    def part(self, values: Array) -> Array:
        """Return where values are, from 0 to 1; infinite ones at its ends."""
        with np.errstate(invalid="ignore"):
            places = TRANSFORMS[self.axis.scale](values)
        places = np.where(np.isneginf(values), self.low, places)
        places = np.where(np.isposinf(values), self.high, places)
        return np.asarray((places - self.low) / (self.high - self.low))

    def ticks(self, most: int) -> list[Tick]:
        """Return parts of the axis with their words, about so many."""
        low, high = self.low, self.high
        match self.axis:
            case PlotAxis(words=(_, *_) as words):
                step = -(-len(words) // MOST_WORDS)
                named = [(float(i), word) for i, word in enumerate(words)][::step]
            case PlotAxis(scale="normal"):
                shares = {*SHARES, *(1 - share for share in SHARES)}
                named = [(share, f"{100 * share:.10g}") for share in shares]
            case PlotAxis(scale="log") if high - low > DECADE:
                decades = range(math.floor(low), math.ceil(high) + 1)
                digits = (1.0,) if high - low > 2 else (1.0, 2.0, 5.0)
                step = max(1, round((high - low) / most))
                numbers = [d * _power(n) for n in decades[::step] for d in digits]
                named = [(number, f"{number:g}") for number in numbers]
            case PlotAxis(scale="log"):
                named = _linear(10.0**low, 10.0**high, most)
            case PlotAxis(scale="symlog") if max(abs(low), abs(high)) <= 1:
                named = _linear(LINEAR * low, LINEAR * high, most)
            case PlotAxis(scale="symlog"):
                far = max(abs(low), abs(high))
                digits = (0.2, 0.5, 1.0) if far <= 2 else (1.0,)
                sizes = [
                    d * LINEAR * _power(n)
                    for n in range(math.ceil(far) + 1) for d in digits
                ]  # fmt: skip
                named = [(x, f"{x:g}") for x in (0.0, *sizes, *(-x for x in sizes))]
            case _:
                named = _linear(low, high, most)
        parts = self.part(np.array([value for value, _ in named])).tolist()
        return [
            Tick(part, words)
            for part, (value, words) in zip(parts, named, strict=True)
            if -NEAR <= part <= 1 + NEAR and math.isfinite(value)
        ]


def shared(rulers: Sequence[Ruler]) -> list[Ruler]:
    """Return axes with the same ends."""
    low, high = min(r.low for r in rulers), max(r.high for r in rulers)
    return [ruler._replace(low=low, high=high) for ruler in rulers]


def _power(exponent: int) -> float:
    """Return a power of ten, infinite above the largest number."""
    return float(f"1e{exponent}")


def _linear(low: float, high: float, most: int) -> list[tuple[float, str]]:
    """Return round numbers at equal distances, with as many decimals as these need."""
    rough = (high - low) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(s * power for s in STEPS if s * power >= rough * (1 - NEAR))
    numbers = range(math.ceil(low / step - NEAR), math.floor(high / step + NEAR) + 1)
    largest = max(abs(low), abs(high))
    if not 1e-4 <= largest < 1e7:
        digits = max(10, math.ceil(math.log10(largest / step)) + 2)  # of a part of it
        return [(i * step, f"{i * step:.{digits}g}") for i in numbers]
    decimals = next(d for d in range(20) if abs(round(step, d) - step) <= NEAR * step)
    return [(i * step, f"{i * step:.{decimals}f}") for i in numbers]
