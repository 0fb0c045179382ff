"""Triangular distribution: ends and a most likely value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.distributions import key
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

    tolerance: Tolerance = key("tolerance")
    mode: float | None = key("quantity", None)

    def __post_init__(self) -> None:
        """Refuse a mode outside the tolerance."""
        lower, upper = self.tolerance
        if self.mode is not None and not lower <= self.mode <= upper:
            raise DistributionError("the mode lies outside the tolerance")

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        lower, upper = self.tolerance
        mode = self.tolerance.middle if self.mode is None else self.mode
        width = upper - lower
        rising = lower + np.sqrt(u * width * (mode - lower))
        falling = upper - np.sqrt((1 - u) * width * (upper - mode))
        return np.where(u * width < mode - lower, rising, falling)
