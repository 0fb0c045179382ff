"""Peaks and shares of time, at the accepted steps and between them."""

from __future__ import annotations

import numpy as np

from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows


@compiled(within=True)
def follow_extremes(taking, start, middle, end, greatest, least):
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
    W0, W1, W2 = rows(start), rows(middle), rows(end)
    G, L = rows(greatest), rows(least)
    for i in range(len(greatest)):
        a, m, b = W0[i], W1[i], W2[i]
        slope = 4.0 * m - 3.0 * a - b
        theta = -0.25 * slope / (a - 2.0 * m + b)
        vertex = a + 0.5 * slope * theta
        vertex = np.where((theta > 0.0) & (theta < 1.0), vertex, m)
        high = np.maximum(np.maximum(a, b), np.maximum(m, vertex))
        low = np.minimum(np.minimum(a, b), np.minimum(m, vertex))
        G[i] = np.where(taking, np.maximum(G[i], high), G[i])
        L[i] = np.where(taking, np.minimum(L[i], low), L[i])


@compiled(within=True)
def follow_shares(taking, h, start, middle, end, above):
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
    W0, W1, W2, T = rows(start), rows(middle), rows(end), rows(above)
    for i in range(len(above)):
        share = 0.5 * (_share_above(W0[i], W1[i]) + _share_above(W1[i], W2[i]))
        T[i] = np.where(taking, T[i] + h * share, T[i])


@compiled(within=True)
def _share_above(a, b):
    """Share of a straight line from a to b that lies above zero."""
    above = np.maximum(a, 0.0) + np.maximum(b, 0.0)
    return np.where(above == 0.0, 0.0, above / (np.abs(a) + np.abs(b)))
