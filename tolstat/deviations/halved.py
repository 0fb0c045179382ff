"""A distribution with half its tolerance.

Each deviation is half as far from zero, or from the nearer end of a tolerance on one
side of zero: +-0.2 mm becomes +-0.1 mm, 0..60 um becomes 0..30 um, +16..+34 um becomes
+16..+25 um, as a finer grade of the same position. Shape and Cp stay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.distributions import Distribution
from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import DistributionError


@dataclass(frozen=True)
class Nearer:
    """Every deviation of a distribution half as far from a centre, SI."""

    distribution: Distribution
    centre: float

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        return self.centre + 0.5 * (self.distribution.deviations(u) - self.centre)


def halved(distribution: Distribution) -> Nearer:
    """Return a distribution with half its tolerance.

    Raises
    ------
    DistributionError
        If it has none.
    """
    zone: Tolerance | None = getattr(distribution, "tolerance", None)
    if zone is None:
        raise DistributionError("it has no tolerance")
    return Nearer(distribution, zone.nearest)
