"""Two clusters of one response that a constant step parts: a jump of a formula."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths

FAR = 3.0  # standard deviations within the clusters: a narrower gap is none
LEAST = 5  # trials in a cluster
MOST = 2048  # trials of a cluster that are fitted
PER_TERM = 3  # trials for each deviation of a fit
UNEXPLAINED = 0.1  # of the variance between clusters, by what deviates
FOLLOWS = 0.8  # of the variance within a cluster, by what deviates
TURN, EQUAL = 2 * math.pi, 0.05  # a whole turn, and how far a step may differ


class Clusters(NamedTuple):
    """Two clusters of a response, and the step between them."""

    lower: float  # ends of the gap: the largest value below it
    upper: float  # and the least above it
    below: int  # trials
    above: int
    step: float  # by which the upper ones are larger than parts tell

    @property
    def turn(self) -> bool:
        """Whether the step is a whole turn, in radians."""
        return abs(self.step - TURN) <= EQUAL * TURN


def clusters_of(values: Array, deviations: Array) -> Clusters | None:
    """Return two clusters of a response that differ by a constant step; None if none.

    Parameters
    ----------
    values : float64[trial]
        The response of trials that are done.
    deviations : float64[trial, contributor]
        What deviates.

    Notes
    -----
    In both clusters the response follows the deviations by the same slopes, as parts
    that are nearly equal lie on both sides of a jump. That does not hold for a point
    mass, a count, a rare kind of failure, or an outlier. Two batches of parts explain
    their clusters: there the deviations part them, too. Not seen: steps where the
    response is not nearly linear within a cluster, or where few trials deviate much.
    """
    n, parts = deviations.shape
    ordered = np.sort(values)
    gaps = np.diff(ordered[LEAST - 1 : n - LEAST + 1])
    if not len(gaps):
        return None
    below = LEAST + int(gaps.argmax())
    lower, upper = float(ordered[below - 1]), float(ordered[below])
    inside = (ordered[:below].var() * below + ordered[below:].var() * (n - below)) / n
    if not upper - lower > FAR * math.sqrt(inside) > 0:
        return None
    above = values >= upper
    fitted = np.concatenate([_spread(~above), _spread(above)])
    if len(fitted) < PER_TERM * (parts + 2):
        return None
    y, high, x = values[fitted], above[fitted], deviations[fitted]
    scale = x.std(axis=0)
    x = (x - x.mean(axis=0))[:, scale > 0] / scale[scale > 0]
    slopes = np.column_stack([np.ones(len(y)), x])
    between = _residual(slopes, high * 1.0)
    if between.var() < UNEXPLAINED * high.var():
        return None
    with_step = np.column_stack([high, slopes])
    terms, *_ = np.linalg.lstsq(with_step, y, rcond=None)
    rest = y - with_step @ terms
    for cluster in (high, ~high):
        if not rest[cluster].var() < (1 - FOLLOWS) * y[cluster].var():
            return None
    if not terms[0] > (upper - lower) / 2:
        return None
    return Clusters(lower, upper, below, n - below, float(terms[0]))


def _spread(cluster: Truths) -> Array:
    """Return the trials of a cluster that are fitted: all of a few, evenly of many."""
    trials = np.flatnonzero(cluster)
    return trials[:: -(-len(trials) // MOST)]


def _residual(terms: Array, target: Array) -> Array:
    found, *_ = np.linalg.lstsq(terms, target, rcond=None)
    return np.asarray(target - terms @ found)
