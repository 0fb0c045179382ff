"""Which trial is in which lane: beginning, passing marks, ending.

Numbers are moved one by one, in loops: NumPy's assignments of slices would take the
compiler half a minute, for checks of shapes that cannot fail.
"""

from __future__ import annotations

import numpy as np

from tolstat.integrator.control import FIRST_STEP
from tolstat.integrator.problem import (
    AFTER,
    COUNT,
    ERROR,
    EVENT,
    MARK_REACHED,
    NOTHING,
    PHASE,
    ROOT,
    SMALLEST,
    STEP,
    TARGET,
    TIME,
)
from tolstat.lanes.compiled import compiled
from tolstat.lanes.vector import WIDTH
from tolstat.status import Status

NOT_RUN = int(Status.NOT_RUN)
DONE = int(Status.DONE)
TOO_MANY_STEPS = int(Status.TOO_MANY_STEPS)
STEP_TOO_SMALL = int(Status.STEP_TOO_SMALL)
NOT_FINITE = int(Status.NOT_FINITE)

SMALLEST_STEP = 1e-14  # of the duration of the trial


@compiled()
def _put_in(values, row, lanes, lane):
    """Copy a row of a table into a lane."""
    for i in range(len(lanes)):
        lanes[i, lane] = values[row, i]


@compiled()
def _take_out(lanes, lane, values, row):
    """Copy a lane into a row of a table."""
    for i in range(len(lanes)):
        values[row, i] = lanes[i, lane]


@compiled()
def _fill(lanes, lane, number):
    """Set all of a lane to a number."""
    for i in range(len(lanes)):
        lanes[i, lane] = number


@compiled()
def _finite(values, row):
    """Tell whether all of a row of a table are numbers."""
    total = 0.0
    for i in range(values.shape[1]):
        total += values[row, i]
    return np.isfinite(total)


@compiled()
def _begin(lane, trial, lanes, block):
    """Put a trial into a lane, at its first mark."""
    lanes.trial[lane] = trial
    lanes.sample[lane] = 0
    _put_in(block.start, trial, lanes.y, lane)
    _put_in(block.parameters, trial, lanes.p, lane)
    _fill(lanes.quadratures, lane, 0.0)
    clock = lanes.clock
    clock[TIME, lane] = clock[TARGET, lane] = block.marks[trial, 0]
    clock[PHASE, lane] = -1.0
    clock[SMALLEST, lane] = SMALLEST_STEP * (
        block.marks[trial, -1] - block.marks[trial, 0]
    )
    clock[COUNT, lane] = 0.0
    clock[EVENT, lane] = MARK_REACHED


@compiled()
def _pass_marks(lane, lanes, block, solution):
    """Store the state at the mark reached and enter the next phase that lasts.

    Returns
    -------
    bool
        Whether the trial is over.
    """
    clock, trial = lanes.clock, lanes.trial[lane]
    last = block.marks.shape[1] - 1
    while clock[PHASE, lane] < last and clock[TARGET, lane] <= clock[TIME, lane]:
        mark = int(clock[PHASE, lane]) + 1
        clock[PHASE, lane] = mark
        _take_out(lanes.y, lane, solution.states[trial], mark)
        _take_out(lanes.quadratures, lane, solution.quadratures[trial], mark)
        if mark == block.watch_from:
            _fill(lanes.greatest, lane, -np.inf)
            _fill(lanes.least, lane, np.inf)
            _fill(lanes.above, lane, 0.0)
        if mark < last:
            clock[TARGET, lane] = block.marks[trial, mark + 1]
    length = clock[TARGET, lane] - clock[TIME, lane]
    first = FIRST_STEP * min(block.accuracy.max_step, length)
    clock[STEP, lane] = max(first, 2.0 * clock[SMALLEST, lane])
    clock[ROOT, lane] = 1.0
    clock[AFTER, lane] = 0.0
    return clock[PHASE, lane] >= last


@compiled()
def _end(lane, status, lanes, solution):
    """Take a trial out of its lane; what it leaves unfinished stays not a number."""
    trial = lanes.trial[lane]
    if status == DONE:
        _take_out(lanes.greatest, lane, solution.greatest, trial)
        _take_out(lanes.least, lane, solution.least, trial)
        _take_out(lanes.above, lane, solution.above, trial)
        # what does not steer the step may have blown up unseen
        quadratures = solution.quadratures[trial]
        if not (
            _finite(quadratures, len(quadratures) - 1)
            and _finite(solution.greatest, trial)
            and _finite(solution.least, trial)
            and _finite(solution.above, trial)
        ):
            status = NOT_FINITE
    solution.status[trial] = status
    solution.steps[trial] = int(lanes.clock[COUNT, lane])
    lanes.trial[lane] = -1
    lanes.clock[PHASE, lane] = -1.0
    lanes.clock[STEP, lane] = 0.0


@compiled()
def _status(lane, lanes, block, solution):
    """Say how the trial of a lane ended; NOT_RUN while it is under way."""
    clock = lanes.clock
    if lanes.trial[lane] < 0:
        return DONE
    if clock[EVENT, lane] == MARK_REACHED:
        return DONE if _pass_marks(lane, lanes, block, solution) else NOT_RUN
    if clock[EVENT, lane] == NOTHING:
        return NOT_RUN
    if not np.isfinite(clock[ERROR, lane]):
        return NOT_FINITE
    if clock[STEP, lane] < clock[SMALLEST, lane]:
        return STEP_TOO_SMALL
    return TOO_MANY_STEPS


@compiled()
def sort_out(n_begun, lanes, block, solution):
    """Deal with the lanes in which something happened; refill those that are free.

    Returns
    -------
    tuple of int
        How many trials have begun, and how many lanes are busy.
    """
    n_busy = 0
    for lane in range(WIDTH):
        status = _status(lane, lanes, block, solution)
        while status != NOT_RUN:
            if lanes.trial[lane] >= 0:
                _end(lane, status, lanes, solution)
            if n_begun == len(block.start):
                lanes.clock[EVENT, lane] = NOTHING
                break
            _begin(lane, n_begun, lanes, block)
            n_begun += 1
            status = _status(lane, lanes, block, solution)
        if lanes.trial[lane] >= 0:
            n_busy += 1
    return n_begun, n_busy
