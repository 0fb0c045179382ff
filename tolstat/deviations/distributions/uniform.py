"""Uniform distribution: only the ends are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.distributions import key
from tolstat.deviations.tolerance import Tolerance


@dataclass(frozen=True)
class Uniform:
    """Every deviation inside the tolerance is as likely as any other."""

    tolerance: Tolerance = key("tolerance")

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        lower, upper = self.tolerance
        return lower + (upper - lower) * u
