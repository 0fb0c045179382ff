"""Assignment of trials to lanes: a trial begins, passes marks, ends.

Numbers are copied one by one, in loops: NumPy's assignments of slices would take the
compiler half a minute, for checks of shapes that cannot fail.
"""

from __future__ import annotations

import numpy as np

from tolstat.integrator import problem
from tolstat.integrator.control import FIRST_STEP
from tolstat.lanes.compiled import compiled
from tolstat.lanes.vector import WIDTH
from tolstat.status import Status

SMALLEST_STEP = 1e-14  # of the duration of the trial


@compiled()
def _copy(numbers, to):
    """Copy a row of a table into a lane, or a lane into a row."""
    for i in range(len(to)):
        to[i] = numbers[i]


@compiled()
def _fill(lane, number):
    """Set all of a lane to a number."""
    for i in range(len(lane)):
        lane[i] = number


@compiled()
def _finite(row):
    """Return whether all numbers of a row of a table are finite."""
    total = 0.0
    for i in range(len(row)):
        total += row[i]
    return np.isfinite(total)


@compiled()
def _begin(lane, trial, lanes, block):
    """Put a trial into a lane, at its first mark."""
    lanes.trial[lane] = trial
    lanes.sample[lane] = 0
    _copy(block.start[trial], lanes.y[:, lane])
    _copy(block.parameters[trial], lanes.p[:, lane])
    _fill(lanes.quadratures[:, lane], 0.0)
    clock = lanes.clock[:, lane]
    clock[problem.TIME] = clock[problem.TARGET] = block.marks[trial, 0]
    clock[problem.PHASE] = -1.0
    duration = block.marks[trial, -1] - block.marks[trial, 0]
    clock[problem.SMALLEST] = SMALLEST_STEP * duration
    clock[problem.COUNT] = 0.0
    clock[problem.EVENT] = problem.MARK_REACHED
    clock[problem.JUMP] = 0.0
    _fill(lanes.side[:, lane], 0.0)
    _fill(lanes.size[:, lane], 0.0)


@compiled()
def _pass_marks(lane, lanes, block, solution):
    """Store the state at the mark reached and enter the next phase that lasts.

    Returns
    -------
    bool
        Whether the trial is over.
    """
    clock, trial = lanes.clock[:, lane], lanes.trial[lane]
    last = block.marks.shape[1] - 1
    while clock[problem.PHASE] < last and clock[problem.TARGET] <= clock[problem.TIME]:
        mark = int(clock[problem.PHASE]) + 1
        clock[problem.PHASE] = mark
        _copy(lanes.y[:, lane], solution.states[trial, mark])
        _copy(lanes.quadratures[:, lane], solution.quadratures[trial, mark])
        if mark == block.watch_from:
            _fill(lanes.greatest[:, lane], -np.inf)
            _fill(lanes.least[:, lane], np.inf)
            _fill(lanes.above[:, lane], 0.0)
        if mark < last:
            clock[problem.TARGET] = block.marks[trial, mark + 1]
    length = clock[problem.TARGET] - clock[problem.TIME]
    first = FIRST_STEP * min(block.accuracy.max_step, length)
    clock[problem.STEP] = max(first, 2.0 * clock[problem.SMALLEST])
    clock[problem.ROOT] = 1.0
    clock[problem.AFTER] = 0.0
    return clock[problem.PHASE] >= last


@compiled()
def _end(lane, status, lanes, solution):
    """Take a trial out of its lane; its unfinished results stay NaN."""
    clock, trial = lanes.clock[:, lane], lanes.trial[lane]
    if status == Status.DONE:
        _copy(lanes.greatest[:, lane], solution.greatest[trial])
        _copy(lanes.least[:, lane], solution.least[trial])
        _copy(lanes.above[:, lane], solution.above[trial])
        # quantities without error control may have diverged
        if not (
            _finite(solution.quadratures[trial, -1])
            and _finite(solution.greatest[trial])
            and _finite(solution.least[trial])
            and _finite(solution.above[trial])
        ):
            status = Status.NOT_FINITE
    if status != Status.DONE:
        solution.ended[trial, 0] = clock[problem.TIME]
        solution.ended[trial, 1] = clock[problem.WORST]
    solution.status[trial] = status
    solution.steps[trial] = int(clock[problem.COUNT])
    lanes.trial[lane] = -1
    clock[problem.PHASE] = -1.0
    clock[problem.STEP] = 0.0


@compiled()
def _status(lane, lanes, block, solution):
    """Return how the trial of a lane ended; Status.NOT_RUN while it runs."""
    clock = lanes.clock[:, lane]
    if lanes.trial[lane] < 0:
        return Status.DONE
    if clock[problem.EVENT] == problem.MARK_REACHED:
        over = _pass_marks(lane, lanes, block, solution)
        return Status.DONE if over else Status.NOT_RUN
    if clock[problem.EVENT] in (problem.NOTHING, problem.CROSSED):
        return Status.NOT_RUN
    if not np.isfinite(clock[problem.ERROR]):
        return Status.NOT_FINITE
    if clock[problem.STEP] < clock[problem.SMALLEST]:
        return Status.STEP_TOO_SMALL
    return Status.TOO_MANY_STEPS


@compiled()
def sort_out(n_begun, lanes, block, solution):
    """End and begin trials in the lanes with an event; return trials and busy lanes.

    Returns
    -------
    tuple of int
        Number of trials that have begun, and number of busy lanes.
    """
    n_busy = 0
    for lane in range(WIDTH):
        status = _status(lane, lanes, block, solution)
        while status != Status.NOT_RUN:
            if lanes.trial[lane] >= 0:
                _end(lane, status, lanes, solution)
            if n_begun == len(block.start):
                lanes.clock[problem.EVENT, lane] = problem.NOTHING
                break
            _begin(lane, n_begun, lanes, block)
            n_begun += 1
            status = _status(lane, lanes, block, solution)
        if lanes.trial[lane] >= 0:
            n_busy += 1
    return n_begun, n_busy
