"""Truncated normal distribution: a normal process after inspection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from tolstat.deviations.distributions import key
from tolstat.deviations.distributions.normal import Normal


@dataclass(frozen=True, kw_only=True)
class TruncatedNormal(Normal):
    """Normal process, whose parts outside the tolerance are not used as they are.

    Attributes
    ----------
    outside : str
        "screened": other parts replace those outside; "clipped": they are reworked to
        the end that they missed.
    """

    outside: str = key("word", choices=("screened", "clipped"))

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        lower, upper = self.tolerance
        mean, sigma = self.mean_and_sigma
        if self.outside == "screened":
            below, above = ndtr((lower - mean) / sigma), ndtr((mean - upper) / sigma)
            u = below + u * (1 - below - above)
        parts = mean + sigma * np.asarray(ndtri(u))
        # screening ends at the tolerance but for rounding
        return np.clip(parts, lower, upper)
