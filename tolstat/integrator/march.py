"""Many trials through the lanes, each with its own time, step and error.

A lane whose trial ends takes the next trial of the block. Lanes never mix, so a
trial's result is bitwise the same whatever its neighbours.
"""

from __future__ import annotations

import numpy as np
from numba import types

from tolstat.integrator.control import step_factor
from tolstat.integrator.occupancy import (
    CLOCK_ROWS,
    COUNT,
    EVENT,
    FAILED,
    MARK_REACHED,
    PHASE,
    ROOT,
    SAMPLE,
    SMALLEST,
    STEP,
    TARGET,
    TIME,
    sort_out,
)
from tolstat.integrator.step import (
    advance,
    error_of,
    halfway,
    interpolate,
    quadrature_of,
    rates_type,
)
from tolstat.integrator.trials import Block, Found, Lanes
from tolstat.integrator.watching import follow_extremes, follow_shares
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows
from tolstat.lanes.vector import WIDTH

numbers = types.float64[::1]
table = types.float64[:, ::1]
tables = types.float64[:, :, ::1]
integers = types.int64[::1]


@compiled()
def _renew_rates(rates, lanes, moment, y, fresh):
    """Evaluate the first stage anew where a phase begins: the rates may jump there."""
    K, L = rows(moment), rows(lanes.clock)
    K[0], K[1] = L[TIME], L[PHASE]
    rates(moment, y, lanes.p, fresh)
    for lane in range(WIDTH):
        if lanes.clock[EVENT, lane] == MARK_REACHED:
            lanes.k[0, :, lane] = fresh[:, lane]
        lanes.clock[EVENT, lane] = 0.0


@compiled()
def _take_samples(lanes, block, found, h):
    """Store the states at the sample times that this step passed."""
    clock = lanes.clock
    for lane in range(WIDTH):
        if clock[SAMPLE, lane] == 0.0:
            continue
        t, trial = clock[TIME, lane], lanes.trial[lane]
        while lanes.sample[lane] < len(block.samples):
            theta = (block.samples[lanes.sample[lane]] - t) / h[0, lane]
            if theta > 1.0:
                break
            for i in range(len(lanes.y)):
                found.history[trial, lanes.sample[lane], i] = interpolate(
                    h[0, lane], theta, lanes.y, lanes.k, lane, i
                )
            lanes.sample[lane] += 1


@compiled(
    types.void(
        rates_type,
        rates_type,
        table,
        table,
        table,
        numbers,
        types.int64,
        numbers,
        numbers,
        tables,
        tables,
        table,
        table,
        table,
        tables,
        integers,
        integers,
    )
)
def march(
    rates,
    watch,
    start,
    parameters,
    marks,
    samples,
    watch_from,
    scale,
    limits,
    states,
    quadratures,
    greatest,
    least,
    above,
    history,
    status,
    steps,
):
    """Integrate every trial of a block; see `integrate` for the arguments.

    `limits` holds rtol, the longest step (s) and the most steps of a trial.
    """
    rtol, max_step, max_steps = limits[0], limits[1], limits[2]
    n, n_sums = start.shape[1], quadratures.shape[2]
    n_extremes, n_above = greatest.shape[1], above.shape[1]
    first = n + n_sums  # of the watched quantities among the rates
    first_above = first + n_extremes
    n_rates = first_above + n_above

    block = Block(start, parameters, marks, samples, watch_from, max_step)
    found = Found(states, quadratures, greatest, least, above, history, status, steps)
    lanes = Lanes(
        np.zeros((CLOCK_ROWS, WIDTH)),
        np.zeros((n, WIDTH)),
        np.zeros((parameters.shape[1], WIDTH)),
        np.zeros((n_sums, WIDTH)),
        np.zeros((n_extremes, WIDTH)),
        np.zeros((n_extremes, WIDTH)),
        np.zeros((n_above, WIDTH)),
        np.zeros((7, n_rates, WIDTH)),
        np.full(WIDTH, -1),
        np.zeros(WIDTH, dtype=np.int64),
    )
    y_new, y_middle = np.zeros((n, WIDTH)), np.zeros((n, WIDTH))
    moment = np.zeros((2, WIDTH))
    fresh = np.zeros((n_rates, WIDTH))
    middle = np.zeros((n_extremes + n_above, WIDTH))
    error, taken = np.zeros((1, WIDTH)), np.zeros((1, WIDTH))

    k = lanes.k
    L, K, Y, N = rows(lanes.clock), rows(moment), rows(lanes.y), rows(y_new)
    S, K1, K7 = rows(lanes.sums), rows(k[0]), rows(k[6])
    n_begun, n_busy = sort_out(0, error, lanes, block, found)
    _renew_rates(rates, lanes, moment, lanes.y, fresh)

    while n_busy > 0:
        t, target = L[TIME], L[TARGET]
        remaining = target - t
        landing = L[STEP] >= remaining
        h = np.where(2.0 * L[STEP] > remaining, 0.5 * remaining, L[STEP])
        h = np.where(landing, remaining, h)
        t_new = np.where(landing, target, t + h)  # t + (target - t) can miss it
        K[1] = L[PHASE]
        advance(rates, moment, t, h, t_new, lanes.y, lanes.p, k, y_new)

        worst = np.abs(error_of(h, k, 0)) * (1.0 / scale[0])
        for i in range(1, n):
            worst = np.maximum(worst, np.abs(error_of(h, k, i)) * (1.0 / scale[i]))
        worst = worst * (1.0 / rtol)
        running = L[PHASE] >= 0.0
        accepted = (worst <= 1.0) & running

        taking = accepted & (L[PHASE] >= float(watch_from))
        if n_rates > first and np.any(taking):
            halfway(h, lanes.y, k, y_middle)
            K[0] = t + 0.5 * h
            watch(moment, y_middle, lanes.p, middle)
            follow_extremes(
                taking, k[0, first:], middle, k[6, first:], lanes.greatest,
                lanes.least,
            )  # fmt: skip
            follow_shares(
                taking, h, k[0, first_above:], middle[n_extremes:],
                k[6, first_above:], lanes.above,
            )  # fmt: skip
        if len(samples) > 0:
            rows(taken)[0] = h
            L[SAMPLE] = np.where(accepted, 1.0, 0.0)
            _take_samples(lanes, block, found, taken)

        for i in range(n):
            Y[i] = np.where(accepted, N[i], Y[i])
        for i in range(n_sums):
            S[i] = np.where(accepted, S[i] + quadrature_of(h, k, n + i), S[i])
        for i in range(n_rates):
            K1[i] = np.where(accepted, K7[i], K1[i])
        factor, root = step_factor(worst, L[ROOT])
        step = np.minimum(h * factor, max_step)
        count = L[COUNT] + np.where(running, 1.0, 0.0)
        L[TIME] = np.where(accepted, t_new, t)
        L[STEP], L[ROOT] = step, root
        L[COUNT] = count

        reached = accepted & landing
        failed = running & ((step < L[SMALLEST]) | (count >= max_steps))
        if np.any(reached | failed):
            rows(error)[0] = worst
            L[EVENT] = np.where(reached, MARK_REACHED, np.where(failed, FAILED, 0.0))
            n_begun, n_busy = sort_out(n_begun, error, lanes, block, found)
            _renew_rates(rates, lanes, moment, lanes.y, fresh)
