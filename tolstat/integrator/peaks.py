"""Peaks and times above zero, at the accepted steps and between them."""

import numpy as np

from tolstat.integrator.problem import TIME
from tolstat.integrator.step import inside
from tolstat.lanes.compiled import compiled

# of the bend of the parabola over a step: within it, a vertex may be a new extremum
NEAR = 0.01


@compiled(within=True)
def vertex_of(a, m, b):
    """Return the place in the step and the value of the vertex through three values.

    Parameters
    ----------
    a, m, b : vector
        Values at the start, the middle and the end of the step.

    Returns
    -------
    tuple of vector
        The fraction of the step, and the value there.
    """
    slope = 4.0 * m - 3.0 * a - b
    theta = -0.25 * slope / (a - 2.0 * m + b)
    return theta, a + 0.5 * slope * theta


@compiled()
def look(watch, t, h, theta, number, lanes, step):
    """Return a watched quantity at the fraction theta of the step, by dense output."""
    inside(h, theta, lanes.y, step.k, step.middle)
    step.moment[TIME] = t + theta * h
    watch(step.moment, step.middle, lanes.p, step.filled_inside)
    return step.watched_inside[number]


@compiled(within=True)
def _follow_extremes(watch, taking, t, h, first, lanes, step):
    """Raise the greatest and lower the least value of each watched quantity.

    If the parabola through start, middle and end has its vertex outside all values
    before, the quantity is evaluated there. An error of its place is of second order.

    Parameters
    ----------
    watch, taking, t, h, lanes, step
        As of `follow`.
    first : int
        Number of the rate that is the first of these quantities.
    """
    start, middle, end = step.k[0], step.watched_middle, step.k[6]
    greatest, least = lanes.greatest, lanes.least
    for i in range(len(greatest)):
        a, m, b = start[first + i], middle[i], end[first + i]
        high = np.maximum(greatest[i], np.maximum(a, np.maximum(m, b)))
        low = np.minimum(least[i], np.minimum(a, np.minimum(m, b)))
        theta, vertex = vertex_of(a, m, b)
        margin = NEAR * np.abs(a - 2.0 * m + b)
        beyond = (vertex > high - margin) | (vertex < low + margin)
        turns = taking & beyond & (theta > 0.0) & (theta < 1.0)
        if np.any(turns):
            value = look(watch, t, h, np.where(turns, theta, 0.5), i, lanes, step)
            high = np.where(turns, np.maximum(high, value), high)
            low = np.where(turns, np.minimum(low, value), low)
        greatest[i] = np.where(taking, high, greatest[i])
        least[i] = np.where(taking, low, least[i])


@compiled(within=True)
def _share_above(a, b):
    """Return the share of a straight line from a to b that lies above zero."""
    above = np.maximum(a, 0.0) + np.maximum(b, 0.0)
    return np.where(above == 0.0, 0.0, above / (np.abs(a) + np.abs(b)))


@compiled(within=True)
def follow(watch, taking, t, h, lanes, step):
    """Update peaks and times above zero over a step.

    Parameters
    ----------
    watch
        See `problem.System`.
    taking : mask
        The lanes to be updated.
    t, h : vector
        Start of the step and its length, s.
    lanes : Lanes
        Their peaks and times above zero are changed in place.
    step : Step
        With the rates at both ends, and the watched quantities in the middle.
    """
    n_extremes = len(lanes.greatest)
    first_extreme = len(lanes.y) + len(lanes.quadratures)
    first_above = first_extreme + n_extremes
    _follow_extremes(watch, taking, t, h, first_extreme, lanes, step)
    start, middle, end = step.k[0], step.watched_middle, step.k[6]
    above = lanes.above
    for i in range(len(above)):
        a, b = start[first_above + i], end[first_above + i]
        m = middle[n_extremes + i]
        # linear over each half
        share = 0.5 * (_share_above(a, m) + _share_above(m, b))
        above[i] = np.where(taking, above[i] + h * share, above[i])
