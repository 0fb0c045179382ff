"""Linear tolerance analysis: root sum square of slopes times sigmas."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from tolstat.arrays import Array
from tolstat.statistics.estimate import Estimate

MATTERS = 0.05  # least reported departure, over the distance from the median


class Linear(NamedTuple):
    """A response by linear tolerance analysis: normal.

    Attributes
    ----------
    mean, sigma : float
        Of the response.
    shares : dict of str to float
        Share of its variance by contributor, from slope and sigma alone; the remainder
        is correlation.
    """

    mean: float
    sigma: float
    shares: dict[str, float]

    def quantile(self, share: float) -> float:
        """Return the value below which a share of the units would lie."""
        return self.mean + self.sigma * float(ndtri(share))

    def fraction_out(self, permitted: tuple[float, float]) -> float:
        """Return the fraction of the units that would be out of a limit."""
        lower, upper = self._distances(permitted)
        return float(ndtr(-lower) + ndtr(-upper))

    def ppk(self, permitted: tuple[float, float]) -> float:
        """Return Ppk: the distance of the nearer end from the mean, over 3 sigma."""
        return min(self._distances(permitted)) / 3

    def _distances(self, permitted: tuple[float, float]) -> tuple[float, float]:
        """Return how far the mean lies inside both ends, in sigmas; NaN without any."""
        if not self.sigma > 0:
            return math.nan, math.nan
        lower, upper = permitted
        return (self.mean - lower) / self.sigma, (upper - self.mean) / self.sigma


class Scatter(NamedTuple):
    """Mean and covariance of the deviations, by contributor."""

    names: tuple[str, ...]
    mean: Array
    covariance: Array


def scatter_of(deviations: Mapping[str, Array]) -> Scatter:
    """Return mean and covariance of float64[trial] by contributor."""
    X = np.column_stack(list(deviations.values()))
    covariance = np.atleast_2d(np.cov(X, rowvar=False))
    return Scatter(tuple(deviations), X.mean(axis=0), covariance)


def root_sum_square(
    nominal: float, slopes: Mapping[str, float], scatter: Scatter
) -> Linear:
    """Combine slopes at the nominal unit, by contributor, with the scatter; SI.

    All are NaN if a slope is NaN.
    """
    s = np.array([slopes[name] for name in scatter.names])
    variance = float(s @ scatter.covariance @ s)
    variances = s**2 * np.diag(scatter.covariance)
    shares = np.zeros(len(s)) if variance == 0 else variances / variance
    return Linear(
        nominal + float(s @ scatter.mean),
        math.sqrt(variance) if variance >= 0 else math.nan,
        dict(zip(scatter.names, shares.tolist(), strict=True)),
    )


class Departure(NamedTuple):
    """The error of the linear answer at one quantile.

    Attributes
    ----------
    share : float
        Share of the quantile.
    linear : float
        Value by linear analysis.
    relative : float
        Distance from the simulated value, over the distance of the simulated value from
        the median; negative if too optimistic.
    fails : bool
        Whether it is clearly outside the interval and off by more than 5 %.
    """

    share: float
    linear: float
    relative: float
    fails: bool


def departures(linear: Linear, quantiles: Mapping[float, Estimate]) -> list[Departure]:
    """Return the departures at the outermost quantiles with an interval, lower first.

    `quantiles` are simulated, the median among them.
    """
    middle = quantiles[0.5].value
    certain = sorted(share for share, quantile in quantiles.items() if quantile.sure)
    errors = []
    for share in dict.fromkeys((certain[0], certain[-1]) if certain else ()):
        simulated = quantiles[share]
        value = linear.quantile(share)
        if share == 0.5 or math.isnan(value):
            continue
        sign = 1 if share > 0.5 else -1
        spread = sign * (simulated.value - middle)
        error = sign * (value - simulated.value)
        relative = error / spread if spread > 0 else math.copysign(math.inf, error)
        if error == 0:
            relative = 0.0
        # clearly: by more than half the interval outside its nearer end
        half = (simulated.upper - simulated.lower) / 2
        outside = not simulated.lower - half <= value <= simulated.upper + half
        fails = outside and abs(relative) > MATTERS
        errors.append(Departure(share, value, relative, fails))
    return errors
