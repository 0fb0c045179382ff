"""Two clusters of one response that a constant step parts: a jump of a formula."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers, Truths

FAR = 3.0  # standard deviations within the clusters: a narrower gap is none
LEAST = 5  # trials in a cluster, if the step is not known to be a turn
MOST = 2048  # trials of a cluster that are fitted
PER_TERM = 3  # trials for each deviation of a fit
UNEXPLAINED = 0.1  # of the variance between clusters, by what deviates
FOLLOWS = 0.8  # of the variance within a cluster, by what deviates
EQUAL = 0.02  # of a turn: how far a step may differ
NO_TURNS: Mapping[float, float] = {}
Rows = Callable[[Integers], Array]  # of some trials: float64[trial, contributor]


class Clusters(NamedTuple):
    """Two clusters of a response, and the step between them, SI."""

    lower: float  # ends of the gap: the largest value below it
    upper: float  # and the least above it
    below: int  # trials
    above: int
    step: float  # by which the upper ones are larger than deviations explain
    turn: float  # how many turns that is, 1 or 0.5; 0 if it is no turn


def clusters_of(
    values: Array,
    rows: Rows,
    turns: Mapping[float, float] = NO_TURNS,
    fewest: int = LEAST,
) -> Clusters | None:
    """Return two clusters of a response that differ by a constant step; None if none.

    Parameters
    ----------
    values : float64[trial]
        The response of trials that are done.
    rows : function
        What deviates, of some of these trials.
    turns : dict of float to float
        Steps of the response that are turns: how many.
    fewest : int
        Trials of a cluster that is a turn away.

    Notes
    -----
    In both clusters the response follows the deviations by the same slopes, as parts
    that are nearly equal lie on both sides of a jump. That does not hold for a point
    mass, a count, a rare kind of failure, or an outlier. Two batches of parts explain
    their clusters: there the deviations part them, too. Not seen: steps of a response
    that is far from linear within a cluster, and of as many deviations as trials.
    """
    ordered = np.sort(values)
    for least in dict.fromkeys((LEAST, fewest)):
        gaps = np.diff(ordered[least - 1 : len(ordered) - least + 1])
        if not len(gaps):
            continue
        below = least + int(gaps.argmax())
        parted = ordered[:below], ordered[below:]
        inside = sum(len(part) * part.var() for part in parted) / len(ordered)
        if ordered[below] - ordered[below - 1] > FAR * math.sqrt(inside) > 0:
            clusters = _stepped(values, rows, parted, turns)
            if clusters and (clusters.turn or least == LEAST):
                return clusters
    return None


def _stepped(
    values: Array, rows: Rows, parted: tuple[Array, Array], turns: Mapping[float, float]
) -> Clusters | None:
    """Return the clusters if a constant step parts them."""
    lower, upper = float(parted[0][-1]), float(parted[1][0])
    above = values >= upper
    fitted = np.sort(np.concatenate([_fitted_trials(~above), _fitted_trials(above)]))
    y, high, x = values[fitted], above[fitted], rows(fitted)
    if len(y) < PER_TERM * (x.shape[1] + 2):
        return None
    scale = x.std(axis=0)
    x = (x - x.mean(axis=0))[:, scale > 0] / scale[scale > 0]
    plain = np.column_stack([np.ones(len(y)), x])
    explained = plain @ np.linalg.lstsq(plain, high * 1.0, rcond=None)[0]
    stepped = np.column_stack([high, plain])
    terms = np.linalg.lstsq(stepped, y, rcond=None)[0]
    rest, step = y - stepped @ terms, float(terms[0])
    matches = (count for x, count in turns.items() if abs(step - x) <= EQUAL * x)
    turn = next(matches, 0.0)
    for cluster in (high, ~high):
        within, follows = y[cluster].var(), rest[cluster].var()
        is_small = turn and np.count_nonzero(cluster) < LEAST
        most = (EQUAL * step) ** 2 if is_small else (1 - FOLLOWS) * within
        if not (follows < most):
            return None
    if (
        step < (upper - lower) / 2
        or np.var(high - explained) < UNEXPLAINED * high.var()
    ):
        return None
    return Clusters(lower, upper, len(parted[0]), len(parted[1]), step, turn)


def _fitted_trials(cluster: Truths) -> Integers:
    """Return the trials of a cluster that are fitted: all of a few, evenly of many."""
    trials = np.flatnonzero(cluster)
    return trials[:: -(-len(trials) // MOST)]
