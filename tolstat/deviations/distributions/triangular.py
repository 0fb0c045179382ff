"""Triangular distribution: ends and a most likely value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.distributions import deviation_field
from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import DistributionError


@dataclass(frozen=True)
class Triangular:
    """Triangle over the tolerance.

    Attributes
    ----------
    mode : float, optional
        The most likely deviation, SI; the middle of the tolerance if not given.
    """

    mode: float | None = deviation_field(None)

    def deviations(
        self, u: NDArray[np.float64], tolerance: Tolerance
    ) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        lower, upper = tolerance
        mode = tolerance.middle if self.mode is None else self.mode
        if not lower <= mode <= upper:
            raise DistributionError("the mode lies outside the tolerance")
        width = upper - lower
        rising = lower + np.sqrt(u * width * (mode - lower))
        falling = upper - np.sqrt((1 - u) * width * (upper - mode))
        return np.where(u * width < mode - lower, rising, falling)
