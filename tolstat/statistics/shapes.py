"""Named distributions fitted to a response, for use in other tools."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, ndtr

from tolstat.statistics.anderson_darling import a_squared, level_in, log_of_the_rest
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.replicates import share_from_replicates
from tolstat.statistics.limits.repeated_looks import followed

Array = NDArray[np.float64]

NAMES = ("normal", "lognormal", "weibull", "gumbel")
LEAST = 50  # trials from which a distribution is fitted
LEAST_ATOM = 0.005  # share of the trials with one and the same value that is an atom
NEAR = 1e-4  # of the range of 99.5 % of the trials: so near is as good as the same
LEAST_ALIKE = 5  # trials that make one by being near; two neighbours are chance
LEAST_NEAR = 0.1  # share of the trials so near to each other that is an atom
DOUBTFUL = 0.05  # level below which a fit is rejected

# upper tail of A squared with both parameters fitted: R. B. D'Agostino, M. A. Stephens,
# Goodness-of-Fit Techniques (1986), tables 4.7 (normal) and 4.17 (extreme value)
LEVELS = (0.5, 0.25, 0.15, 0.1, 0.05, 0.025, 0.01)
CRITICAL = {
    "normal": (0.341, 0.470, 0.561, 0.631, 0.752, 0.873, 1.035),
    "extreme value": (0.342, 0.474, 0.567, 0.637, 0.757, 0.877, 1.038),
}


class Shape(NamedTuple):
    """A named distribution fitted to what is no atom.

    Attributes
    ----------
    name : str
        One of `NAMES`.
    parameters : dict of str to float
        normal: mean, sigma; lognormal: mean and sigma of the natural logarithm;
        weibull: shape, scale; gumbel (of largest values): location, scale.
    statistic : float
        Of Anderson and Darling, A squared.
    level : float
        Its level (p-value), between 0.01 and 0.5.
    refused : str
        Why there is no fit; empty if there is one.
    """

    name: str
    parameters: dict[str, float]
    statistic: float = math.nan
    level: float = math.nan
    refused: str = ""

    @property
    def rejected(self) -> bool:
        """Whether the trials speak against it."""
        return bool(self.refused) or self.level < DOUBTFUL

    def below(self, values: Array) -> Array:
        """Return the share that a fit has below each of float64[n]."""
        first, second = self.parameters.values()
        x = np.asarray(values, dtype=np.float64)
        if self.name == "gumbel":
            return np.exp(-np.exp(-(x - first) / second))
        if self.name == "normal":
            return np.asarray(ndtr((x - first) / second))
        x = np.maximum(x, 0.0)  # nothing lies below zero
        if self.name == "weibull":
            return -np.expm1(-((x / second) ** first))
        with np.errstate(divide="ignore"):
            return np.asarray(ndtr((np.log(x) - first) / second))


class Atom(NamedTuple):
    """A value that many machines share, such as no loss at all.

    Attributes
    ----------
    value : float
        The value, or the middle one of those as good as the same.
    least, largest : float
        Ends of these.
    share : Estimate
        Of the machines that have it.
    """

    value: float
    least: float
    largest: float
    share: Estimate

    def without(self, values: Array) -> Array:
        """Return what is no atom of float64[n]."""
        return values[(values < self.least) | (values > self.largest)]


def atom_of(values: Array, replicate: NDArray[np.int64] | None = None) -> Atom | None:
    """Find the value that more machines share than chance allows.

    Parameters
    ----------
    values : float64[n]
        None NaN.
    replicate : int64[n], optional
        Number of the randomisation that each belongs to; independent without it.

    Returns
    -------
    Atom or None
        The value that half a per cent or more have exactly; else a tenth or more that
        lie within a ten thousandth of the range of 99.5 % of them (a loss that is zero
        but for smoothed friction); None for a response without either.
    """
    n = len(values)
    if n < 2 or np.ptp(values) == 0:
        return None
    ordered = np.sort(values)
    _, starts, counts = np.unique(ordered, return_index=True, return_counts=True)
    most = int(counts.argmax())
    if counts[most] >= max(2, LEAST_ATOM * n):
        first = int(starts[most])
        return _atom(values, replicate, ordered[first : first + counts[most]])
    for side in (0.995, 0.005):
        width = NEAR * abs(
            np.quantile(ordered, side) - ordered[0 if side > 0.5 else -1]
        )
        ends = np.searchsorted(ordered, ordered + width, side="right")
        counts = ends - np.arange(n)
        most = int(counts.argmax())
        if counts[most] >= max(LEAST_ALIKE, LEAST_NEAR * n):
            return _atom(values, replicate, ordered[most : most + counts[most]])
    return None


def _atom(values: Array, replicate: NDArray[np.int64] | None, alike: Array) -> Atom:
    """Describe those of the values that are alike; ascending."""
    middle, least, largest = (float(alike[i]) for i in (len(alike) // 2, 0, -1))
    if replicate is None:
        # not of one look only: it is told of where some are not alike
        share = followed(len(alike), len(values))
    else:
        machines = (values >= least) & (values <= largest)
        share = share_from_replicates(machines, replicate)
    return Atom(middle, least, largest, share)


def fit_shape(values: Array, name: str) -> Shape:
    """Fit a named distribution by maximum likelihood.

    Parameters
    ----------
    values : float64[n]
        Independent, none NaN; without atoms.
    name : str
        One of `NAMES`.

    Returns
    -------
    Shape
        With the Anderson-Darling test for parameters that were fitted.
    """
    n = len(values)
    if n < LEAST:
        return Shape(name, {}, refused=f"needs {LEAST}")
    if np.ptp(values) == 0:
        return Shape(name, {}, refused="the response does not spread")
    if name in ("lognormal", "weibull") and values.min() <= 0:
        return Shape(name, {}, refused="above zero only, and some values are not")
    x = np.log(values) if name in ("lognormal", "weibull") else values
    x = np.sort(x)
    if name in ("normal", "lognormal"):
        mean, sigma = float(x.mean()), float(x.std(ddof=1))
        z = (x - mean) / sigma
        found = a_squared(np.asarray(log_ndtr(z)), np.asarray(log_ndtr(-z)))
        found *= 1 + 0.75 / n + 2.25 / n**2
        parameters = {"mean": mean, "sigma": sigma}
        level = level_in(found, CRITICAL["normal"], LEVELS)
        return Shape(name, parameters, found, level)
    # the logarithm of a Weibull variable is, mirrored, of extreme value form
    mirrored = np.sort(-x) if name == "weibull" else x
    location, scale = _extreme_value(mirrored)
    log_below = -np.exp(-(mirrored - location) / scale)
    found = a_squared(log_below, log_of_the_rest(log_below)) * (1 + 0.2 / math.sqrt(n))
    level = level_in(found, CRITICAL["extreme value"], LEVELS)
    parameters = {"location": location, "scale": scale}
    if name == "weibull":
        parameters = {"shape": 1 / scale, "scale": math.exp(-location)}
    return Shape(name, parameters, found, level)


def best_shape(values: Array) -> Shape:
    """Return the fit of the least A squared."""
    fits = [fit_shape(values, name) for name in NAMES]
    return min(fits, key=lambda f: math.inf if f.refused else f.statistic)


def _extreme_value(x: Array) -> tuple[float, float]:
    """Fit location and scale of exp(-exp(-(x - location)/scale))."""
    mean = float(x.mean())
    centred = x - mean
    scale = float(x.std()) * math.sqrt(6) / math.pi
    for _ in range(100):
        # d log L / d scale = 0, by Newton's method on its logarithm
        w = np.exp(-(centred - centred.min()) / scale)
        s0, s1, s2 = w.sum(), (w * centred).sum(), (w * centred**2).sum()
        residual = scale + s1 / s0
        slope = 1 + (s2 / s0 - (s1 / s0) ** 2) / scale**2
        step = -residual / slope
        scale = max(scale + step, scale / 4)
        if abs(step) < 1e-12 * scale:
            break
    location = mean - scale * math.log(float(np.mean(np.exp(-centred / scale))))
    return location, scale
