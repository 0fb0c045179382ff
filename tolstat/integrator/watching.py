"""Peaks and times above zero, at the accepted steps and between them."""

from __future__ import annotations

import numpy as np

from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows


@compiled(within=True)
def vertex_of(a, m, b):
    """Return where in the step the parabola through three values turns, and its value.

    Parameters
    ----------
    a, m, b : vector
        Values in the start, the middle and the end of the step.

    Returns
    -------
    tuple of vector
        The fraction of the step, and the value there.
    """
    slope = 4.0 * m - 3.0 * a - b
    theta = -0.25 * slope / (a - 2.0 * m + b)
    return theta, a + 0.5 * slope * theta


@compiled(within=True)
def _follow_extremes(taking, start, middle, end, greatest, least):
    """Raise the greatest and lower the least value of each watched quantity.

    Parameters
    ----------
    taking : mask
        The lanes that are to be followed.
    start, middle, end : float64[n or more, lanes]
        The watched quantities over one step; a parabola through the three gives the
        peak between them.
    greatest, least : float64[n, lanes]
        Changed in place.
    """
    start, middle, end = rows(start), rows(middle), rows(end)
    greatest, least = rows(greatest), rows(least)
    for i in range(len(greatest)):
        a, m, b = start[i], middle[i], end[i]
        theta, vertex = vertex_of(a, m, b)
        vertex = np.where((theta > 0.0) & (theta < 1.0), vertex, m)
        high = np.maximum(np.maximum(a, b), np.maximum(m, vertex))
        low = np.minimum(np.minimum(a, b), np.minimum(m, vertex))
        greatest[i] = np.where(taking, np.maximum(greatest[i], high), greatest[i])
        least[i] = np.where(taking, np.minimum(least[i], low), least[i])


@compiled(within=True)
def _share_above(a, b):
    """Return the share of a straight line from a to b that lies above zero."""
    above = np.maximum(a, 0.0) + np.maximum(b, 0.0)
    return np.where(above == 0.0, 0.0, above / (np.abs(a) + np.abs(b)))


@compiled(within=True)
def _follow_times(taking, h, start, middle, end, above):
    """Add the time that each watched quantity spends above zero.

    Parameters
    ----------
    taking : mask
        The lanes that are to be followed.
    h : vector
        The step, s.
    start, middle, end : float64[n or more, lanes]
        The watched quantities over one step, taken as straight over each half.
    above : float64[n, lanes]
        Time above zero, s; changed in place.
    """
    start, middle, end, above = rows(start), rows(middle), rows(end), rows(above)
    for i in range(len(above)):
        a, m, b = start[i], middle[i], end[i]
        share = 0.5 * (_share_above(a, m) + _share_above(m, b))
        above[i] = np.where(taking, above[i] + h * share, above[i])


@compiled(within=True)
def follow(taking, h, lanes, step):
    """Follow the watched quantities over a step.

    Parameters
    ----------
    taking : mask
        The lanes that are to be followed.
    h : vector
        The step, s.
    lanes : Lanes
        Their peaks and times above zero are changed in place.
    step : Step
        With the rates at both ends, and what is watched in the middle.
    """
    n_extremes = len(lanes.greatest)
    first_extreme = len(lanes.y) + len(lanes.quadratures)
    first_above = first_extreme + n_extremes
    _follow_extremes(
        taking,
        step.k[0, first_extreme:],
        step.watched_middle,
        step.k[6, first_extreme:],
        lanes.greatest,
        lanes.least,
    )
    _follow_times(
        taking,
        h,
        step.k[0, first_above:],
        step.watched_middle[n_extremes:],
        step.k[6, first_above:],
        lanes.above,
    )
