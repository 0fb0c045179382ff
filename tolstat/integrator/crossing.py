"""Kinks of the rates: a step ends where a quantity behind them changes sign.

A force that acts on one side only has a kink where it begins. A step over the kink has
a low order. A short visit to the other side can pass undetected between two evaluations
of the rates. So the quantities that a system names are evaluated at the start, middle
and end of every step that the error permits. They are also evaluated at the vertex of
the parabola through these values. If one changes its sign, the step is tried again and
ends at the first crossing on its dense output; then the march continues with the former
step. A start that is zero within rounding is on the side to which the step goes: steps
before and after a crossing each lie on one side. The rates do not jump there: the last
stage of a step is the first of the next.
"""

from __future__ import annotations

import numpy as np

from tolstat.integrator.peaks import look, vertex_of
from tolstat.integrator.problem import AFTER, SMALLEST, STEP, TARGET, TIME
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows

ROUNDING = 1e-9  # of the largest size in the step: smaller values are zero
LOOKS = 50  # most evaluations for one crossing


@compiled(within=True)
def aim_at_crossing(h, t_new, clock):
    """Return the step and the time after it: to the crossing, if one was found."""
    t, step, target = clock[TIME], clock[STEP], clock[TARGET]
    short = (clock[AFTER] > 0.0) & (step < target - t)
    return np.where(short, step, h), np.where(short, t + step, t_new)


@compiled()
def _first_of(watch, t, h, permitted, number, lanes, step):
    """Return the fraction of the step at which one quantity first changes its sign.

    Parameters
    ----------
    watch
        See `problem.System`.
    t, h : vector
        Start of the step and its length, s.
    permitted : mask
        The lanes to be searched.
    number : int
        Number of the quantity, among the watched ones.
    lanes, step : Lanes, Step
        With the rates at both ends, and the watched quantities in the middle.

    Returns
    -------
    vector
        2 if it does not.
    """
    row = len(lanes.y) + len(lanes.quadratures) + number
    a, b = rows(step.k[0])[row], rows(step.k[6])[row]
    m = rows(step.watched_middle)[number]
    zero = ROUNDING * np.maximum(np.abs(a), np.maximum(np.abs(m), np.abs(b)))
    goes = np.where(np.abs(m) > zero, m, b)
    side = np.copysign(1.0 + 0.0 * h, np.where(np.abs(a) > zero, a, goes))

    # a visit to the other side and back, if three points show it
    theta, vertex = vertex_of(a, m, b)
    visit = permitted & (theta > 0.0) & (theta < 1.0) & (side * vertex < -zero)
    between, value = 0.5 + 0.0 * h, m
    if np.any(visit):
        there = look(watch, t, h, np.where(visit, theta, 0.5), number, lanes, step)
        visit = visit & (side * there < -zero)
        between, value = np.where(visit, theta, between), np.where(visit, there, m)

    early = side * value < -zero
    found = permitted & (early | (side * b < -zero))
    # 0 at the crossing, below 0 behind it
    lower, upper = np.where(early, 0.0, between), np.where(early, between, 1.0)
    f_lower = np.maximum(side * np.where(early, a, value), 0.0)
    f_upper = np.where(found, side * np.where(early, value, b), -1.0)
    at, looking, last = upper, found, 0.0 * h
    for _ in range(LOOKS):
        if not np.any(looking):
            break
        # regula falsi; an end that stays twice counts half (Illinois method)
        guess = (lower * f_upper - upper * f_lower) / (f_upper - f_lower)
        at = np.where(looking, guess, at)
        f = side * look(watch, t, h, at, number, lanes, step)
        behind = f < 0.0
        f_lower = np.where(behind & (last < 0.0), 0.5 * f_lower, f_lower)
        f_upper = np.where(~behind & (last > 0.0), 0.5 * f_upper, f_upper)
        upper, f_upper = np.where(behind, at, upper), np.where(behind, f, f_upper)
        lower, f_lower = np.where(behind, lower, at), np.where(behind, f_lower, f)
        last = np.where(behind, -1.0, 1.0)
        looking = looking & (np.abs(f) > 0.5 * zero)
    return np.where(found, at, 2.0)


@compiled()
def first_crossing(watch, t, h, permitted, lanes, step):
    """Return the fraction of the step at the first crossing; 2 if there is none.

    Parameters
    ----------
    watch, t, h, permitted, lanes, step
        As of `_first_of`.
    """
    smallest = rows(lanes.clock)[SMALLEST]
    # a step of the least length ends at the crossing
    looked_at = permitted & (h > 2.0 * smallest)
    first = 2.0 + 0.0 * h
    for i in range(len(step.crossings)):
        number = step.crossings[i]
        found = _first_of(watch, t, h, looked_at, number, lanes, step)
        # so does a step that ends less than that behind it
        before = h - h * found > smallest
        first = np.minimum(first, np.where(before, found, 2.0))
    return first


@compiled(within=True)
def go_on(h, first, accepted, max_step, clock):
    """Set the next step: to the crossing, or behind it the step before it.

    Parameters
    ----------
    h, first : vector
        The step, s, and the fraction of it at the crossing.
    accepted : mask
        The lanes whose step is taken.
    max_step : float
        The longest step, s.
    clock : rows
        With the step of the controller; changed in place.
    """
    crosses, after = first < 1.0, clock[AFTER]
    resumed = np.minimum(np.maximum(clock[STEP], after), max_step)
    wanted = np.where(accepted, resumed, clock[STEP])
    short = np.maximum(h * first, 2.0 * clock[SMALLEST])
    clock[STEP] = np.where(crosses, short, wanted)
    clock[AFTER] = np.where(crosses, np.maximum(after, h), 0.0)
