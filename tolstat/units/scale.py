"""The unit that a quantity is shown in: as typed, as declared, or fitting its size."""

from __future__ import annotations

import math
from typing import NamedTuple

from tolstat.units.conversion import from_si

PLAIN, COUNT = "1", "count"
FIGURES = 4

# by SI unit: what it is shown in, the largest first, each from which size on (SI); the
# last also serves what is smaller
SIZES = {
    "1": (("%", 0.0),),
    "m": (("m", 100.0), ("mm", 1e-4), ("um", 1e-7), ("nm", 0.0)),
    "rad": (("rad", 10.0), ("mrad", 1e-5), ("urad", 0.0)),
    "N": (("MN", 1e7), ("kN", 10.0), ("N", 0.1), ("mN", 1e-4), ("uN", 0.0)),
    "J": (
        ("MJ", 1e7), ("kJ", 10.0), ("J", 0.1), ("mJ", 1e-4), ("uJ", 1e-7), ("nJ", 0.0),
    ),
    "W": (("MW", 1e7), ("kW", 10.0), ("W", 0.1), ("mW", 1e-4), ("uW", 0.0)),
    "N m": (("MN m", 1e7), ("kN m", 10.0), ("N m", 1e-2), ("mN m", 0.0)),
    "Pa": (("GPa", 1e10), ("MPa", 1e4), ("kPa", 10.0), ("Pa", 0.0)),
    "Hz": (("kHz", 1e5), ("Hz", 1e-2), ("mHz", 0.0)),
    "s": (("s", 0.1), ("ms", 1e-5), ("us", 0.0)),
}  # fmt: skip
# of these, what stands where no size is known
USUAL = {"m": "mm", "rad": "mrad", "N": "kN", "J": "kJ", "W": "kW", "N m": "kN m",
         "Pa": "MPa", "Hz": "Hz", "s": "s"}  # fmt: skip


class Scale(NamedTuple):
    """How a quantity is held and how it is shown.

    Attributes
    ----------
    unit : str
        SI unit of its numbers.
    shown : str
        Unit in which people read it; "1" is a plain number, "count" a whole one.
    """

    unit: str
    shown: str

    @property
    def factor(self) -> float:
        """What an SI number is multiplied with to be shown."""
        return from_si(1.0, self.unit, self.shown)

    @property
    def mark(self) -> str:
        """What stands behind a number: the unit, or nothing."""
        return "" if self.shown in (PLAIN, COUNT) else self.shown

    def number(self, value: float) -> str:
        """Write an SI number in the unit shown, without it."""
        shown = float(from_si(value, self.unit, self.shown))
        if self.shown == COUNT and shown.is_integer():
            return f"{shown:.0f}"
        return four_figures(shown)

    def words(self, value: float) -> str:
        """Write an SI number with its unit."""
        return f"{self.number(value)} {self.mark}".strip()

    def label(self, name: str) -> str:
        """Name a quantity with its unit, for an axis or a head."""
        return f"{name}, {self.mark}" if self.mark else name


def four_figures(value: float) -> str:
    """Write a number with four figures, three where it needs an exponent.

    Parameters
    ----------
    value : float
        In the unit to be shown.
    """
    if math.isnan(value):
        return "failed"
    if value == 0:
        return "0"
    if not 1e-3 <= abs(value) <= 1e6:
        return f"{value:.{FIGURES - 2}e}"
    digits = max(0, FIGURES - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}"


def scale_of(unit: str, shown: str = "", size: float = math.nan) -> Scale:
    """Choose how a quantity is shown.

    Parameters
    ----------
    unit : str
        Its SI unit.
    shown : str
        What the study types or the machine declares; empty where neither says.
    size : float
        Largest magnitude of its numbers, SI, which then decides the prefix; NaN or 0
        where it is not known.

    Returns
    -------
    Scale
        SI itself where nothing handier is known.
    """
    if shown or unit not in SIZES:
        return Scale(unit, shown or unit)
    if not (math.isfinite(size) and size > 0):
        return Scale(unit, USUAL.get(unit, SIZES[unit][-1][0]))
    fitting = (name for name, least in SIZES[unit] if size >= least)
    return Scale(unit, next(fitting))
