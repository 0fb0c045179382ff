"""Beta distribution: two ends, and any skewness between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv

from tolstat.deviations.distributions import key
from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import DistributionError


@dataclass(frozen=True)
class Beta:
    """Beta distribution over the tolerance.

    Attributes
    ----------
    alpha, beta : float
        The density rises as the power alpha - 1 from the lower end and falls as the
        power beta - 1 towards the upper one.
    """

    tolerance: Tolerance = key("tolerance")
    alpha: float = key()
    beta: float = key()

    def __post_init__(self) -> None:
        """Refuse shapes that are no distribution."""
        for name in ("alpha", "beta"):
            value = getattr(self, name)
            if not value > 0:
                raise DistributionError(f"{name} = {value:g}: it must be above zero")

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        lower, upper = self.tolerance
        share = np.asarray(betaincinv(self.alpha, self.beta, u))
        return np.clip(lower + (upper - lower) * share, lower, upper)  # rounding
