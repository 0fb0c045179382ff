"""What lies beyond the trials: a generalized Pareto distribution over a high threshold.

Everything here is extrapolated: it holds if the tail goes on as it began.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.tail_fit import (
    LEAST_LEVEL,
    LEAST_SHAPE,
    Pareto,
    anderson_darling,
    fit_pareto,
    level_of,
)

Array = NDArray[np.float64]

LEAST_TRIALS = 1000
LEAST_EXCEEDANCES = 100
FARTHEST = 0.01  # least share, over the trials' own 1 in n, that is extrapolated to
GRID = 61  # points of each axis of the likelihood's grid
WIDTH = 4.5  # of that grid, in standard errors to either side
REACH = 3.0  # of the shares above the threshold, likewise
# half of the 99 % quantile of chi squared with one degree: a tail is only nearly of
# this form; the region of 99 % covers 95 % where that of 95 % does not (tests/coverage)
WILKS = 3.3174483005026837


class Tail(NamedTuple):
    """The upper tail of a response.

    Attributes
    ----------
    threshold : float
        Above which it is fitted; NaN if it is refused.
    exceedances, trials : int
        Trials above the threshold, and all.
    shape, scale : float
        Of the generalized Pareto distribution; shape below 0: bounded.
    level : float
        Level of the Anderson-Darling test (its p-value), between 0.01 and 0.5.
    refused : str
        Why there is no fit; empty if there is one.
    region : tuple of float64[point]
        Shape, scale and share above the threshold inside the likelihood's region.
    """

    threshold: float
    exceedances: int
    trials: int
    shape: float = math.nan
    scale: float = math.nan
    level: float = math.nan
    refused: str = ""
    region: tuple[Array, Array, Array] = (np.empty(0),) * 3

    def exceeded_by(self, share: float) -> Estimate:
        """Estimate the value that a small share of the machines exceeds: extrapolated.

        Parameters
        ----------
        share : float
            Such as 1e-5: one machine in 100 000.
        """
        if self.refused:
            return Estimate(math.nan, reason=self.refused)
        value = self.threshold + _excess(
            self.shape, self.scale, self.exceedances / self.trials / share
        )
        shape, scale, above = self.region
        every = self.threshold + _excess(shape, scale, above / share)
        return self._bounded(float(value), every, share)

    def share_beyond(self, value: float) -> Estimate:
        """Estimate the share of the machines beyond a value: extrapolated.

        Parameters
        ----------
        value : float
            At or above the threshold.
        """
        if self.refused:
            return Estimate(math.nan, reason=self.refused)
        if value < self.threshold:
            return Estimate(math.nan, reason="below the threshold: count the trials")
        excess = value - self.threshold
        share = self.exceedances / self.trials
        found = share * float(_survival(excess, self.shape, self.scale))
        shape, scale, above = self.region
        every = above * _survival(excess, shape, scale)
        return self._bounded(found, every, found)

    def _bounded(self, value: float, every: Array, share: float) -> Estimate:
        """Give the interval, or say that it would reach too far."""
        if not share * self.trials >= FARTHEST:
            reason = f"beyond 1 in {round(self.trials / FARTHEST)}: too far to tell"
            return Estimate(math.nan, reason=reason)
        return Estimate(value, float(every.min()), float(every.max()))


def upper_tail(values: Array) -> Tail:
    """Fit the upper tail of a response.

    Parameters
    ----------
    values : float64[n]
        Independent, none NaN.

    Returns
    -------
    Tail
        With the lowest of these thresholds that passes the Anderson-Darling test at
        10 %: the one that twice the root of n trials exceed (at least 100), half as
        many, and so on down to 100. Intervals are of the profile likelihood. Refused,
        with the reason, if no threshold passes or n is below 1000.

    References
    ----------
    S. Coles, An Introduction to Statistical Modeling of Extreme Values (2001), chapter
    4; V. Choulakian, M. A. Stephens, Goodness-of-fit tests for the generalized Pareto
    distribution, Technometrics 43 (2001) 478-484; B. Bader, J. Yan, X. Zhang, Automated
    threshold selection for extreme value analysis, Ann. Appl. Stat. 12 (2018) 310-329.
    """
    ordered = np.sort(values)
    n = len(ordered)
    if n < LEAST_TRIALS:
        return Tail(math.nan, 0, n, refused=f"needs {LEAST_TRIALS}")
    above = max(LEAST_EXCEEDANCES, round(2 * math.sqrt(n)))
    while above >= LEAST_EXCEEDANCES:
        threshold = float(ordered[n - above - 1])
        y = ordered[n - above :] - threshold
        if y[0] <= 0 or len(np.unique(y)) < above:
            return Tail(math.nan, 0, n, refused="the tail has steps")
        fit = fit_pareto(y)
        level = level_of(anderson_darling(y, fit), fit.shape)
        if level >= LEAST_LEVEL:
            region = _region(y, fit, n)
            return Tail(threshold, above, n, *fit, level, "", region)
        above //= 2
    return Tail(math.nan, 0, n, refused="no threshold gives a good fit")


def _region(y: Array, fit: Pareto, n: int) -> tuple[Array, Array, Array]:
    """Return the points whose likelihood is within Wilks' distance of the greatest.

    The extremes of any function over them are its profile likelihood interval.
    """
    k = len(y)
    # standard errors, Coles (2001), of the maximum-likelihood estimates
    spread = max(1 + fit.shape, 0.4) / math.sqrt(k)
    shapes = fit.shape + WIDTH * spread * np.linspace(-1, 1, GRID)
    shapes = np.maximum(shapes, LEAST_SHAPE)
    scales = fit.scale * np.exp(WIDTH * 1.5 / math.sqrt(k) * np.linspace(-1, 1, GRID))
    shape, scale = (a.ravel() for a in np.meshgrid(shapes, scales))
    possible = 1 + shape * y[-1] / scale > 1e-9
    shape, scale = shape[possible], scale[possible]
    theta = shape / scale
    logs = np.log1p(np.outer(theta, y)).sum(axis=1)
    zero = np.abs(theta) * y[-1] < 1e-6
    over = np.where(zero, y.sum(), logs / np.where(zero, 1.0, theta))
    likelihood = -k * np.log(scale) - logs - over / scale
    found = -k * math.log(fit.scale) - float(
        np.log1p(fit.shape / fit.scale * y).sum()
        * (1 + 1 / (fit.shape if abs(fit.shape) > 1e-9 else 1e-9))
    )
    lost = max(found, likelihood.max()) - likelihood
    near = lost <= WILKS
    shape, scale, lost = shape[near], scale[near], lost[near]
    # the share above the threshold is binomial
    zeta = k / n
    ends = REACH * math.sqrt((1 - zeta) / k)
    shares = zeta * np.exp(ends * np.linspace(-1, 1, 41))
    lost_there = n * (
        zeta * np.log(zeta / shares) + (1 - zeta) * np.log((1 - zeta) / (1 - shares))
    )
    inside = lost[:, None] + lost_there[None, :] <= WILKS
    i, j = np.nonzero(inside)
    return shape[i], scale[i], shares[j]


def _excess(shape: Array | float, scale: Array | float, times: Array | float) -> Array:
    """Return what is exceeded by one in so many of those above the threshold."""
    log = np.log(times)
    small = np.abs(shape) < 1e-9
    safe = np.where(small, 1.0, shape)
    return np.asarray(scale * np.where(small, log, np.expm1(safe * log) / safe))


def _survival(excess: float, shape: Array | float, scale: Array | float) -> Array:
    """Return the share of those above the threshold that exceed it by so much."""
    small = np.abs(shape) < 1e-9
    safe = np.where(small, 1.0, shape)
    inside = np.maximum(1 + safe * excess / scale, 0.0)
    with np.errstate(divide="ignore"):
        power = np.exp(-np.log(inside) / safe)
    return np.where(small, np.exp(-excess / scale), np.where(inside > 0, power, 0.0))
