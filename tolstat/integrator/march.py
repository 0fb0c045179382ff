"""Many trials through the lanes, each with its own time, step and error.

A lane whose trial ends takes the next trial of the block. Lanes never mix, so a
trial's result is bitwise the same whatever its neighbours.
"""

from __future__ import annotations

import numpy as np

from tolstat.integrator.clock import (
    ACCEPTED,
    COUNT,
    ERROR,
    EVENT,
    FAILED,
    MARK_REACHED,
    MOMENT_ROWS,
    NOTHING,
    PHASE,
    ROOT,
    SMALLEST,
    STEP,
    TARGET,
    TIME,
    TRIED,
)
from tolstat.integrator.control import aim, step_factor
from tolstat.integrator.occupancy import idle_lanes, sort_out
from tolstat.integrator.signatures import march_signature
from tolstat.integrator.step import (
    advance,
    halfway,
    interpolate,
    quadrature_of,
    worst_error,
)
from tolstat.integrator.watching import follow
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows
from tolstat.lanes.vector import WIDTH


@compiled()
def _renew_rates(rates, moment, lanes):
    """Evaluate the first stage anew where a phase begins: the rates may jump there."""
    now, clock = rows(moment), rows(lanes.clock)
    damping = lanes.damping
    now[TIME], now[PHASE] = clock[TIME], clock[PHASE]
    # the second stage is free between two steps
    rates(moment, lanes.y, lanes.p, lanes.k[1])
    for lane in range(WIDTH):
        if lanes.clock[EVENT, lane] == MARK_REACHED:
            lanes.k[0, :, lane] = lanes.k[1, :, lane]
            for j in range(len(damping.states)):
                damping.first[j, lane] = lanes.k[1, damping.states[j], lane]
        lanes.clock[EVENT, lane] = NOTHING


@compiled()
def _take_samples(lanes, block, solution):
    """Store the states at the sample times that this step passed."""
    clock = lanes.clock
    for lane in range(WIDTH):
        if clock[ACCEPTED, lane] == 0.0:
            continue
        t, trial = clock[TIME, lane], lanes.trial[lane]
        while lanes.sample[lane] < len(block.samples):
            theta = (block.samples[lanes.sample[lane]] - t) / clock[TRIED, lane]
            if theta > 1.0:
                break
            for i in range(len(lanes.y)):
                solution.history[trial, lanes.sample[lane], i] = interpolate(
                    clock[TRIED, lane], theta, lanes.y, lanes.k, lane, i
                )
            lanes.sample[lane] += 1


@compiled(within=True)
def _take_over(accepted, h, y_new, lanes):
    """Go on from the end of the step: states, quadratures, and rates as first stage."""
    old, new = rows(lanes.y), rows(y_new)
    quadratures = rows(lanes.quadratures)
    K1, K7 = rows(lanes.k[0]), rows(lanes.k[6])
    n = len(old)
    for i in range(n):
        old[i] = np.where(accepted, new[i], old[i])
    for i in range(len(quadratures)):
        grown = quadratures[i] + quadrature_of(h, lanes.k, n + i)
        quadratures[i] = np.where(accepted, grown, quadratures[i])
    for i in range(len(K1)):
        K1[i] = np.where(accepted, K7[i], K1[i])
    first, last = rows(lanes.damping.first), rows(lanes.damping.last)
    for j in range(len(first)):
        first[j] = np.where(accepted, last[j], first[j])


@compiled(march_signature)
def march(rates, watch, scale, damped, block, solution):
    """Integrate every trial of a block.

    Parameters
    ----------
    rates, watch, scale, damped
        The equations; see `integrate.System`.
    block : Block
        What is asked.
    solution : Solution
        Filled with what is found.
    """
    rtol, max_step, max_steps = block.accuracy
    n = block.start.shape[1]
    n_extremes, n_above = solution.greatest.shape[1], solution.above.shape[1]
    n_watched = n_extremes + n_above

    sharpness = 1.0 / scale
    lanes = idle_lanes(damped, block, solution)
    moment = np.zeros((MOMENT_ROWS, WIDTH))
    y_new, y_middle = np.zeros((n, WIDTH)), np.zeros((n, WIDTH))
    watched_middle = np.zeros((n_watched, WIDTH))
    clock, now = rows(lanes.clock), rows(moment)
    n_begun, n_busy = sort_out(0, lanes, block, solution)
    _renew_rates(rates, moment, lanes)

    while n_busy > 0:
        t = clock[TIME]
        h, t_new, landing = aim(t, clock[STEP], clock[TARGET])
        now[PHASE] = clock[PHASE]
        advance(
            rates, moment, t, h, t_new, lanes.y, lanes.p, lanes.k, y_new, lanes.damping
        )
        error = worst_error(h, lanes.k, sharpness) * (1.0 / rtol)
        # early: its long chain of roots runs beside what follows
        factor, clock[ROOT] = step_factor(error, clock[ROOT])
        running = clock[PHASE] >= 0.0
        accepted = (error <= 1.0) & running

        taking = accepted & (clock[PHASE] >= float(block.watch_from))
        if n_watched > 0 and np.any(taking):
            halfway(h, lanes.y, lanes.k, y_middle)
            now[TIME] = t + 0.5 * h
            watch(moment, y_middle, lanes.p, watched_middle)
            follow(taking, h, watched_middle, lanes)
        if len(block.samples) > 0:
            clock[TRIED] = h
            clock[ACCEPTED] = np.where(accepted, 1.0, 0.0)
            _take_samples(lanes, block, solution)
        _take_over(accepted, h, y_new, lanes)

        clock[TIME] = np.where(accepted, t_new, t)
        clock[STEP] = np.minimum(h * factor, max_step)
        clock[COUNT] = clock[COUNT] + np.where(running, 1.0, 0.0)

        reached = accepted & landing
        failed = running & (
            (clock[STEP] < clock[SMALLEST]) | (clock[COUNT] >= max_steps)
        )
        if np.any(reached | failed):
            clock[ERROR] = error
            failure = np.where(failed, FAILED, NOTHING)
            clock[EVENT] = np.where(reached, MARK_REACHED, failure)
            n_begun, n_busy = sort_out(n_begun, lanes, block, solution)
            _renew_rates(rates, moment, lanes)
