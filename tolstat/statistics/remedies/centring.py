"""The shifts that centre all responses between their limits: a linear programme."""

from collections.abc import Sequence

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.remedies.movable_trials import Moved

CENTRED = 1.25  # the margin above which centring ends
SLACK = 1e-4  # of that margin: rounding of the programme
COARSE = 0.02  # step over half tolerance: the nearest one may not be the best
PASSES = 3  # slopes change with the centre
GAIN = 0.005  # of the score, at least, by a pass


def centred(moved: Moved, entries: Sequence[int], farthest: float) -> Moved:
    """Shift some entries until the least margin of all limits is largest.

    With the least sum of shifts, in half tolerances, that leaves this margin or
    `CENTRED`; rounded as a drawing is. None is larger than `farthest`.
    """
    for _ in range(PASSES if entries else 0):
        shift = _least_shift(moved, np.array(entries), farthest)
        if shift is None:
            break
        change = moved.change._replace(shift=moved.change.shift + shift)
        rounded = moved.moved(moved.origin.design.rounded(change))
        candidate = _best_rounded(rounded, entries)
        if candidate.score < moved.score + GAIN:
            break
        moved = candidate
    return moved


def _least_shift(moved: Moved, entries: Array, farthest: float) -> Array | None:
    """Return the shift to add, float64[entry]; None if slopes show none."""
    from scipy.optimize import linprog  # slow to import

    finite = np.isfinite(moved.room)
    slopes = moved.slopes[entries].T  # [response, entry]
    uses = np.stack([-slopes, slopes], axis=1)[finite]  # of the room at each end
    rows = np.hstack([uses, -uses, moved.reach[finite][:, None]])
    scale = np.abs(rows).max(axis=1) + 1e-300
    rows, room = rows / scale[:, None], moved.room[finite] / scale
    design, so_far = moved.origin.design, moved.change.shift[entries]
    farthest = min(farthest, design.farthest)
    lowest = (design.lowest + np.zeros(len(moved.change.shift)))[entries]
    lowest = np.maximum(lowest, -farthest)
    up, down = (np.maximum(x, 0.0) for x in (farthest - so_far, so_far - lowest))
    shifts = [(0.0, most) for most in (*up.tolist(), *down.tolist())]
    margin = [*np.zeros(len(shifts)), -1.0]
    best = linprog(margin, rows, room, bounds=[*shifts, (-1e3, 1e3)])
    if best.status:
        return None
    least = min(best.x[-1], CENTRED)
    bounds = [*shifts, (least - SLACK * max(abs(least), 1), 1e3)]
    sums = [*np.ones(len(shifts)), 0.0]
    shortest = linprog(sums, rows, room, bounds=bounds)
    up, down = (shortest if not shortest.status else best).x[:-1].reshape(2, -1)
    shift = np.zeros(len(moved.change.shift))
    shift[entries] = up - down
    return shift


def _best_rounded(moved: Moved, entries: Sequence[int]) -> Moved:
    """Return the best of a rounded change and its neighbours, one entry at a time.

    Where a step is coarse the nearest one may not be the best one.
    """
    grid = moved.origin.design.steps / moved.origin.design.halves
    for entry in entries:
        if grid[entry] > COARSE:
            for step in (-grid[entry], grid[entry]):
                shift = moved.change.shift[entry] + step
                neighbour = moved.moved(moved.change.with_entry(entry, shift=shift))
                if neighbour.score > moved.score:
                    moved = neighbour
    return moved
