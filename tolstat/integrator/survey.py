"""Survey of steps: whether rates agree with the slope of the dense output in them.

A step sees the rates at its stages alone. What begins and ends between them is missed,
and no error estimate tells. So the rates are compared at one more place inside each
accepted step, which follows from the numbers of the trial and of the step.
"""

import numpy as np

from tolstat.integrator import problem
from tolstat.integrator.step import DENSE, inside
from tolstat.lanes.compiled import compiled
from tolstat.lanes.vector import WIDTH

# the places of one trial, and of trials at one step, lie evenly from 0 to 1
BY_STEP, BY_TRIAL = 0.6180339887498949, 0.7548776662466927


@compiled(within=True)
def _slope_weight(stage, theta):
    """Return the weight of a stage, from 0, for the slope at a fraction of the step."""
    D = DENSE[stage]
    return D[0] + theta * (2.0 * D[1] + theta * (3.0 * D[2] + theta * (4.0 * D[3])))


@compiled()
def survey(rates, t, h, lanes, step, results):
    """Store residuals and sizes of states and quadratures, the largest of each trial.

    Parameters
    ----------
    rates
        See `problem.System`.
    t, h : vector
        Start of the step and its length, s.
    lanes, step : Lanes, Step
        Before they move to the end of the step, with the lanes whose step is
        accepted; its middle is overwritten.
    results : Results
        Filled: h times the difference of rate and slope, its time, the size.
    """
    clock, moment, k, residuals = lanes.clock, step.moment, step.k, step.surveyed
    n, last = len(lanes.y), len(step.surveyed) - 1
    theta = BY_STEP * clock[problem.COUNT] + BY_TRIAL * clock[problem.TRIAL]
    theta = theta - np.floor(theta)
    inside(h, theta, lanes.y, k, step.middle)
    moment[problem.TIME] = residuals[last] = t + theta * h
    rates(moment, step.middle, lanes.p, residuals)
    for i in range(n + len(lanes.quadratures)):
        slope = 0.0 * h
        for stage in range(7):
            slope = slope + _slope_weight(stage, theta) * k[stage][i]
        residuals[i] = np.abs(residuals[i] - slope) * h
    for lane in range(WIDTH):
        if clock[problem.ACCEPTED, lane] == 0.0:
            continue
        trial = int(clock[problem.TRIAL, lane])
        for i in range(n + len(lanes.quadratures)):
            if i < n:
                ends = max(abs(lanes.y[i, lane]), abs(step.end[i, lane]))
                size = max(ends, abs(step.middle[i, lane]))
            else:
                size = abs(lanes.quadratures[i - n, lane])
            if size > results.survey[trial, i, problem.SIZE]:
                results.survey[trial, i, problem.SIZE] = size
            if residuals[i, lane] > results.survey[trial, i, problem.RESIDUAL]:
                results.survey[trial, i, problem.RESIDUAL] = residuals[i, lane]
                results.survey[trial, i, problem.PLACE] = residuals[last, lane]
