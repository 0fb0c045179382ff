"""Lognormal distribution: it begins at one end, with a long tail to the other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from tolstat.deviations.distributions import key
from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import DistributionError


@dataclass(frozen=True)
class Lognormal:
    """Lognormal distribution that begins at the lower end of the tolerance.

    Not truncated: 99.865 % of the parts lie below the upper end, as many as of a normal
    distribution lie below three sigma.

    Attributes
    ----------
    median : float
        Half of the parts lie below, SI.
    """

    tolerance: Tolerance = key("tolerance")
    median: float = key("quantity")

    def __post_init__(self) -> None:
        """Refuse a median outside the tolerance."""
        if not self.tolerance.lower < self.median < self.tolerance.upper:
            raise DistributionError("the median lies outside the tolerance")

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        lower, upper = self.tolerance
        scale = self.median - lower
        sigma = math.log((upper - lower) / scale) / 3
        return lower + scale * np.exp(sigma * np.asarray(ndtri(u)))
