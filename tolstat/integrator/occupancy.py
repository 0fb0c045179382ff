"""Which trial is in which lane: beginning, passing marks, ending."""

from __future__ import annotations

import numpy as np

from tolstat.integrator.control import FIRST_STEP
from tolstat.lanes.compiled import compiled
from tolstat.lanes.vector import WIDTH
from tolstat.status import Status

DONE = int(Status.DONE)
TOO_MANY_STEPS = int(Status.TOO_MANY_STEPS)
STEP_TOO_SMALL = int(Status.STEP_TOO_SMALL)
NOT_FINITE = int(Status.NOT_FINITE)

SMALLEST_STEP = 1e-14  # of the duration of the trial

# rows of the lanes' clocks
TIME, PHASE, STEP, ROOT, TARGET, SMALLEST, COUNT, SAMPLE, EVENT = range(9)
CLOCK_ROWS = 9
MARK_REACHED = 1.0
FAILED = 2.0


@compiled()
def begin(lane, trial, lanes, block):
    """Put a trial into a lane, at its first mark."""
    lanes.trial[lane] = trial
    lanes.sample[lane] = 0
    lanes.y[:, lane] = block.start[trial]
    lanes.p[:, lane] = block.parameters[trial]
    lanes.sums[:, lane] = 0.0
    clock = lanes.clock
    clock[TIME, lane] = clock[TARGET, lane] = block.marks[trial, 0]
    clock[PHASE, lane] = -1.0
    clock[SMALLEST, lane] = SMALLEST_STEP * (
        block.marks[trial, -1] - block.marks[trial, 0]
    )
    clock[COUNT, lane] = 0.0


@compiled()
def pass_marks(lane, lanes, block, found):
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
        found.states[trial, mark] = lanes.y[:, lane]
        found.quadratures[trial, mark] = lanes.sums[:, lane]
        if mark == block.watch_from:
            lanes.greatest[:, lane] = -np.inf
            lanes.least[:, lane] = np.inf
            lanes.above[:, lane] = 0.0
        if mark < last:
            clock[TARGET, lane] = block.marks[trial, mark + 1]
    length = clock[TARGET, lane] - clock[TIME, lane]
    first = FIRST_STEP * min(block.max_step, length)
    clock[STEP, lane] = max(first, 2.0 * clock[SMALLEST, lane])
    clock[ROOT, lane] = 1.0
    return clock[PHASE, lane] >= last


@compiled()
def end(lane, status, lanes, found):
    """Take a trial out of its lane; what it leaves unfinished stays not a number."""
    trial = lanes.trial[lane]
    if status == DONE:
        found.greatest[trial] = lanes.greatest[:, lane]
        found.least[trial] = lanes.least[:, lane]
        found.above[trial] = lanes.above[:, lane]
        # what does not steer the step may have blown up unseen
        total = (
            np.sum(found.quadratures[trial])
            + np.sum(found.greatest[trial])
            + np.sum(found.least[trial])
            + np.sum(found.above[trial])
        )
        if not np.isfinite(total):
            status = NOT_FINITE
    found.status[trial] = status
    found.steps[trial] = int(lanes.clock[COUNT, lane])
    lanes.trial[lane] = -1
    lanes.clock[PHASE, lane] = -1.0
    lanes.clock[STEP, lane] = 0.0


@compiled()
def sort_out(n_begun, error, lanes, block, found):
    """Deal with the lanes in which something happened; refill those that are free.

    Returns
    -------
    tuple of int
        How many trials have begun, and how many lanes are busy.
    """
    n_busy = 0
    for lane in range(WIDTH):
        event = lanes.clock[EVENT, lane]
        if lanes.trial[lane] >= 0 and event == MARK_REACHED:
            if pass_marks(lane, lanes, block, found):
                end(lane, DONE, lanes, found)
        elif lanes.trial[lane] >= 0 and event == FAILED:
            if not np.isfinite(error[0, lane]):
                end(lane, NOT_FINITE, lanes, found)
            elif lanes.clock[STEP, lane] < lanes.clock[SMALLEST, lane]:
                end(lane, STEP_TOO_SMALL, lanes, found)
            else:
                end(lane, TOO_MANY_STEPS, lanes, found)
        while lanes.trial[lane] < 0 and n_begun < len(block.start):
            begin(lane, n_begun, lanes, block)
            n_begun += 1
            lanes.clock[EVENT, lane] = MARK_REACHED
            if pass_marks(lane, lanes, block, found):
                end(lane, DONE, lanes, found)
        if lanes.trial[lane] >= 0:
            n_busy += 1
        else:
            lanes.clock[EVENT, lane] = 0.0
    return n_begun, n_busy
