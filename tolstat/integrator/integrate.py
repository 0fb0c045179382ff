"""The integrator's face: equations and a block of trials in, their solution out."""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.integrator.problem import Accuracy, Block, Solution, System


def integrate(
    system: System,
    start: Array,
    parameters: Array,
    marks: Array,
    accuracy: Accuracy,
    *,
    watch_from: int = 0,
    samples: Array | None = None,
) -> Solution:
    """Integrate a block of trials.

    Parameters
    ----------
    system : System
        The equations.
    start : float64[trial, state]
        The states at the first mark.
    parameters : float64[trial, parameter]
        What the equations get as `p`.
    marks : float64[trial, mark]
        Ascending times, s: the start, every time at which the rates may jump or
        something is to be stored, the end. The step lands on each and restarts there.
    accuracy : Accuracy
        How well.
    watch_from : int
        The phase (number of the mark that begins it) from which peaks and times above
        zero are taken.
    samples : float64[sample], optional
        Ascending times, s, at which the states are stored, by dense output.

    Returns
    -------
    Solution
        By trial: states and quadratures at the marks, peaks, histories, status, steps.
        What a failed trial did not reach is NaN.
    """
    # the compiler is loaded, and compiles, when something is first integrated
    from tolstat.integrator.march import march
    from tolstat.integrator.workspace import (
        check_rows,
        idle_lanes,
        room_for_steps,
        unsolved,
    )

    block = Block(
        start=np.ascontiguousarray(start, float),
        parameters=np.ascontiguousarray(parameters, float),
        marks=np.ascontiguousarray(marks, float),
        samples=np.ascontiguousarray([] if samples is None else samples, float),
        watch_from=int(watch_from),
        accuracy=Accuracy(
            rtol=float(accuracy.rtol),
            max_step=float(accuracy.max_step),
            max_steps=int(accuracy.max_steps),
        ),
    )
    solution = unsolved(system, block)
    lanes = idle_lanes(block, solution)
    step = room_for_steps(system, lanes)
    check_rows(system, lanes, step)
    per_scale = 1.0 / np.ascontiguousarray(system.scale, float)
    watch = system.watch or system.rates
    march(system.rates, watch, per_scale, lanes, step, block, solution)
    return solution
