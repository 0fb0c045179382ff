"""Weights of trials that stand for units of other distributions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.reason import Lack, Reason

LEAST_EFFECTIVE = 150  # with fewer, one heavy trial dominates


@dataclass(eq=False)
class Weights:
    """How many units each trial stands for, one on average.

    Parameters
    ----------
    values : float64[trial]
        Density of each trial in the new distributions over that in the sampled ones.
    most : float, optional
        Cap of the weights in intervals, chosen independently of the trials; the largest
        weight if not given.
    cut : float
        Greatest share of the new units above the cap: in intervals they may lie
        anywhere.
    uncovered : float
        Greatest share of the new units that no trial stands for.
    searched : bool
        Whether trials with the property in question were searched: their own weights
        limit their share.
    """

    values: Array
    most: float = math.nan
    cut: float = 0.0
    uncovered: float = 0.0
    searched: bool = False

    def __post_init__(self) -> None:
        """Take the largest weight as the cap where none is given."""
        if math.isnan(self.most):
            self.most = float(self.values.max())

    @cached_property
    def capped(self) -> Array:
        """Weights in intervals: float64[trial]."""
        return np.minimum(self.values, self.most)

    @cached_property
    def so_far(self) -> Array:
        """One more than the units up to each trial: float64[trial]."""
        return np.cumsum(self.capped) + 1

    @cached_property
    def number(self) -> int:
        """Effective sample size; 0 of none."""
        return effective_number(self.values)

    @property
    def too_few(self) -> Reason | None:
        """Return that the effective sample size is too small; None if it is enough."""
        if self.number >= LEAST_EFFECTIVE:
            return None
        return Reason(
            Lack.EFFECTIVE_TRIALS, effective=self.number, needed=LEAST_EFFECTIVE
        )

    def part(self, trials: Integers) -> Weights:
        """Return the weights of some trials, in order, chosen independently of them."""
        return replace(self, values=self.values[trials])

    def selected(self, trials: Truths) -> Weights:
        """Return the weights of a selection; all units above the cap may be in it."""
        inverse = len(trials) / max(int(np.count_nonzero(trials)), 1)
        return replace(
            self, values=self.values[trials], cut=self.cut * inverse,
            uncovered=self.uncovered * inverse,
        )  # fmt: skip


def effective_number(weights: Array) -> int:
    """Return the effective sample size of float64[trial] weights.

    References
    ----------
    L. Kish, Survey Sampling, Wiley 1965, 11.7.
    """
    squares = float(np.sum(weights**2))
    return round(float(weights.sum()) ** 2 / squares) if squares > 0 else 0
