"""A change of entries, as a drawing writes it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers, Truths

FIGURES = 3  # significant ones of a tolerance on a drawing


class Change(NamedTuple):
    """A change of entries: centres move by a shift, spreads are multiplied.

    Attributes
    ----------
    shift : float64[entry]
        In half tolerances of the entry.
    ratio : float64[entry]
        Of the spread about the centre: new over old, at most 1.
    """

    shift: Array
    ratio: Array

    @property
    def shifted(self) -> Integers:
        """The entries whose centre moves."""
        return np.flatnonzero(self.shift)

    @property
    def tightened(self) -> Integers:
        """The entries whose spread shrinks."""
        return np.flatnonzero(self.ratio < 1)

    @property
    def size(self) -> float:
        """Sum of all shifts, in half tolerances."""
        return float(np.abs(self.shift).sum())

    def with_entry(self, entry: int, **values: float) -> Change:
        """Return the change with another shift or ratio of an entry."""
        change = Change(self.shift.copy(), self.ratio.copy())
        for field, value in values.items():
            getattr(change, field)[entry] = value
        return change

    def followed_by(self, other: Change) -> Change:
        """Return both; the other one counts in half tolerances after this one."""
        return Change(self.shift + self.ratio * other.shift, self.ratio * other.ratio)


class Design(NamedTuple):
    """What a remedy may change.

    Attributes
    ----------
    centres : float64[contributor]
        Of the deviations, SI.
    entries : int64[contributor]
        Which entry of the study it belongs to, from 0: all of an entry change together.
    halves : float64[entry]
        Half the tolerance, SI, above 0: the widest of its contributors.
    steps : float64[entry]
        To which a drawing rounds shifts and half tolerances, SI: see `drawing_step`.
    free : bool[entry]
        False if no remedy may change it.
    movable : bool[entry]
        False if no remedy may shift it.
    lowest : float64[entry]
        The least shift in half tolerances: a size above 0 stays so.
    farthest : float
        Half tolerances that a centre may move.
    """

    centres: Array
    entries: Integers
    halves: Array
    steps: Array
    free: Truths
    movable: Truths
    lowest: Array | float = -math.inf
    farthest: float = math.inf

    @property
    def shiftable(self) -> Truths:
        """Which entries a remedy may shift."""
        return np.asarray(self.free & self.movable)

    @property
    def none(self) -> Change:
        """The change that changes nothing."""
        return Change(np.zeros(len(self.halves)), np.ones(len(self.halves)))

    def scaled(self, deviations: Array) -> Array:
        """Return deviations from their centres, over half the tolerance."""
        return np.asarray((deviations - self.centres) / self.halves[self.entries])

    def members(self, change: Change) -> tuple[Array, Array]:
        """Return shift and ratio by contributor."""
        return change.shift[self.entries], change.ratio[self.entries]

    def changed(self, change: Change) -> Design:
        """Return the design after a change."""
        shifts = (change.shift * self.halves)[self.entries]
        return self._replace(
            centres=self.centres + shifts,
            halves=change.ratio * self.halves,
            lowest=(self.lowest - change.shift) / change.ratio,
        )

    def rounded(self, change: Change) -> Change:
        """Round shifts to the nearest step, half tolerances to the next below."""
        grid = self.steps / self.halves
        shift = np.round(change.shift / grid) * grid
        coarse = np.maximum(np.floor(change.ratio / grid + 1e-6), 1) * grid
        ratio = np.where(change.ratio < 1, np.minimum(coarse, 1.0), 1.0)
        return Change(shift, ratio)


def drawing_step(half: float, factor: float = 1.0) -> float:
    """Return the step that a drawing has: three figures of half a tolerance, SI.

    `factor` leads to the unit of the drawing.

    Examples
    --------
    >>> drawing_step(0.12e-3, factor=1e3)  # +-0.12 mm, by 0.001 mm
    1e-06
    """
    decimals = math.floor(math.log10(half * factor)) + 1 - FIGURES
    return float(f"1e{decimals}") / factor
