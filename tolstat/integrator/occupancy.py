"""Which trial is in which lane: beginning, passing marks, ending."""

from __future__ import annotations

import numpy as np

from tolstat.integrator.clock import (
    CLOCK_ROWS,
    COUNT,
    ERROR,
    EVENT,
    FAILED,
    MARK_REACHED,
    NOTHING,
    PHASE,
    ROOT,
    SMALLEST,
    STEP,
    TARGET,
    TIME,
)
from tolstat.integrator.control import FIRST_STEP
from tolstat.integrator.damping import Damping
from tolstat.integrator.trials import Lanes
from tolstat.lanes.compiled import compiled
from tolstat.lanes.vector import WIDTH
from tolstat.status import Status

DONE = int(Status.DONE)
TOO_MANY_STEPS = int(Status.TOO_MANY_STEPS)
STEP_TOO_SMALL = int(Status.STEP_TOO_SMALL)
NOT_FINITE = int(Status.NOT_FINITE)

SMALLEST_STEP = 1e-14  # of the duration of the trial


@compiled()
def idle_lanes(damped, block, solution):
    """Make lanes of which none has a trial."""
    n_states = block.start.shape[1]
    n_quadratures = solution.quadratures.shape[2]
    n_extremes, n_above = solution.greatest.shape[1], solution.above.shape[1]
    n_rates = n_states + n_quadratures + n_extremes + n_above + len(damped)
    return Lanes(
        clock=np.zeros((CLOCK_ROWS, WIDTH)),
        y=np.zeros((n_states, WIDTH)),
        p=np.zeros((block.parameters.shape[1], WIDTH)),
        k=np.zeros((7, n_rates, WIDTH)),
        quadratures=np.zeros((n_quadratures, WIDTH)),
        greatest=np.zeros((n_extremes, WIDTH)),
        least=np.zeros((n_extremes, WIDTH)),
        above=np.zeros((n_above, WIDTH)),
        damping=Damping(
            states=damped,
            lambda_h=np.zeros((len(damped), WIDTH)),
            share=np.zeros((len(damped), WIDTH)),
            first=np.zeros((len(damped), WIDTH)),
            last=np.zeros((len(damped), WIDTH)),
        ),
        trial=np.full(WIDTH, -1),
        sample=np.zeros(WIDTH, dtype=np.int64),
    )


@compiled()
def _begin(lane, trial, lanes, block):
    """Put a trial into a lane, at its first mark."""
    lanes.trial[lane] = trial
    lanes.sample[lane] = 0
    lanes.y[:, lane] = block.start[trial]
    lanes.p[:, lane] = block.parameters[trial]
    lanes.quadratures[:, lane] = 0.0
    clock = lanes.clock
    clock[TIME, lane] = clock[TARGET, lane] = block.marks[trial, 0]
    clock[PHASE, lane] = -1.0
    clock[SMALLEST, lane] = SMALLEST_STEP * (
        block.marks[trial, -1] - block.marks[trial, 0]
    )
    clock[COUNT, lane] = 0.0


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
        solution.states[trial, mark] = lanes.y[:, lane]
        solution.quadratures[trial, mark] = lanes.quadratures[:, lane]
        if mark == block.watch_from:
            lanes.greatest[:, lane] = -np.inf
            lanes.least[:, lane] = np.inf
            lanes.above[:, lane] = 0.0
        if mark < last:
            clock[TARGET, lane] = block.marks[trial, mark + 1]
    length = clock[TARGET, lane] - clock[TIME, lane]
    first = FIRST_STEP * min(block.accuracy.max_step, length)
    clock[STEP, lane] = max(first, 2.0 * clock[SMALLEST, lane])
    clock[ROOT, lane] = 1.0
    return clock[PHASE, lane] >= last


@compiled()
def _end(lane, status, lanes, solution):
    """Take a trial out of its lane; what it leaves unfinished stays not a number."""
    trial = lanes.trial[lane]
    if status == DONE:
        solution.greatest[trial] = lanes.greatest[:, lane]
        solution.least[trial] = lanes.least[:, lane]
        solution.above[trial] = lanes.above[:, lane]
        # what does not steer the step may have blown up unseen
        total = (
            np.sum(solution.quadratures[trial])
            + np.sum(solution.greatest[trial])
            + np.sum(solution.least[trial])
            + np.sum(solution.above[trial])
        )
        if not np.isfinite(total):
            status = NOT_FINITE
    solution.status[trial] = status
    solution.steps[trial] = int(lanes.clock[COUNT, lane])
    lanes.trial[lane] = -1
    lanes.clock[PHASE, lane] = -1.0
    lanes.clock[STEP, lane] = 0.0


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
        event = lanes.clock[EVENT, lane]
        if lanes.trial[lane] >= 0 and event == MARK_REACHED:
            if _pass_marks(lane, lanes, block, solution):
                _end(lane, DONE, lanes, solution)
        elif lanes.trial[lane] >= 0 and event == FAILED:
            if not np.isfinite(lanes.clock[ERROR, lane]):
                _end(lane, NOT_FINITE, lanes, solution)
            elif lanes.clock[STEP, lane] < lanes.clock[SMALLEST, lane]:
                _end(lane, STEP_TOO_SMALL, lanes, solution)
            else:
                _end(lane, TOO_MANY_STEPS, lanes, solution)
        while lanes.trial[lane] < 0 and n_begun < len(block.start):
            _begin(lane, n_begun, lanes, block)
            n_begun += 1
            lanes.clock[EVENT, lane] = MARK_REACHED
            if _pass_marks(lane, lanes, block, solution):
                _end(lane, DONE, lanes, solution)
        if lanes.trial[lane] >= 0:
            n_busy += 1
        else:
            lanes.clock[EVENT, lane] = NOTHING
    return n_begun, n_busy
