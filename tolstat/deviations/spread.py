"""The zone, the mean and the standard deviation of a distribution."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from tolstat.deviations.distributions import THREE_SIGMA, Distribution

FAR, STEP = 8.0, 1e-3  # of the normal score over which moments are integrated


class Spread(NamedTuple):
    """Ends of the tolerance, mean and standard deviation, SI.

    The ends of measured parts are the quantiles at three sigma of a normal
    distribution.
    """

    lower: float
    upper: float
    mean: float
    sigma: float


def spread_of(distribution: Distribution) -> Spread:
    """Return the spread of a distribution.

    Moments are integrals over the normal score, exact to rounding where the inverse
    distribution function is smooth.
    """
    zone = getattr(distribution, "tolerance", None)
    if zone is None:
        ends = np.array([1 - THREE_SIGMA, THREE_SIGMA])
        zone = distribution.deviations(ends).tolist()
    z = np.arange(-FAR, FAR + STEP / 2, STEP)
    weight = np.exp(-0.5 * z * z)
    weight /= np.trapezoid(weight, z)
    x = distribution.deviations(ndtr(z))
    mean = float(np.trapezoid(weight * x, z))
    size = max(float(np.abs(x - mean).max()), 1e-300)  # squares neither over nor under
    sigma = size * math.sqrt(np.trapezoid(weight * ((x - mean) / size) ** 2, z))
    return Spread(float(zone[0]), float(zone[1]), mean, sigma)
