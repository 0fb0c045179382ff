"""A value that many units share, such as a loss of zero."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.statistics.estimate import Estimate
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
