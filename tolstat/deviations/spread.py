"""The spread of a distribution, and the same with another tolerance."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, cast

import numpy as np
from scipy.special import ndtr

from tolstat.arrays import Array
from tolstat.deviations.distributions import (
    THREE_SIGMA,
    Distribution,
    Gamma,
    Lognormal,
    Tolerance,
    Weibull,
)
from tolstat.errors import DistributionError

RAREST = 6.0  # normal score of the ends that practically no part is beyond
FARTHEST, STEP = 8.0, 1e-3  # of the normal score over which moments are integrated
PLACES = ("mode", "median", "plateau")  # keys that are places in the zone
WIDTHS = ("shift", "sigma", "inexactness")  # keys that are in proportion to the zone
KEPT = 8192  # distributions whose spread is kept
ROUNDING_OF_ZONE = 1e-12  # of half a zone: zero, but for rounding


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


@lru_cache(KEPT)
def spread_of(distribution: Distribution) -> Spread:
    """Return the spread of a distribution.

    Moments are integrals over the normal score, exact to rounding where the inverse
    distribution function is smooth.
    """
    zone = zone_of(distribution)
    if zone is None:
        ends = np.array([1 - THREE_SIGMA, THREE_SIGMA])
        zone = Tolerance(*distribution.deviations(ends).tolist())
    z = np.arange(-FARTHEST, FARTHEST + STEP / 2, STEP)
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
    least, largest = distribution.deviations(ndtr(np.array([-RAREST, RAREST]))).tolist()
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


def has_places(distribution: Distribution) -> bool:
    """Return whether a place, or the shift of a mean, is typed: these follow a zone."""
    typed = unshifted(distribution)
    return any(getattr(typed, key, None) is not None for key in (*PLACES, "shift"))


def fixed_point(distribution: Distribution, *, sized: bool) -> float:
    """Return the deviation that stays where a zone narrows, SI.

    A zone narrows about its middle: half the width of H7 or of +0.1..+0.3 mm leaves
    the mean of its parts. Three kinds of zones keep another deviation, since their
    middle means nothing:

    - a deviation without nominal value (`sized` is false), such as a run-out or a
      share of a property, with a zone around zero and a typed mode, median or plateau:
      what is typed as most likely. Friction -20..+40 %, mode 0 %, becomes -10..+20 %.
    - a deviation without nominal value with a zone from zero: zero. It is an amplitude.
      A run-out 0..60 um becomes 0..30 um.
    - a distribution that begins at its lower end (gamma, lognormal, Weibull): that end.

    A shift of the nominal moves the zone and its fixed point.

    Raises `DistributionError` if the distribution has no tolerance.
    """
    if isinstance(distribution, Shifted):
        return distribution.by + fixed_point(distribution.distribution, sized=sized)
    zone = zone_of(distribution)
    if zone is None:
        raise DistributionError("it has no tolerance")
    if not sized and zone.lower < 0 < zone.upper:
        for key in PLACES:
            if (typical := getattr(distribution, key, None)) is not None:
                plateau = isinstance(typical, Tolerance)
                return float(typical.middle if plateau else typical)
    from_zero = not sized and zone.lower == 0
    if from_zero or isinstance(distribution, Gamma | Lognormal | Weibull):
        return zone.lower
    return zone.middle


def halved(distribution: Distribution, *, sized: bool) -> Nearer:
    """Return a distribution with half its tolerance.

    Each deviation is half as far from the `fixed_point`. Shape and Cp stay.

    Raises `DistributionError` if it has no tolerance.
    """
    return Nearer(distribution, fixed_point(distribution, sized=sized))


def half_of(distributions: Mapping[str, Distribution]) -> float:
    """Return half the width of the tolerance of parts that share one, SI."""
    zone = zone_of(next(iter(distributions.values())))
    assert zone is not None  # checked when the study was loaded
    return zone.half


def in_zone(distribution: Distribution, zone: Tolerance) -> Distribution:
    """Return a distribution in another zone, SI, beside the same shift of its nominal.

    Mode, median, plateau and mean lie as far across the new zone as across the old one;
    the shift of a mean and sigma grow and shrink with the zone. Other keys stay.
    """
    if isinstance(distribution, Shifted):
        return Shifted(in_zone(distribution.distribution, zone), distribution.by)
    old = zone_of(distribution)
    assert old is not None  # checked by those who call
    ratio = zone.half / old.half

    def across(x: float) -> float:
        moved = min(max(zone.lower + ratio * (x - old.lower), zone.lower), zone.upper)
        return moved if abs(moved) > ROUNDING_OF_ZONE * zone.half else 0.0

    keys: dict[str, Any] = {"tolerance": zone}
    for key in PLACES:
        if (typed := getattr(distribution, key, None)) is not None:
            plateau = isinstance(typed, Tolerance)
            keys[key] = Tolerance(*map(across, typed)) if plateau else across(typed)
    for key in WIDTHS:
        if (typed := getattr(distribution, key, None)) is not None:
            keys[key] = ratio * typed
    if (mean := getattr(distribution, "mean", None)) is not None:
        keys["mean"] = across(mean)
    return cast(Distribution, dataclasses.replace(cast(Any, distribution), **keys))


def resized(distribution: Distribution, half: float, *, sized: bool) -> Distribution:
    """Return a distribution with another half width, SI, about its `fixed_point`.

    All that depends on the zone follows it as in `in_zone`.
    """
    zone = zone_of(distribution)
    assert zone is not None  # checked when the study was loaded
    if isinstance(distribution, Shifted):
        inner = resized(distribution.distribution, half, sized=sized)
        return Shifted(inner, distribution.by)
    fixed, ratio = fixed_point(distribution, sized=sized), half / zone.half
    ends = (fixed + ratio * (end - fixed) for end in zone)
    return in_zone(distribution, Tolerance(*ends))
