"""Deviations against the nominal size of their contributor: one rule, every entrance.

Tolerances, single deviations, columns of files and axes of grids pass here. Per cent is
of the nominal size. Values that can only be sizes are taken as sizes, with a warning;
what may be either is refused.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.distributions import Tolerance
from tolstat.errors import DistributionError, UnitError
from tolstat.model.description import Contributor
from tolstat.units import grammar
from tolstat.units.conversion import to_si
from tolstat.units.scale import KNOWN, Scale, figures, scale_of

FARTHEST = 0.5  # of the nominal size: what deviates more is doubted
WIDE, VERY_WIDE = 0.1, 1 / 3  # of the nominal size: wider ones are noted, warned of
TINY = 1e-3  # of a nominal number: a smaller deviation may be meant as a share
FAR = 10  # times their width away from zero: values may be sizes, not deviations
# between units that are mistaken for each other: in, cm, mm, um, m; deg and rad
FACTORS = (10, 25.4, 57.3, 100, 1000)
NEAR = 0.02  # of the nominal: means of sizes in a mistaken unit
SHOWN = 7  # figures of a size
ROUNDING = 1e-9  # of a size
TURN = 2 * math.pi * (1 - ROUNDING)  # a phase over it is no size
SHARES = ("%", "ppm")
_PLUS = re.compile(r"(?<![eE])\+|±")  # what is typed with it is no size

Holds = Literal["", "sizes", "deviations"]  # of a column; "" where the study is silent
HOLDS: tuple[Holds, ...] = ("sizes", "deviations")


def are_sizes(values: Array, size: float) -> bool:
    """Return whether values can only be sizes of a part, and not its deviations."""
    most = _farthest(size)
    close = (np.abs(values - size) <= most).all()
    return bool(close and (np.abs(values) > most).any())


def _farthest(size: float) -> float:
    """Return the largest deviation of a size that is not doubted."""
    return FARTHEST * abs(size) * (1 + ROUNDING)


def _is_far(values: Array) -> bool:
    """Return whether values are far from zero for their width, as sizes are."""
    return float(np.abs(values).min()) > FAR * float(np.ptp(values)) > 0


def _less_nominal(sizes: Array, nominal: float) -> Array:
    """Return sizes less the nominal one; what is left by rounding alone is 0."""
    deviations = sizes - nominal
    none = np.abs(deviations) <= ROUNDING**1.5 * abs(nominal)
    return np.where(none, 0.0, deviations)


class DeviationReader:
    """Reads the deviations of one contributor.

    Attributes
    ----------
    contributor : Contributor
        Its `size` is the nominal value, SI; None where it has none.
    size : float
        Its nominal value, SI; 0 where it has none.
    warnings, notes : list of str
        What is not read as it stands, or looks wrong; what is wide.
    """

    def __init__(self, contributor: Contributor) -> None:
        self.contributor = contributor
        self.warnings: list[str] = []
        self.notes: list[str] = []
        self.size = contributor.size or 0.0
        self._nominal_typed = False

    @property
    def is_relative(self) -> bool:
        """Whether its deviations are shares of a nominal value that is not known."""
        part = self.contributor
        return part.unit == "1" and part.size is None and part.shown in ("", *SHARES)

    def is_sized(self, entry: Mapping[str, Any]) -> bool:
        """Whether the part has a nominal value, of the model or that of its grade."""
        return bool(self.size) or "size" in entry

    def size_of_grade(self, text: str) -> float:
        """Return the size of a grade, SI; warn if the nominal is another."""
        size = grammar.quantity(text, "m")
        if self.size and abs(size - abs(self.size)) > ROUNDING * size:
            self.warnings.append(
                f"{self.contributor.name}: the grade is that of {text}, the nominal "
                f"size is {self._words(self.size)}"
            )
        return size

    def with_nominal(self, text: str) -> "DeviationReader":
        """Return a reader by a typed nominal size; that of the model stays the same."""
        nominal = grammar.quantity(text, self.contributor.unit)
        if self.size and abs(nominal - self.size) > ROUNDING * abs(self.size):
            raise DistributionError(
                f"nominal = '{text}', but {self.contributor.name} is nominally "
                f"{self._words(self.size)}; leave nominal out, or change the model's"
            )
        reader = DeviationReader(replace(self.contributor, size=nominal))
        reader._nominal_typed = not self.size
        return reader

    def needs_sign(self, deviations: Sequence[float]) -> bool:
        """Return whether deviations without a sign may be read as sizes."""
        farthest = max(map(abs, deviations))
        large = bool(self.size) and farthest > FARTHEST * abs(self.size)
        return large or (self.is_relative and min(deviations) > 0)

    def shown_unit(self, unit: str) -> str:
        """Return a typed unit, or for a share of a size the unit of that."""
        part = self.contributor
        return part.shown if unit in SHARES and not self.is_relative else unit

    def zone(self, text: str) -> Tolerance:
        """Return a tolerance, SI: the zone of the deviation.

        Raises
        ------
        UnitError, DistributionError
            If it cannot be read, or may be a zone of sizes as well.
        """
        ends = self._read(grammar.tolerance, text)
        if self.is_relative and ends[0] > 0 and not _PLUS.search(text):
            raise DistributionError(self._either(f'"{text}"', ends))
        return Tolerance(*self._settled(ends, text).tolist())

    def deviation(self, text: str) -> float:
        """Return one deviation, SI, of a text that may be a size; see `zone`."""
        return float(self.axis([text])[0])

    def mean(self, text: str) -> float:
        """Return the mean of a process less the nominal, SI; it may be a size."""
        before = len(self.warnings)
        value = self.deviation(text)
        del self.warnings[before:]
        return value

    def axis(self, texts: Sequence[str]) -> Array:
        """Return deviations that belong together, float64[text], SI; see `zone`."""
        values = [self._read(grammar.quantity, text) for text in texts]
        typed = texts[0] if len(texts) == 1 else f"{texts[0]}, ..., {texts[-1]}"
        return self._settled(np.concatenate(values), typed)

    def difference(self, text: str) -> float:
        """Return a difference of two deviations, SI, which is no size; see `zone`."""
        value = float(self._read(grammar.quantity, text)[0])
        if self.size and abs(value) > FARTHEST * abs(self.size):
            raise DistributionError(
                f'"{text}" is more than half of the nominal {self._words(self.size)}; '
                "a distance is expected, not a size"
            )
        return value

    def column(
        self, numbers: Sequence[float], unit: str, holds: Holds, places: Sequence[str]
    ) -> tuple[Array, bool]:
        """Return deviations, float64[row], SI, and whether the column holds sizes.

        Parameters
        ----------
        numbers : sequence of float
            As written.
        unit : str
            In which they are written; empty where none is given, "1" for none.
        holds : str
            What the study says that they are.
        places : sequence of str
            File and line of each.

        Raises
        ------
        UnitError, DistributionError
            If the unit is of another kind, or a number is neither a size nor a
            deviation of this part.
        """
        if self.is_relative and not unit:
            raise UnitError(
                f"{self.contributor.name} deviates relative to its nominal value: give "
                'the unit of the column, "%", or "1" where 0.1 is a tenth'
            )
        written, factor = self._unit_and_factor(unit or "1")
        plain = "" if unit == "1" else unit
        values = np.array([to_si(x, plain, written) for x in numbers]) * factor
        size = 1.0 if self.is_relative else self.size
        if not size:
            self._warn_far(values)
            return values, False
        from_size, from_zero = np.abs(values - size), np.abs(values)
        most = _farthest(size)
        if holds:  # no part is nothing, or twice as large; of a typed nominal it may be
            most = abs(size) * (1 + (ROUNDING if self._nominal_typed else -ROUNDING))
        if self.is_relative and not holds:
            if (from_size <= most).all() and (from_zero > 0).all():
                raise DistributionError(self._either("the column", values))
            return values, False
        sizes = holds == "sizes" or (
            not holds and np.sum(from_size <= most) > np.sum(from_zero <= most)
        )
        if not (sizes or holds) and (wrong := self.other_unit(values)):
            raise DistributionError(
                f"{places[0]} and after it: {wrong}, or say that the column holds "
                '"deviations"'
            )
        distance = from_size if sizes else from_zero
        if not self.is_relative and (distance > most).any():
            row = int(np.argmax(distance > most))
            kind = "size" if sizes else "deviation"
            raise DistributionError(
                f"{places[row]}: {self._words(values[row])} is no {kind} of a part of "
                f"nominally {self._words(size)}; correct or remove it, or say what "
                'the column holds, "sizes" or "deviations"'
            )
        deviations = _less_nominal(values, size) if sizes else values
        before = len(self.warnings)
        self._warn_of_rows(deviations, size, places)
        if not (sizes or holds or self.warnings[before:]):
            self._warn_far(values)
        return deviations, bool(sizes)

    def other_unit(self, values: Array) -> str:
        """Return why deviations, SI, are sizes in a mistaken unit; empty if not.

        Bores of 20 mm in inches are 0.787: far from zero for their width.
        """
        mean, width = float(values.mean()), float(np.ptp(values))
        near = NEAR * abs(self.size)
        factors = [x for x in FACTORS if abs(x * mean - self.size) < near]
        if not (factors and _is_far(values)):
            return ""
        return (
            f"{self.contributor.name} has a mean of {self._words(mean)} and a width of "
            f"{self._words(width)}; {factors[0]} times as large these are sizes of "
            f"{self._words(self.size)}; correct the unit of the column"
        )

    def _read(self, read: Callable[[str, str], Any], text: str) -> Array:
        """Return what a grammar reads, ascending, SI: per cent of the nominal size."""
        try:
            unit = grammar.unit_of(text)
        except UnitError:
            read(text, self.contributor.unit)  # says what is expected
            raise
        if self.is_relative and unit == "1":
            name, number = self.contributor.name, text.strip()
            raise UnitError(
                f"{name} deviates relative to its nominal value: write its share, "
                f'"{number} %", or {self._in_per_cent(read, text)} if 1 is the whole'
            )
        written, factor = self._unit_and_factor(unit)
        values = np.atleast_1d(read(text, written))
        signed = _PLUS.search(text) or (values < 0).any()
        plain = self.contributor.unit == "1" and factor != 1.0 and not signed
        if plain and (np.abs(values - self.size) <= FARTHEST * abs(self.size)).all():
            ends = "..".join(figures(end, KNOWN) for end in values.tolist())
            raise UnitError(
                f'"{text}" may be the value {ends}, or per cent of the nominal '
                f'{self._words(self.size)}; write "{ends}", or per cent with a sign'
            )
        return np.sort(factor * values)

    def _in_per_cent(self, read: Callable[[str, str], Any], text: str) -> str:
        ends = [figures(100 * end, KNOWN) for end in np.atleast_1d(read(text, "1"))]
        same = len(ends) == 2 and ends[0] == f"-{ends[1]}"
        return f'"{f"+-{ends[1]}" if same else "..".join(ends)} %"'

    def _unit_and_factor(self, unit: str) -> tuple[str, float]:
        """Return the unit to read a text in, and what turns that into a deviation."""
        part = self.contributor
        if unit not in SHARES or self.is_relative:
            return part.unit, 1.0
        if part.unit == "1" and part.shown in SHARES:  # a share itself, such as 20 %
            self.warnings.append(
                f"{part.name} is nominally {self._words(self.size)}: its deviation "
                "in % is taken as a difference, not as a share of that"
            )
            return part.unit, 1.0
        if not self.size:
            why = "its nominal value is 0" if part.size == 0 else "it has no nominal"
            mark = scale_of(part.unit, part.shown).mark
            raise UnitError(
                f"per cent is of the nominal value of {part.name}, and {why}; write "
                f"the deviation {f'in {mark}' if mark else 'as a plain number'}"
            )
        return "1", self.size

    def _settled(self, values: Array, typed: str) -> Array:
        """Return deviations, of values that may be sizes: float64[value], SI."""
        size = 1.0 if self.is_relative else self.size
        most = _farthest(size)
        plus = bool(_PLUS.search(typed))
        turn = self.contributor.unit == "rad" and np.ptp(values) > TURN
        if turn:
            return values
        if not size or (np.abs(values) <= most).all():
            if not plus and not self.is_relative:
                self._warn_far(values)
            self._warn_wide(values, typed)
            return values
        explicit = plus or (size > 0 and (values < 0).any())
        if self.is_relative:
            if are_sizes(values, size) and not explicit:
                raise DistributionError(self._either(f'"{typed}"', values))
            return values
        name, nominal = self.contributor.name, self._words(size)
        if are_sizes(values, size) and plus:
            raise DistributionError(
                f"with a plus sign these are deviations, yet they may be sizes of "
                f"{nominal}; leave the sign out, or give another nominal"
            )
        if are_sizes(values, size):
            deviations = _less_nominal(values, size)
            low, high = float(deviations.min()), float(deviations.max())
            ends = f"{self._number(low)}.." * (low < high) + self._words(high)
            self.warnings.append(
                f'{name}: "{typed}" is taken as sizes of {nominal}: {ends}'
            )
            return deviations
        largest = self._words(float(np.abs(values).max()))
        if explicit:
            self.warnings.append(
                f'{name}: "{typed}" deviates by more than half of {nominal}'
            )
            return values
        mend = "sizes about the nominal"
        if values.min() <= size <= values.max():
            sizes = self._signed(_less_nominal(values, size))
            mend = f'"{sizes}" for sizes of "{typed}"'
        raise DistributionError(
            f"{largest} is more than half of the nominal {nominal}, and no size near "
            f'it either; write "{self._signed(values)}" for a deviation that is meant '
            f"so, or {mend}"
        )

    def _signed(self, values: Array) -> str:
        """Return deviations with their signs."""
        ends = dict.fromkeys([float(values.min()), float(values.max())])
        signed = "..".join("+" * (end > 0) + self._number(end) for end in ends)
        return f"{signed} {self._scale.mark}".strip()

    def _warn_wide(self, values: Array, typed: str) -> None:
        """Remark typed deviations that are large, or tiny, for the nominal size."""
        most = max(float(np.abs(values).max()), float(np.ptp(values)))
        share = most / abs(self.size) if self.size else 0.0
        if self.contributor.unit == "1" and 0 < share < TINY and most < 1:
            name, nominal = self.contributor.name, self._words(self.size)
            self.warnings.append(
                f'{name}: "{typed}" is {figures(100 * share, 2)} % of the nominal '
                f"{nominal}; if it is meant as a share of that, write per cent"
            )
        if share > WIDE * (1 + ROUNDING) and "%" not in typed and "ppm" not in typed:
            wide = (
                f'{self.contributor.name}: "{typed}" is {figures(100 * share, 2)} % of '
                f"the nominal {self._words(self.size)}"
            )
            if share > VERY_WIDE:
                self.warnings.append(f"{wide}; check its unit")
            else:
                self.notes.append(wide)

    def _warn_of_rows(
        self, deviations: Array, size: float, places: Sequence[str]
    ) -> None:
        """Warn of rows that deviate much from the nominal, or from all others."""
        distance = np.abs(deviations - np.median(deviations))
        row = int(distance.argmax())
        others, why = np.delete(deviations, row), ""
        if len(others) > 2 and distance[row] > FAR * np.ptp(others) > 0:
            why = "far from all others"
        elif np.abs(deviations).max() > WIDE * abs(size):
            row = int(np.abs(deviations).argmax())
            why = f"much for the nominal {self._words(size)}"
        if why:
            self.warnings.append(
                f"{places[row]}: {self.contributor.name} deviates by "
                f"{self._words(deviations[row])}, {why}; check row and unit"
            )

    def _warn_far(self, values: Array) -> None:
        """Warn of deviations that look like sizes: of an unknown nominal, or others."""
        if not _is_far(values):
            return
        low, high = float(values.min()), float(values.max())
        mend = "give deviations, or measured parts their `nominal`"
        if self.size:
            mend = f"they are none of {self._words(self.size)}; check their unit"
        self.warnings.append(
            f"{self.contributor.name} deviates by {self._number(low)} to "
            f"{self._words(high)}, far from zero for their width: if these are sizes, "
            f"{mend}"
        )

    def _either(self, typed: str, values: Array) -> str:
        name, nominal = self.contributor.name, 1.0 if are_sizes(values, 1.0) else 0.0
        ends = [100 * (float(end) - nominal) for end in (values.min(), values.max())]
        signed = "..".join(f"{end:+.6g}" for end in dict.fromkeys(ends))
        return (
            f"{name} deviates relative to its nominal value, and {typed} may be that "
            f'value or a deviation; write a deviation with its sign, "{signed} %"'
        )

    def _number(self, value: float) -> str:
        return figures(value * self._scale.factor, SHOWN)

    def _words(self, value: float) -> str:
        return f"{self._number(value)} {self._scale.mark}".strip()

    @property
    def _scale(self) -> Scale:
        part = self.contributor
        plain = "%" if self.is_relative else "1"
        return scale_of(part.unit, part.shown or (plain if part.unit == "1" else ""))
