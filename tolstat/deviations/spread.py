"""The spread of a distribution, and the same with another tolerance."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
from scipy.special import ndtr

from tolstat.arrays import Array
from tolstat.deviations.distributions import THREE_SIGMA, Distribution, Tolerance
from tolstat.errors import DistributionError

RARE = 6.0  # normal score of the ends that practically no part is beyond
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


def zone_of(distribution: Distribution) -> Tolerance | None:
    """Return the tolerance of a distribution; None if it has none."""
    return getattr(distribution, "tolerance", None)


def spread_of(distribution: Distribution) -> Spread:
    """Return the spread of a distribution.

    Moments are integrals over the normal score, exact to rounding where the inverse
    distribution function is smooth.
    """
    zone = zone_of(distribution)
    if zone is None:
        ends = np.array([1 - THREE_SIGMA, THREE_SIGMA])
        zone = Tolerance(*distribution.deviations(ends).tolist())
    z = np.arange(-FAR, FAR + STEP / 2, STEP)
    weight = np.exp(-0.5 * z * z)
    weight /= np.trapezoid(weight, z)
    x = distribution.deviations(ndtr(z))
    mean = float(np.trapezoid(weight * x, z))
    size = max(float(np.abs(x - mean).max()), 1e-300)  # squares: no overflow
    sigma = size * math.sqrt(np.trapezoid(weight * ((x - mean) / size) ** 2, z))
    return Spread(float(zone.lower), float(zone.upper), mean, sigma)


def reach_of(distribution: Distribution) -> Spread:
    """Return the spread from end to end of what parts reach, the tolerance included.

    A part beyond an end is as rare as one beyond six sigma of a normal distribution.
    """
    spread = spread_of(distribution)
    least, largest = distribution.deviations(ndtr(np.array([-RARE, RARE]))).tolist()
    return spread._replace(
        lower=min(spread.lower, least), upper=max(spread.upper, largest)
    )


@dataclass(frozen=True)
class Shifted:
    """A distribution whose nominal is shifted, SI; the tolerance moves with it."""

    distribution: Distribution
    by: float

    @property
    def tolerance(self) -> Tolerance | None:
        """The shifted tolerance, SI."""
        zone = zone_of(self.distribution)
        return zone and Tolerance(*(self.by + end for end in zone))

    def deviations(self, u: Array) -> Array:
        """Return deviations, SI, at unit samples 0 < u < 1."""
        return self.by + self.distribution.deviations(u)


def unshifted(distribution: Distribution) -> Distribution:
    """Return a distribution about the nominal that is not shifted."""
    if isinstance(distribution, Shifted):
        return distribution.distribution
    return distribution


@dataclass(frozen=True)
class Nearer:
    """Every deviation of a distribution half as far from a centre, SI."""

    distribution: Distribution
    centre: float

    def deviations(self, u: Array) -> Array:
        """Return deviations, SI, at unit samples 0 < u < 1."""
        return self.centre + 0.5 * (self.distribution.deviations(u) - self.centre)


def halved(distribution: Distribution) -> Nearer:
    """Return a distribution with half its tolerance.

    Each deviation is half as far from zero, or from the nearer end of a tolerance on
    one side of zero. +-0.2 mm becomes +-0.1 mm, 0..60 um becomes 0..30 um. +16..+34 um
    becomes +16..+25 um, as a finer grade of the same position. Shape and Cp stay.
    A drawing may narrow a zone about its middle instead: what is said to be impossible
    for any narrower tolerance considers both (`tolstat.answers.report.off_centre`).

    Raises `DistributionError` if it has no tolerance.
    """
    zone = zone_of(distribution)
    if zone is None:
        raise DistributionError("it has no tolerance")
    if isinstance(distribution, Shifted):
        centre = halved(distribution.distribution).centre
        return Nearer(distribution, distribution.by + centre)
    return Nearer(distribution, zone.nearest)


def half_of(distributions: Mapping[str, Distribution]) -> float:
    """Return half the width of the tolerance of parts that share one, SI."""
    zone = zone_of(next(iter(distributions.values())))
    assert zone is not None  # checked when the study was loaded
    return zone.half


def resized(distribution: Distribution, half: float) -> Distribution:
    """Return a distribution with another half width, SI, its other keys unchanged.

    The zone changes towards zero, or towards its end nearest to zero, as in `halved`.

    Raises `DistributionError` if another key does not fit that tolerance.
    """
    if isinstance(distribution, Shifted):
        return Shifted(resized(distribution.distribution, half), distribution.by)
    zone = zone_of(distribution)
    assert zone is not None  # checked when the study was loaded
    fixed, ratio = zone.nearest, half / zone.half
    new = Tolerance(*(fixed + ratio * (end - fixed) for end in zone))
    return cast(
        Distribution, dataclasses.replace(cast(Any, distribution), tolerance=new)
    )
