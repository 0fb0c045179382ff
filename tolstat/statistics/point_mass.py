"""A value that many units share, such as a loss of zero; central trials of a response.

Where few trials may dominate a variance, it is that of the central 99 % of trials.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.as_sampled import PARTS, skewness
from tolstat.statistics.intervals.quantiles import median_unbiased
from tolstat.statistics.intervals.replicates import share_from_replicates
from tolstat.statistics.intervals.shares import anytime_valid

LEAST_EQUAL = 0.005  # least fraction of the trials in a point mass
NEAR_RANGE = 1e-4  # of the range of 99.5 % of the trials: closer values count as equal
LEAST_NEAR = 5, 0.1  # trials, and fraction of all, for nearly equal values


class PointMass(NamedTuple):
    """A value that many units share: middle, ends, and fraction of the units."""

    value: float
    least: float
    largest: float
    share: Estimate

    def without(self, values: Array) -> Array:
        """Return float64[n] without the point mass."""
        return values[(values < self.least) | (values > self.largest)]


def point_mass_of(values: Array, replicate: Integers | None = None) -> PointMass | None:
    """Return the value that more of float64[n] units share than chance allows.

    At least 0.5 % of the units have exactly this value. Otherwise, at least 10 % lie
    within a ten thousandth of the range of 99.5 % (zero loss with smoothed friction).
    None if neither holds. `replicate` is the randomisation number of each unit; without
    it units are independent.
    """
    n = len(values)
    if n < 2 or np.ptp(values) == 0:
        return None
    ordered = np.sort(values)
    _, starts, counts = np.unique(ordered, return_index=True, return_counts=True)
    most = int(counts.argmax())
    if counts[most] >= max(2, LEAST_EQUAL * n):
        first = int(starts[most])
        return _described(values, replicate, ordered[first : first + counts[most]])
    trials, share = LEAST_NEAR
    for side, end in ((0.995, 0), (0.005, -1)):
        width = NEAR_RANGE * abs(np.quantile(ordered, side) - ordered[end])
        counts = np.searchsorted(ordered, ordered + width, side="right") - np.arange(n)
        most = int(counts.argmax())
        if counts[most] >= max(trials, share * n):
            return _described(values, replicate, ordered[most : most + counts[most]])
    return None


def _described(values: Array, replicate: Integers | None, equal: Array) -> PointMass:
    """Return the point mass of ascending values that count as equal."""
    middle, least, largest = (float(equal[i]) for i in (len(equal) // 2, 0, -1))
    if replicate is None:
        # anytime-valid: it is reported only where values are equal
        share = anytime_valid(len(equal), len(values))
    else:
        units = (values >= least) & (values <= largest)
        share = share_from_replicates(units, replicate)
    return PointMass(middle, least, largest, share)


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

    def followed(self, table: Array, estimate: Callable[[Array], Array]) -> Array:
        """Let the numbers without each part follow the ends: see `jackknifed`.

        `estimate` returns the numbers of a response.
        """
        if self.light:
            return table
        slopes = np.array([estimate(response) - table[0] for response in self.further])
        return np.concatenate([table[:1], table[1:] + self.steps @ slopes])


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
