"""Interface of the exact solution: linear motion from mark to mark, for a block."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.integrator.mistakes import check_times, expect
from tolstat.integrator.problem import Solution
from tolstat.status import Status


class LinearMotion(NamedTuple):
    """Trials that move by z' = G z from mark to mark.

    The first rows of z are positions. As many rows follow, the speeds, which alone
    change the positions. The last rows drive the speeds. Row i belongs to part
    i % parts. Parts do not act on each other. Modes scaled so that both rows' squares
    sum to the energy are fastest.
    """

    parts: int  # their number
    driven: int  # rows that drive
    # [entry, 2], row and column in G, each pair once; others are zero in all trials
    entries: Integers
    G: Array  # [trial, entry], 1/s
    marks: Array  # [trial, mark], s, ascending: start, when a phase begins, end
    # [trial, phase, row]: what jumps at the begin of the phase; what then drives
    change: Array
    weight: Array  # [trial, watched, position], in the sum that is watched
    rest: Array  # [trial, phase, watched], what is added to the sums
    since: Array  # [trial, watched], phase from which its peak is taken


def _check(motion: LinearMotion) -> None:
    """Refuse arrays and entries of G that do not fit together."""
    (trials, phases, m), (_, watched, n) = motion.change.shape, motion.weight.shape
    parts, entries, function = motion.parts, motion.entries, "LinearMotion"
    for name, shape in (
        ("change", (trials, phases, 2 * n + motion.driven)),
        ("G", (trials, len(entries))),
        ("marks", (trials, phases + 1)),
        ("weight", (trials, watched, n)),
        ("rest", (trials, phases, watched)),
        ("since", (trials, watched)),
    ):
        actual = getattr(motion, name).shape
        words = f"{shape} is expected"
        expect(actual == shape, function, f"{name} has shape {actual}", words)
    divide = f"a number that divides {m} rows is expected"
    expect(parts > 0 and m % parts == 0, function, f"parts {parts}", divide)
    row, column = entries.T
    speed = (n <= column) & (column < 2 * n)
    first = np.zeros(len(entries), bool)
    first[np.unique(entries, axis=0, return_index=True)[1]] = True
    for right, words in (
        (((entries >= 0) & (entries < m)).all(axis=1), f"rows 0 to {m - 1} exist"),
        ((row >= n) | speed, f"rows 0 to {n - 1} depend on speeds alone, the next {n}"),
        (row % parts == column % parts, f"both are expected in a part, row % {parts}"),
        (first, "each entry is expected once"),
    ):
        wrong = entries[~right].tolist()
        expect(not wrong, function, f"entry {wrong[:1]}", words)


def solve(motion: LinearMotion, samples: Array | None = None) -> Solution:
    """Return the exact solution of a block of trials, from rest.

    Parameters
    ----------
    motion : LinearMotion
        The trials.
    samples : float64[sample], optional
        Ascending times, s, from the last start to the first end of a trial.

    Raises
    ------
    ModelError
        If the shapes of the motion do not fit together, an entry of G changes a
        position by another row than a speed or acts across parts, or times do not
        ascend. Numbers are not checked: a trial with one that is not finite fails.

    Returns
    -------
    Solution
        Peaks of the watched quantities; histories of these at the samples; steps until
        no later one could hold a peak. Values at the ends of steps err by rounding
        alone. Inside a step they err by 6e-13 of ``|weight| |z|`` at most, summed over
        the parts: 5e-13 as the Taylor series ends, the rest by the search for a peak.
    """
    # the first call loads the compiler, and compiles
    from tolstat.integrator.linear_peaks import KEPT, MOST_STEPS, SERIES, Pack
    from tolstat.integrator.propagator import follow
    from tolstat.lanes.vector import WIDTH

    times = np.zeros(0) if samples is None else np.asarray(samples, float)
    _check(motion)
    check_times("solve", motion.marks, times)
    row, column = np.ascontiguousarray(motion.entries.T)
    n, _, m = motion.change.shape
    watched, positions = motion.weight.shape[1:]
    parts, size = motion.parts, m // motion.parts
    packs = -(-n // WIDTH)
    # the last pack is filled up with its last trial
    filled = np.minimum(np.arange(packs * WIDTH), n - 1)
    numbers = [motion.G, motion.marks, motion.change, motion.weight, motion.rest]
    by_trial = (np.isfinite(x).reshape(n, -1) for x in numbers)
    finite = np.all([x.all(axis=1) for x in by_trial], axis=0)

    def room(*shape: int) -> Array:
        # a vector of lanes in one line of the cache
        length = int(np.prod(shape)) * WIDTH
        memory = np.zeros(length + WIDTH)
        first = -memory.ctypes.data % 64 // 8
        return memory[first : first + length].reshape(*shape, WIDTH)

    def packed(values: Array) -> Array:
        still = values if finite.all() else np.where(finite, values.T, 0.0).T
        by_pack = still[filled].reshape(packs, WIDTH, -1)
        array = room(packs, by_pack.shape[2])
        array[:] = by_pack.transpose(0, 2, 1)
        return array

    def unpacked(values: Array, *shape: int) -> Array:
        by_lane = values.transpose(0, 2, 1).reshape(packs * WIDTH, *shape)
        return np.ascontiguousarray(by_lane[:n])

    names = "G", "marks", "change", "weight", "rest", "since"
    of_packs = {name: packed(getattr(motion, name)) for name in names}
    of_packs["extreme"] = extreme = room(packs, 2 * watched) - np.inf
    of_packs["history"] = history = room(packs, len(times) * watched) + np.nan
    of_packs["steps"] = steps = room(packs, 1)
    columns = max(size, 2 * watched)
    counts = {
        "clock": 2,
        "z moved": m,
        "P": m * size,
        "power product": m * columns,
        "length": columns,
        "slope": watched * positions,
        "turn growth soon ever": parts,
        "share": watched * parts,
        "value rate sharp reach": watched,
        "series": (1 + SERIES) * 2 * watched,
        "above": 2 * watched,
        "candidates": 2 * watched * (KEPT + m),
    }
    shared = {name: room(k) for group, k in counts.items() for name in group.split()}
    shared["samples"] = np.repeat(times[:, None], WIDTH, axis=1)
    for i in range(packs):
        follow(
            Pack(
                row=row,
                column=column,
                parts=parts,
                driven=motion.driven,
                taken=np.zeros(WIDTH, np.int64),
                **{name: array[i] for name, array in of_packs.items()},
                **shared,
            )
        )
    count = unpacked(steps)
    finite &= np.isfinite(count)
    in_time = count <= MOST_STEPS
    extremes = unpacked(extreme, 2 * watched)
    histories = unpacked(history, len(times), watched)
    extremes[~(finite & in_time)] = histories[~(finite & in_time)] = np.nan
    status = np.where(in_time, Status.DONE, Status.TOO_MANY_STEPS)
    return Solution(
        states=np.zeros((n, 0, 0)),
        quadratures=np.zeros((n, 0, 0)),
        greatest=extremes[:, :watched],
        least=-extremes[:, watched:],
        above=np.zeros((n, 0)),
        history=histories,
        status=np.where(finite, status, Status.NOT_FINITE).astype(np.int64),
        steps=np.where(finite, count, 0).astype(np.int64),
        ended=np.full((n, 2), np.nan),
        survey=np.zeros((n, 0, 3)),
    )
