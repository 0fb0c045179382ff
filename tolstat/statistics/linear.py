"""The linear answer: root sum square of slopes times standard deviations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from tolstat.statistics.estimate import Estimate

Array = NDArray[np.float64]

MATTERS = 0.05  # departure over the distance from the median that is worth a word


class Linear(NamedTuple):
    """A response as linear tolerance analysis has it: normal.

    Attributes
    ----------
    mean, deviation : float
        Of the response.
    shares : dict of str to float
        Share of its variance by contributor, as slope and deviation alone give it;
        what these do not sum to is correlation.
    """

    mean: float
    deviation: float
    shares: dict[str, float]

    def quantile(self, share: float) -> float:
        """Return the value that a share of the machines would stay below."""
        return self.mean + self.deviation * float(ndtri(share))


def root_sum_square(
    nominal: float, slopes: Mapping[str, float], deviations: Mapping[str, Array]
) -> Linear:
    """Combine slopes with the scatter of the deviations.

    Parameters
    ----------
    nominal : float
        Response of the nominal machine.
    slopes : mapping of str to float
        By contributor, at the nominal machine.
    deviations : mapping of str to float64[trial]
        As drawn: their means, deviations and correlations.

    Returns
    -------
    Linear
        NaN throughout if a slope is.
    """
    names = list(deviations)
    X = np.column_stack([deviations[name] for name in names])
    s = np.array([slopes[name] for name in names])
    covariance = np.atleast_2d(np.cov(X, rowvar=False))
    variance = float(s @ covariance @ s)
    mean = nominal + float(s @ X.mean(axis=0))
    own = s**2 * np.diag(covariance)
    shares = own / variance if variance > 0 else np.zeros(len(names))
    return Linear(
        mean,
        math.sqrt(max(variance, 0.0)),
        dict(zip(names, shares.tolist(), strict=True)),
    )


class Departure(NamedTuple):
    """How far the linear answer is off at one quantile.

    Attributes
    ----------
    share : float
        Of the quantile.
    linear : float
        What linear analysis says of it.
    relative : float
        Its distance from the simulated value, over that value's distance from the
        median; negative: it promises too much.
    fails : bool
        Outside the interval, by more than a twentieth.
    """

    share: float
    linear: float
    relative: float
    fails: bool


def departures(linear: Linear, quantiles: Mapping[float, Estimate]) -> list[Departure]:
    """Compare the linear answer with simulated quantiles.

    Parameters
    ----------
    linear : Linear
        Of the same response.
    quantiles : mapping of float to Estimate
        By share; with the median.

    Returns
    -------
    list of Departure
        Of the outermost quantiles that have an interval: the lower, then the upper.
    """
    middle = quantiles[0.5].value
    sure = sorted(share for share, found in quantiles.items() if found.sure)
    found = []
    for share in dict.fromkeys((sure[0], sure[-1]) if sure else ()):
        simulated = quantiles[share]
        value = linear.quantile(share)
        if share == 0.5 or math.isnan(value):
            continue
        sign = 1 if share > 0.5 else -1
        spread = sign * (simulated.value - middle)
        off = sign * (value - simulated.value)
        relative = off / spread if spread > 0 else math.copysign(math.inf, off)
        if off == 0:
            relative = 0.0
        outside = not simulated.lower <= value <= simulated.upper
        fails = outside and abs(relative) > MATTERS
        found.append(Departure(share, value, relative, fails))
    return found
