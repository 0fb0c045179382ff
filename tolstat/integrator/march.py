"""Loop of the integration; each trial in a lane has a separate time, step and error.

A lane whose trial ends takes the next trial of the block. Lanes never mix: the result
of a trial is bitwise the same with any neighbours.

Where a trial begins, passes marks or ends, numbers are copied one by one, in loops:
NumPy's assignments of slices would take the compiler half a minute, for checks of
shapes that cannot fail.
"""

import numpy as np

from tolstat.integrator import problem
from tolstat.integrator.crossing import (
    AT_ZERO,
    aim_at_crossing,
    change_sides,
    choose_sides,
    first_crossing,
    go_on,
    hold_at_zero,
    take_jump,
)
from tolstat.integrator.damping import damped_part
from tolstat.integrator.peaks import follow
from tolstat.integrator.signatures import march_signature
from tolstat.integrator.step import (
    FIRST_STEP,
    advance,
    aim,
    halfway,
    interpolate,
    quadrature_of,
    step_factor,
    worst_error,
    worst_state,
)
from tolstat.integrator.survey import survey
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows
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
    for i in range(len(block.sizes)):
        lanes.size[i, lane] = block.sizes[i]
        lanes.side[i, lane], lanes.returned[i, lane] = 1.0, AT_ZERO
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
    phase = min(mark, block.parameters.shape[1] - 1)
    for i in range(len(lanes.p)):
        lanes.p[i, lane] = block.parameters[trial, phase, i]
    if block.jumps_at_marks > 0:
        clock[problem.JUMP, lane] = 1.0
    length = clock[problem.TARGET, lane] - clock[problem.TIME, lane]
    first = FIRST_STEP * min(block.accuracy.max_step, length)
    clock[problem.STEP, lane] = max(first, 2.0 * clock[problem.SMALLEST, lane])
    clock[problem.ROOT, lane] = 1.0
    clock[problem.AFTER, lane] = 0.0
    return mark >= last


@compiled()
def _stay(lane, lanes, block, results):
    """Store the state of a trial that has ended at all later marks."""
    clock, trial = lanes.clock, int(lanes.clock[problem.TRIAL, lane])
    for mark in range(int(clock[problem.PHASE, lane]) + 1, block.marks.shape[1]):
        for i in range(len(lanes.arrived)):
            results.arrived[trial, mark, i] = lanes.arrived[i, lane]
    results.ended[trial, problem.TIME_ENDED] = clock[problem.TIME, lane]


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
    if event == problem.ENDED:
        _stay(lane, lanes, block, results)
        return Status.DONE
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


@compiled()
def _renew_rates(rates, watch, jump, lanes, step):
    """Evaluate the first stage again where a phase begins or a side changes.

    The rates may jump there, and at a crossing the state.
    """
    moment, clock, damped, k = step.moment, lanes.clock, step.damped, step.k
    # the second stage is free between two steps
    K1, K2 = k[0], k[1]
    moment[problem.TIME] = clock[problem.TIME]
    moment[problem.PHASE] = clock[problem.PHASE]
    if len(step.crossings) > 0:
        choose_sides(watch, lanes, step)
    if len(step.jumped) > 0:
        jump(moment, lanes.y, lanes.p, step.jumped)
        take_jump(lanes, step)
    rates(moment, lanes.y, lanes.p, K2)
    if len(step.crossings) > 0 and hold_at_zero(rates, watch, lanes, step):
        rates(moment, lanes.y, lanes.p, K2)
    renewed = clock[problem.EVENT] != problem.NOTHING
    for i in range(len(K1)):
        K1[i] = np.where(renewed, K2[i], K1[i])
    undamped = len(K1) - len(damped)
    for j in range(len(damped)):
        K1[undamped + j] = np.where(renewed, K2[damped[j]], K1[undamped + j])
    clock[problem.EVENT] = problem.NOTHING


@compiled()
def _take_samples(lanes, k, block, results):
    """Store the states at the sample times that this step passed."""
    clock = lanes.clock
    for lane in range(WIDTH):
        if clock[problem.ACCEPTED, lane] == 0.0:
            continue
        t, trial = clock[problem.TIME, lane], int(clock[problem.TRIAL, lane])
        sample = int(clock[problem.SAMPLE, lane])
        while sample < len(block.samples):
            # read here: outside the loop LLVM multiplies by 1/h, and histories change
            # in the last digit
            h = clock[problem.TRIED, lane]
            theta = (block.samples[sample] - t) / h
            if theta > 1.0:
                break
            for i in range(len(lanes.y)):
                results.history[trial, sample, i] = interpolate(
                    h, theta, lanes.y, k, lane, i
                )
            sample += 1
        clock[problem.SAMPLE, lane] = sample


@compiled(within=True)
def _take_over(accepted, h, lanes, step):
    """Move to the end of the step: states, quadratures, and rates as first stage."""
    y, end, quadratures = lanes.y, step.end, lanes.quadratures
    K1, K7 = step.k[0], step.k[6]
    n = len(y)
    for i in range(n):
        y[i] = np.where(accepted, end[i], y[i])
    for i in range(len(quadratures)):
        grown = quadrature_of(h, step.k, n + i) + damped_part(i, h, step)
        quadratures[i] = np.where(accepted, quadratures[i] + grown, quadratures[i])
    for i in range(len(K1)):
        K1[i] = np.where(accepted, K7[i], K1[i])


@compiled(march_signature)
def march(rates, watch, jump, per_scale, lanes, step, block, results):
    """Integrate every trial of a block.

    Parameters
    ----------
    rates, watch, jump
        The equations; see `problem.System`.
    per_scale : float64[state]
        Reciprocals of the states' scales.
    lanes : Lanes
        Idle.
    step : Step
        Room for their steps.
    block : Block
        The trials to be integrated.
    results : Results
        Filled.
    """
    lanes, step = rows(lanes), rows(step)
    rtol, max_step, max_steps = block.accuracy
    clock, moment = lanes.clock, step.moment
    crossing = len(step.crossings) > 0
    # not a literal: the type of a literal would compile a second time
    n_begun, n_busy = sort_out(np.int64(0), lanes, block, results)
    _renew_rates(rates, watch, jump, lanes, step)

    while n_busy > 0:
        t = clock[problem.TIME]
        h, t_new, landing = aim(t, clock[problem.STEP], clock[problem.TARGET])
        if crossing:
            h, t_new = aim_at_crossing(h, t_new, clock)
        moment[problem.PHASE] = clock[problem.PHASE]
        advance(rates, t, h, t_new, lanes.y, lanes.p, step)
        error = worst_error(h, step.k, per_scale) * (1.0 / rtol)
        # early: its long chain of roots runs in parallel with the next lines
        factor, clock[problem.ROOT] = step_factor(error, clock[problem.ROOT])
        running = clock[problem.PHASE] >= 0.0
        accepted = (error <= 1.0) & running

        last = clock[problem.COUNT] + 1.0 >= max_steps
        may_fail = running & ((h * factor < clock[problem.SMALLEST]) | last)
        if np.any(may_fail):
            clock[problem.WORST] = worst_state(h, step.k, per_scale)

        first, changed = 2.0 + 0.0 * h, error < 0.0
        taking = accepted & (clock[problem.PHASE] >= float(block.watch_from))
        if len(step.watched_middle) > 0 and (crossing or np.any(taking)):
            halfway(h, lanes.y, step.k, step.middle)
            moment[problem.TIME] = t + 0.5 * h
            watch(step.moment, step.middle, lanes.p, step.filled_middle)
            if crossing:
                first = first_crossing(watch, t, h, accepted, lanes, step)
                accepted = accepted & (first > 1.0)
                taking = taking & accepted
            follow(watch, taking, t, h, lanes, step)
        if len(block.samples) > 0 or len(step.surveyed) > 0:
            clock[problem.TRIED] = h
            clock[problem.ACCEPTED] = np.where(accepted, 1.0, 0.0)
            _take_samples(lanes, step.k, block, results)
            if len(step.surveyed) > 0:
                survey(rates, t, h, lanes, step, results)
        _take_over(accepted, h, lanes, step)

        clock[problem.TIME] = np.where(accepted, t_new, t)
        clock[problem.STEP] = np.minimum(h * factor, max_step)
        if crossing:
            aimed = clock[problem.AFTER] > 0.0
            go_on(h, first, accepted, max_step, clock)
            changed, arrived = change_sides(accepted, aimed, first, lanes, step)
            clock[problem.JUMP] = np.where(arrived, 1.0, 0.0)
        clock[problem.COUNT] = clock[problem.COUNT] + np.where(running, 1.0, 0.0)

        reached = accepted & landing
        failed = running & ((clock[problem.STEP] < clock[problem.SMALLEST]) | last)
        if np.any(reached | failed | changed):
            clock[problem.ERROR] = error
            event = np.where(changed, problem.CROSSED, problem.NOTHING)
            event = np.where(failed, problem.FAILED, event)
            event = np.where(reached, problem.MARK_REACHED, event)
            for i in block.ends:
                below = running & changed & (lanes.side[i] < 0.0)
                event = np.where(below, problem.ENDED, event)
            clock[problem.EVENT] = event
            n_begun, n_busy = sort_out(n_begun, lanes, block, results)
            _renew_rates(rates, watch, jump, lanes, step)
