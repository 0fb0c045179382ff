"""Arcsine distribution: an oscillation at a random moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.distributions import key
from tolstat.deviations.tolerance import Tolerance


@dataclass(frozen=True)
class Arcsine:
    """Sine of a random phase between the ends of the tolerance (JCGM 101, 6.4.6)."""

    tolerance: Tolerance = key("tolerance")

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        lower, upper = self.tolerance
        return lower + (upper - lower) * np.sin(0.5 * np.pi * u) ** 2
