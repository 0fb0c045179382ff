"""Interface of the exact solution: linear motion from mark to mark, for a block."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.integrator.problem import Solution
from tolstat.status import Status

MOST_TURN = 0.5 * np.pi  # of the fastest part in a step
MOST_STEPS = 20_000_000  # of a trial
TERMS = 24  # of e^(G h), which thousands of steps multiply: (pi/2)^25/25! = 5e-21
SERIES = 17  # terms of the solution inside a step: (pi/2)^18/18! = 5e-13, once


class LinearMotion(NamedTuple):
    """Trials that move by z' = G z from mark to mark.

    The rows of z are positions, as many others that alone change the positions, then
    what drives both. They come in parts that do not act on each other, row i in part
    i modulo their number. Peaks are found the sooner, the less the norm of z of
    a part grows by G, and the more alike its rows turn. Best are modes, the squares of
    whose two rows add up to the energy.
    """

    parts: int  # their number
    driven: int  # rows that drive
    entries: Integers  # [entry, 2], row and column in G; others are zero in all trials
    G: Array  # [trial, entry], 1/s
    marks: Array  # [trial, mark], s, ascending: start, when a phase begins, end
    # [trial, phase, row]: what jumps at the begin of the phase; what then drives
    change: Array
    weight: Array  # [trial, watched, position], in the sum that is watched
    rest: Array  # [trial, phase, watched], what is added to the sums
    since: Array  # [trial, watched], phase from which its peak is taken


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
        Peaks of the watched quantities; histories of these at the samples; steps until
        no later one could hold a peak.
    """
    # the first call loads the compiler, and compiles
    from tolstat.integrator.propagator import KEPT, Pack, follow
    from tolstat.lanes.vector import WIDTH

    taken = np.zeros(0) if samples is None else np.asarray(samples, float)
    row, column = np.ascontiguousarray(motion.entries.T)
    n, _, m = motion.change.shape
    watched = motion.rest.shape[2]
    packs = -(-n // WIDTH)
    # the last pack is filled up with its last trial
    filled = np.minimum(np.arange(packs * WIDTH), n - 1)
    given = [motion.G, motion.marks, motion.change]
    finite = np.all([np.isfinite(x.reshape(n, -1)).all(axis=1) for x in given], axis=0)

    def across(values: Array) -> Array:
        still = values if finite.all() else np.where(finite, values.T, 0.0).T
        of_trial = still[filled].reshape(packs, WIDTH, -1)
        found = room(packs, of_trial.shape[2])
        found[:] = of_trial.transpose(0, 2, 1)
        return found

    def back(values: Array, *shape: int) -> Array:
        of_trial = values.transpose(0, 2, 1).reshape(packs * WIDTH, *shape)
        found = np.ascontiguousarray(of_trial[:n])
        found[failed] = np.nan
        return found

    def room(*shape: int) -> Array:
        # a vector of lanes in one line of the cache
        size = int(np.prod(shape)) * WIDTH
        found = np.zeros(size + WIDTH)
        first = -found.ctypes.data % 64 // 8
        return found[first : first + size].reshape(*shape, WIDTH)

    G, marks, change = map(across, given)
    weight, rest, since = map(across, (motion.weight, motion.rest, motion.since))
    extreme = room(packs, 2 * watched) - np.inf
    history = room(packs, len(taken) * watched) + np.nan
    steps = room(packs, 1)
    size = m // motion.parts
    columns = max(size, 2 * watched)
    same = {
        "row": row,
        "column": column,
        "parts": motion.parts,
        "driven": motion.driven,
        "samples": np.repeat(taken[:, None], WIDTH, axis=1),
        "clock": room(2),
        "z": room(m),
        "moved": room(m),
        "P": room(m * size),
        "power": room(m * columns),
        "product": room(m * columns),
        "length": room(columns),
        "slope": room(weight.shape[1]),
        "turn": room(motion.parts),
        "growth": room(motion.parts),
        "soon": room(motion.parts),
        "ever": room(motion.parts),
        "share": room(watched * motion.parts),
        "value": room(watched),
        "rate": room(watched),
        "sharp": room(watched),
        "reach": room(watched),
        "series": room((1 + SERIES) * 2 * watched),
        "above": room(2 * watched),
        "kept": room(2 * watched * (KEPT + m)),
    }
    for i in range(packs):
        pack = Pack(
            marks=marks[i],
            G=G[i],
            change=change[i],
            weight=weight[i],
            rest=rest[i],
            since=since[i],
            taken=np.zeros(WIDTH, np.int64),
            extreme=extreme[i],
            history=history[i],
            steps=steps[i],
            **same,
        )
        follow(pack)
    count = steps.transpose(0, 2, 1).reshape(-1)[:n]
    finite &= np.isfinite(count)
    few = count <= MOST_STEPS
    failed = ~(finite & few)
    extremes = back(extreme, 2 * watched)
    status = np.where(few, Status.DONE, Status.TOO_MANY_STEPS)
    nothing = np.zeros((n, 0))
    return Solution(
        np.zeros((n, 0, 0)), np.zeros((n, 0, 0)), extremes[:, :watched],
        -extremes[:, watched:], nothing, back(history, len(taken), watched),
        np.where(finite, status, Status.NOT_FINITE).astype(np.int64),
        np.where(finite, count, 0).astype(np.int64), np.full((n, 2), np.nan),
    )  # fmt: skip
