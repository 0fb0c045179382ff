"""Results of a chain without trials: worst case, root sum square, contributions."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.deviations.spread import Spread
from tolstat.machines.dimension_chain.algebras import CleanSlopes, Slopes
from tolstat.machines.dimension_chain.formula import Formula

ALL_CORNERS = 10  # most links for which every corner is evaluated
INSIDE = 10  # binary logarithm of the number of points inside the tolerances
STARTS = 16  # best points, from which searches start
ROUNDING = 1e-9
POLE = 100.0  # times the spread of a thousand points: beyond it lies a pole
# of float64[point, link]: values, float64[point], and slopes, float64[point, link]
Evaluated = Callable[[Array], tuple[Array, Array]]


class Answers(NamedTuple):
    """Results of a chain without trials, SI."""

    worst_min: float  # least closing link within the tolerances
    worst_max: float  # largest
    # of the linear chain: slopes at the middle of the tolerances, means and sigmas of
    # the distributions, links independent of each other
    rss_mean: float
    rss_sigma: float
    shares: dict[str, float]  # of the variance of the linear chain
    effects: dict[str, float]  # slope times sigma
    # links by which the closing link both rises and falls: then a search finds the
    # worst case
    turning: tuple[str, ...]
    # all slopes at the middle are zero, and yet it varies: no mean, sigma or shares
    no_linear_part: bool


def answers(
    formula: Formula, nominal: Mapping[str, float], spreads: Mapping[str, Spread]
) -> Answers:
    """Return worst case and root sum square of a dimension chain.

    The worst case is NaN if the formula has no value somewhere within the tolerances,
    or jumps there as at a pole. The others are NaN if it has no value, no slope or no
    linear part in their middle. Of a linear chain the worst case is the sum of
    |xi| T/2 to either side of the middle, sigma the root of the sum of (xi sigma_i)^2.
    """
    used = {n: s for n, s in spreads.items() if n in formula.used and s.lower < s.upper}
    constant = {n: s.mean for n, s in spreads.items() if n not in used}
    nominal = {n: x + constant.get(n, 0.0) for n, x in nominal.items()}
    middle = {
        n: x + (0.5 * (used[n].lower + used[n].upper) if n in used else 0.0)
        for n, x in nominal.items()
    }
    numbers = {n: np.float64(x) for n, x in middle.items()}
    slope = formula.worked_out(CleanSlopes(numbers))
    slopes = np.where(
        np.isfinite(slope.by_link), slope.by_link, np.nan
    )  # none at a vertical
    xi = dict(zip(middle, map(float, slopes), strict=True))
    effects = {n: xi[n] * s.sigma for n, s in used.items()}
    parts = {n: effect**2 for n, effect in effects.items()}
    variance = math.fsum(parts.values())
    offsets = (xi[n] * (nominal[n] + s.mean - middle[n]) for n, s in used.items())
    least, largest, turning = _worst(formula, nominal, used)
    if no_linear_part := variance == 0 and least != largest:
        variance = math.nan
    return Answers(
        least,
        largest,
        math.nan if no_linear_part else float(slope.value) + math.fsum(offsets),
        math.sqrt(variance),
        {n: part / variance if variance else 0.0 for n, part in parts.items()},
        effects,
        turning,
        no_linear_part,
    )


def correlation_of(first: Answers, second: Answers) -> float:
    """Return the correlation of two linear chains; NaN if one does not vary."""
    effects = first.effects.items()
    covariance = math.fsum(x * second.effects.get(name, 0.0) for name, x in effects)
    sigmas = first.rss_sigma * second.rss_sigma
    return covariance / sigmas if sigmas else math.nan


def _worst(
    formula: Formula, nominal: Mapping[str, float], spreads: Mapping[str, Spread]
) -> tuple[float, float, tuple[str, ...]]:
    """Return least and largest value within the tolerances, and non-monotonic links."""
    names = list(spreads)
    lower = np.array([nominal[n] + spreads[n].lower for n in names])
    upper = np.array([nominal[n] + spreads[n].upper for n in names])

    def slopes_at(points: Array) -> tuple[Array, Array]:
        links = links_at(points, names, nominal)
        slope = formula.worked_out(Slopes(links))
        which = [list(links).index(n) for n in names]
        value = np.broadcast_to(slope.value, len(points))
        return value, np.asarray(slope.by_link)[which].T

    points = points_of(lower, upper)
    values, slopes = slopes_at(points)
    rises, falls = _directions(slopes)
    # of many links no corner may be as far out as those of the extremes
    farthest = [np.where(rises, lower, upper), np.where(falls, lower, upper)]
    there, slopes_there = slopes_at(np.array(farthest))
    points, values = np.vstack([points, farthest]), np.append(values, there)
    slopes = np.vstack([slopes, slopes_there])
    if not np.isfinite(values).all():
        return math.nan, math.nan, ()
    rises, falls = _directions(slopes)
    # one that changes nothing at these points may do so between them
    turning = tuple(n for i, n in enumerate(names) if rises[i] == falls[i])
    ends = []
    for sign in (1.0, -1.0):
        corner = np.where(rises if sign > 0 else falls, lower, upper)
        value = slopes_at(corner[None])[0][0]
        # a monotonic formula has its extremes in corners, unless it jumps
        if not turning and (sign * values).min() < sign * value - ROUNDING * abs(value):
            return math.nan, math.nan, ()
        if turning:
            best = np.vstack([points[np.argsort(sign * values)[:STARTS]], corner])
            value = _searched(sign, slopes_at, best, lower, upper)
        ends.append(float(value))
    if ends[1] - ends[0] > POLE * np.ptp(values) and turning:
        return math.nan, math.nan, turning
    return ends[0], ends[1], turning


def _directions(slopes: Array) -> tuple[Truths, Truths]:
    """Return by which links a formula rises, and falls, all points together.

    Points without a slope, at a tip or a vertical, are left out.
    """
    finite = np.isfinite(slopes)
    exist = finite.any(axis=0)
    rises: Truths = exist & np.all((slopes >= 0) | ~finite, axis=0)
    falls: Truths = exist & np.all((slopes <= 0) | ~finite, axis=0)
    return rises, falls


def links_at(
    points: Array, names: Sequence[str], nominal: Mapping[str, float]
) -> dict[str, Array]:
    """Return every link at points[point, link] of some, float64[point]."""
    links = {name: np.full(len(points), x) for name, x in nominal.items()}
    return links | dict(zip(names, points.T, strict=True))


def points_of(lower: Array, upper: Array) -> Array:
    """Return corners of the tolerances and points inside them: float64[point, link]."""
    from scipy.stats import qmc  # slow to import

    n = len(lower)
    if not n:
        return np.empty((1, 0))
    inside = lower + (upper - lower) * qmc.Sobol(n, scramble=False).random_base2(INSIDE)
    if n > ALL_CORNERS:
        return np.vstack([lower, upper, inside])
    corners = np.array(list(product(*zip(lower, upper, strict=True))))
    return np.vstack([corners, inside])


def _searched(
    sign: float, slopes_at: Evaluated, starts: Array, lower: Array, upper: Array
) -> float:
    """Return the least value that a search finds (the largest for a sign of -1)."""
    from scipy.optimize import minimize  # slow to import

    width = upper - lower
    # the search ends by absolute numbers: values are scaled to the size of the target
    size = float(np.ptp(slopes_at(starts)[0])) or 1.0

    def aim(x: Array) -> tuple[float, Array]:
        value, slope = slopes_at((lower + x * width)[None])
        slope = np.where(np.isfinite(slope[0]), slope[0], 0.0)
        return sign * float(value[0]) / size, sign * slope * width / size

    least_values = []
    for start in starts:
        x = _by_coordinates(sign, slopes_at, start, lower, upper)
        x = (x - lower) / width
        least_values.append(minimize(aim, x, jac=True, bounds=[(0, 1)] * len(x)).fun)
    return sign * size * float(np.nanmin(least_values))


def _by_coordinates(
    sign: float, slopes_at: Evaluated, x: Array, lower: Array, upper: Array
) -> Array:
    """Move one link after another to an end of its tolerance while that helps."""
    best = sign * slopes_at(x[None])[0][0]
    n = len(x)
    while True:
        tried = np.tile(x, (2 * n, 1))
        tried[np.arange(n), np.arange(n)] = lower
        tried[n + np.arange(n), np.arange(n)] = upper
        values = sign * slopes_at(tried)[0]
        if not values.min() < best:
            return x
        best, x = values.min(), tried[values.argmin()]
