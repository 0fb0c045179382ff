"""Interface of the exact solution: linear motion from mark to mark, for a block."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.integrator.problem import Solution
from tolstat.status import Status

STEPS_A_PERIOD = 8  # of the fastest mode
LEAST_STEPS = 8  # of a phase, for what drives it
MOST_STEPS = 20_000_000  # of a trial
TERMS = 18  # of e^(G h), which thousands of steps multiply: (2 pi/8)^19/19! = 1e-19
SERIES = 13  # terms of the solution inside a step: (2 pi/8)^14/14! = 4e-13, once


class LinearMotion(NamedTuple):
    """Trials that move by z' = G z from mark to mark.

    The rows of z are positions, as many rates of these, then what drives them.
    """

    positions: int  # their number
    entries: Integers  # [entry, 2], row and column in G; others are zero in all trials
    G: Array  # [trial, entry], 1/s
    fastest: Array  # [trial], 1/s, no mode moves faster
    marks: Array  # [trial, mark], s, ascending: start, when a phase begins, end
    # [trial, phase, row]: what jumps at the begin of the phase; what then drives
    change: Array
    sums: Integers  # [term, 2], a watched quantity, and a position that it adds up
    rest: Array  # [trial, phase, watched], what is added to the sums
    since: Array  # [trial, watched], phase from which its peak is taken


def by_rows(pairs: Integers, n: int) -> tuple[Integers, Integers]:
    """Return where each of n rows begins among ascending pairs, and their columns."""
    row, column = np.ascontiguousarray(pairs.T)
    return np.searchsorted(row, np.arange(n + 1)), column


def solve(motion: LinearMotion, samples: Array | None = None) -> Solution:
    """Return the exact solution of a block of trials, from rest.

    Parameters
    ----------
    motion : LinearMotion
        The trials.
    samples : float64[sample], optional
        Ascending times, s.

    Returns
    -------
    Solution
        Peaks of the watched quantities; histories of these at the samples; steps.
    """
    # the first call loads the compiler, and compiles
    from tolstat.integrator.propagator import Pack, follow
    from tolstat.lanes.vector import WIDTH

    taken = np.zeros(0) if samples is None else np.asarray(samples, float)
    n, watched = motion.rest.shape[0], motion.rest.shape[2]
    m = motion.change.shape[2]
    span = np.diff(motion.marks, axis=1)
    wanted = np.ceil(
        span * (motion.fastest * (STEPS_A_PERIOD / (2.0 * np.pi)))[:, None]
    )
    count = np.where(span > 0.0, np.maximum(wanted, LEAST_STEPS), 0.0)
    finite = np.isfinite(motion.G).all(axis=1) & np.isfinite(count).all(axis=1)
    finite &= np.isfinite(motion.change).all(axis=(1, 2))
    few = count.sum(axis=1) <= MOST_STEPS
    count = np.where((finite & few)[:, None], count, 0.0)
    h = span / np.maximum(count, 1.0)
    packs = -(-n // WIDTH)
    # the last pack is filled up with its last trial
    filled = np.minimum(np.arange(packs * WIDTH), n - 1)

    def across(values: Array) -> Array:
        of_trial = values[filled].reshape(packs, WIDTH, -1)
        return np.ascontiguousarray(of_trial.transpose(0, 2, 1))

    def back(values: Array, *shape: int) -> Array:
        of_trial = values.transpose(0, 2, 1).reshape(packs * WIDTH, *shape)
        return np.ascontiguousarray(of_trial[:n])

    def room(*shape: int) -> Array:
        return np.zeros((*shape, WIDTH))

    first_entry, column = by_rows(motion.entries, m)
    first_summed, summed = by_rows(motion.sums, watched)
    given = [motion.G, motion.marks[:, :-1], h, count, motion.change, motion.rest]
    G, begin, h_, steps, change, rest, since = map(across, [*given, motion.since])
    samples_ = np.repeat(taken[:, None], WIDTH, axis=1)
    greatest, least = room(packs, watched) - np.inf, room(packs, watched) + np.inf
    history = room(packs, len(taken) * watched) + np.nan
    spare = [room(m), room(watched), *(room(m * m) for _ in range(3))]
    spare += [room((1 + SERIES) * motion.positions), room(4 * watched)]
    Gh = room(len(motion.entries))
    for i in range(packs):
        follow(Pack._make((
            first_entry, column, first_summed, summed, G[i], Gh, begin[i], h_[i],
            steps[i], change[i], rest[i], since[i], samples_, np.zeros(WIDTH, np.int64),
            room(m), *spare, greatest[i], least[i], history[i],
        )))  # fmt: skip
    greatest, least = back(greatest, watched), back(least, watched)
    history = back(history, len(taken), watched)
    failed = ~(finite & few)
    for values in (greatest, least, history):
        values[failed] = np.nan
    status = np.where(few, Status.DONE, Status.TOO_MANY_STEPS)
    nothing = np.zeros((n, 0))
    return Solution(
        np.zeros((n, 0, 0)), np.zeros((n, 0, 0)), greatest, least, nothing, history,
        np.where(finite, status, Status.NOT_FINITE).astype(np.int64),
        count.sum(axis=1).astype(np.int64), np.full((n, 2), np.nan),
    )  # fmt: skip
