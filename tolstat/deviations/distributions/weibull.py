"""Weibull distribution: it begins at one end, with a chosen shape."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.distributions import THREE_SIGMA, key
from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import DistributionError


@dataclass(frozen=True)
class Weibull:
    """Weibull distribution that begins at the lower end of the tolerance.

    Not truncated: 99.865 % of the parts lie below the upper end, as many as of a normal
    distribution lie below three sigma.

    Attributes
    ----------
    shape : float
        1 is exponential, 2 the eccentricity of a bore that is normal in both directions
        (Rayleigh), 3.6 almost symmetric.
    """

    tolerance: Tolerance = key("tolerance")
    shape: float = key()

    def __post_init__(self) -> None:
        """Refuse a shape that is no distribution."""
        if not self.shape > 0:
            raise DistributionError(f"shape = {self.shape:g}: it must be above zero")

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        lower, upper = self.tolerance
        power = 1 / self.shape
        scale = (upper - lower) / (-math.log1p(-THREE_SIGMA)) ** power
        return np.asarray(lower + scale * np.power(-np.log1p(-u), power))
