"""Assignment of trials to lanes: a trial begins, passes marks, ends.

Numbers are copied one by one, in loops: NumPy's assignments of slices would take the
compiler half a minute, for checks of shapes that cannot fail.
"""

import numpy as np

from tolstat.integrator import problem
from tolstat.integrator.control import FIRST_STEP
from tolstat.lanes.compiled import compiled
from tolstat.lanes.vector import WIDTH
from tolstat.status import Status

SMALLEST_STEP = 1e-14  # of the duration of the trial


@compiled()
def _begin(lane, trial, lanes, block):
    """Put a trial into a lane, at its first mark."""
    for i in range(len(lanes.all_rows)):
        lanes.all_rows[i, lane] = 0.0
    for i in range(len(lanes.y)):
        lanes.y[i, lane] = block.start[trial, i]
    for i in range(len(lanes.p)):
        lanes.p[i, lane] = block.parameters[trial, i]
    clock, begin, end = lanes.clock, block.marks[trial, 0], block.marks[trial, -1]
    clock[problem.TRIAL, lane] = trial
    clock[problem.TIME, lane] = clock[problem.TARGET, lane] = begin
    clock[problem.PHASE, lane] = -1.0
    clock[problem.SMALLEST, lane] = SMALLEST_STEP * (end - begin)
    clock[problem.EVENT, lane] = problem.MARK_REACHED


@compiled()
def _pass_marks(lane, lanes, block, results):
    """Store the state at the mark reached and enter the next phase that lasts.

    Returns
    -------
    bool
        Whether the trial is over.
    """
    clock, trial = lanes.clock, int(lanes.clock[problem.TRIAL, lane])
    last = block.marks.shape[1] - 1
    mark = int(clock[problem.PHASE, lane])
    while mark < last and clock[problem.TARGET, lane] <= clock[problem.TIME, lane]:
        mark += 1
        for i in range(len(lanes.arrived)):
            results.arrived[trial, mark, i] = lanes.arrived[i, lane]
        if mark == block.watch_from:
            for i in range(len(lanes.greatest)):
                lanes.greatest[i, lane], lanes.least[i, lane] = -np.inf, np.inf
            for i in range(len(lanes.above)):
                lanes.above[i, lane] = 0.0
        if mark < last:
            clock[problem.TARGET, lane] = block.marks[trial, mark + 1]
    clock[problem.PHASE, lane] = mark
    length = clock[problem.TARGET, lane] - clock[problem.TIME, lane]
    first = FIRST_STEP * min(block.accuracy.max_step, length)
    clock[problem.STEP, lane] = max(first, 2.0 * clock[problem.SMALLEST, lane])
    clock[problem.ROOT, lane] = 1.0
    clock[problem.AFTER, lane] = 0.0
    return mark >= last


@compiled()
def _end(lane, status, lanes, results):
    """Take a trial out of its lane; its unfinished results stay NaN."""
    clock, trial = lanes.clock, int(lanes.clock[problem.TRIAL, lane])
    if status == Status.DONE:
        # quantities without error control may have diverged
        total = 0.0
        for i in range(len(lanes.watched)):
            results.watched[trial, i] = lanes.watched[i, lane]
            total += lanes.watched[i, lane]
        for i in range(len(lanes.quadratures)):
            total += lanes.quadratures[i, lane]
        if not np.isfinite(total):
            status = Status.NOT_FINITE
    results.status[trial] = status.value
    results.steps[trial] = int(clock[problem.COUNT, lane])
    if status != Status.DONE:
        results.ended[trial, problem.TIME_ENDED] = clock[problem.TIME, lane]
        results.ended[trial, problem.WORST_STATE] = clock[problem.WORST, lane]
    clock[problem.TRIAL, lane] = clock[problem.PHASE, lane] = -1.0
    clock[problem.STEP, lane] = 0.0


@compiled()
def _status(lane, lanes, block, results):
    """Return how the trial of a lane ended; Status.NOT_RUN while it runs."""
    clock = lanes.clock
    event = clock[problem.EVENT, lane]
    if clock[problem.TRIAL, lane] < 0.0:
        return Status.DONE
    if event == problem.MARK_REACHED:
        ended = _pass_marks(lane, lanes, block, results)
        return Status.DONE if ended else Status.NOT_RUN
    if event != problem.FAILED:
        return Status.NOT_RUN
    if not np.isfinite(clock[problem.ERROR, lane]):
        return Status.NOT_FINITE
    if clock[problem.STEP, lane] < clock[problem.SMALLEST, lane]:
        return Status.STEP_TOO_SMALL
    return Status.TOO_MANY_STEPS


@compiled()
def sort_out(n_begun, lanes, block, results):
    """End and begin trials in the lanes with an event; return trials and busy lanes.

    Returns
    -------
    tuple of int
        Number of trials that have begun, and number of busy lanes.
    """
    n_busy = 0
    for lane in range(WIDTH):
        status = _status(lane, lanes, block, results)
        while status != Status.NOT_RUN:
            if lanes.clock[problem.TRIAL, lane] >= 0.0:
                _end(lane, status, lanes, results)
            if n_begun == len(block.start):
                lanes.clock[problem.EVENT, lane] = problem.NOTHING
                break
            _begin(lane, n_begun, lanes, block)
            n_begun += 1
            status = _status(lane, lanes, block, results)
        if lanes.clock[problem.TRIAL, lane] >= 0.0:
            n_busy += 1
    return n_begun, n_busy
