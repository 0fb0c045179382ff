"""The central 99 % of the trials, where few others dominate the variance."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.intervals.as_sampled import skewness
from tolstat.statistics.intervals.jackknife import PARTS
from tolstat.statistics.intervals.quantiles import median_unbiased
from tolstat.statistics.point_mass import point_mass_of

OUTSIDE = 0.005  # of the trials at either end, clipped to the others
FURTHER = 0.01  # the same, to see how a number depends on the end
# skewness of squares over the root of n, times n^(1/4), up to which tails are light;
# a normal response has 0.75 at 200 trials, 0.28 at 10 000
LIGHT = 0.85
LEAST_NEIGHBOURS = 10  # expected pairs of trials outside a point mass


class Clipped(NamedTuple):
    """A response, clipped to the central 99 % of its trials if its tails are heavy.

    Attributes
    ----------
    light : bool
        Whether it is not clipped.
    values : float64[n] or float64[n, ...]
        The clipped response.
    further : list of arrays
        The same, with 1 % of the trials clipped at one end.
    steps : float64[part, end]
        How far the ends move without one part of the trials, in steps to `further`.
    """

    light: bool
    values: Array
    further: list[Array]
    steps: Array

    def followed(self, without: Array, estimate: Callable[[Array], Array]) -> Array:
        """Let the numbers without each part follow the ends: float64[part, number].

        `estimate` returns the numbers of a response.
        """
        if self.light:
            return without
        numbers = estimate(self.values)
        slopes = np.array([estimate(response) - numbers for response in self.further])
        return np.asarray(without + self.steps @ slopes)


def clipped(y: Array, among: Array) -> Clipped:
    """Clip a response to the central 99 % of trials: float64[n] or float64[n, ...].

    Only if few trials may dominate its variance.
    """
    squares = (among - among.mean()).ravel() ** 2
    part = np.repeat(np.arange(len(among)) % PARTS, among[0].size)
    order = np.argsort(among, axis=None)
    ordered, parts = among.ravel()[order], part[order]

    def ends(x: Array, outside: float) -> Array:
        return np.array([median_unbiased(x, p) for p in (outside, 1 - outside)])

    outer, inner = ends(ordered, OUTSIDE), ends(ordered, FURTHER)
    if skewness(squares) <= LIGHT * among.size**-0.25 or inner[0] == inner[1]:
        return Clipped(True, y, [], np.zeros((PARTS, 0)))
    without = np.array([ends(ordered[parts != p], OUTSIDE) for p in range(PARTS)])
    distance = np.where(inner == outer, 1.0, inner - outer)
    moved = np.where(inner == outer, 0.0, (without - outer) / distance)
    further = [y.clip(inner[0], outer[1]), y.clip(outer[0], inner[1])]
    return Clipped(False, y.clip(*outer), further, moved)


def few_leave_a_point_mass(y: Array) -> bool:
    """Return whether too few of float64[n] trials leave a value that most share.

    They have no neighbours among each other then.
    """
    mass = point_mass_of(y)
    leaving = len(y) if mass is None else len(mass.without(y))
    return leaving < min(math.sqrt(LEAST_NEIGHBOURS * len(y)), len(y) / 2)
