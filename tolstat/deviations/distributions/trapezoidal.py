"""Trapezoidal distribution: uniform with worn edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.distributions import key
from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import DistributionError


@dataclass(frozen=True)
class Trapezoidal:
    """Trapezium over the tolerance: rising, flat, falling (JCGM 101, 6.4.4).

    Attributes
    ----------
    plateau : Tolerance, optional
        Where all deviations are equally likely; the middle half of the tolerance if not
        given.
    """

    tolerance: Tolerance = key("tolerance")
    plateau: Tolerance | None = key("tolerance", None)

    def __post_init__(self) -> None:
        """Refuse a plateau outside the tolerance."""
        lower, upper = self.tolerance
        if self.plateau and not lower <= self.plateau[0] <= self.plateau[1] <= upper:
            raise DistributionError("the plateau lies outside the tolerance")

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        lower, upper = self.tolerance
        quarter = self.tolerance.half / 2
        first, last = self.plateau or (lower + quarter, upper - quarter)
        height = 2 / (upper - lower + last - first)
        rising = lower + np.sqrt(2 * u * (first - lower) / height)
        falling = upper - np.sqrt(2 * (1 - u) * (upper - last) / height)
        share = height * (first - lower) / 2  # of the parts below the plateau
        flat = first + (u - share) / height
        beyond = 1 - u < height * (upper - last) / 2
        return np.where(u < share, rising, np.where(beyond, falling, flat))
