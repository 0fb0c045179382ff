"""Weights of trials that stand for other machines than were drawn."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_EFFECTIVE = 150  # with fewer one heavy trial more or less decides it


class Weights:
    """How many machines each trial stands for, on the average one.

    Parameters
    ----------
    values : float64[trial]
        Density of each trial where others are drawn over that as it was drawn.
    most : float, optional
        What intervals cap weights at, chosen without a look at the trials; the largest
        if not given.
    cut : float
        Share of the other machines that lie above the cap, at most: intervals reckon
        with these anywhere.
    """

    def __init__(
        self, values: Array, most: float | None = None, cut: float = 0.0
    ) -> None:
        self.values, self.cut = values, cut
        self.most = float(values.max()) if most is None else most

    @cached_property
    def capped(self) -> Array:
        """Weights as intervals take them: float64[trial]."""
        return np.minimum(self.values, self.most)

    @cached_property
    def number(self) -> int:
        """How many independent trials they are worth; 0 of none."""
        return effective_number(self.values)

    @property
    def too_few(self) -> str:
        """Say that these are too few; empty if they are enough."""
        few = self.number < LEAST_EFFECTIVE
        return f"{self.number} effective trials are too few" if few else ""

    def part(self, trials: NDArray[np.int64]) -> Weights:
        """Return those of some trials, chosen without a look at them, in this order."""
        return Weights(self.values[trials], self.most, self.cut)

    def of(self, trials: NDArray[np.bool_]) -> Weights:
        """Return those of trials of one kind: what was cut off may all be of it."""
        left = len(trials) / max(int(np.count_nonzero(trials)), 1)
        return Weights(self.values[trials], self.most, self.cut * left)


def effective_number(weights: Array) -> int:
    """Return how many independent trials float64[trial] weights are worth.

    References
    ----------
    L. Kish, Survey Sampling, Wiley 1965, 11.7.
    """
    squares = float(np.sum(weights**2))
    return round(float(weights.sum()) ** 2 / squares) if squares > 0 else 0
