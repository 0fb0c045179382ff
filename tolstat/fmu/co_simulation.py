"""Co-simulation: the FMU integrates by itself, from one communication point to another.

What it does between two points tolstat cannot see. An explicit one may be wrong without
a word, so audits take a quarter of the step, or model exchange.
"""

import math

from tolstat.fmu.instance import Instance
from tolstat.fmu.trial_points import ENDED, Method, Points, Recorder

ROUNDING = 1e-9  # of a number of steps


def steps_between(start: float, stop: float, longest: float) -> int:
    """Return the least number of equal steps that are not longer than `longest`, s."""
    return max(1, math.ceil((stop - start) / longest - ROUNDING))


def co_simulated(instance: Instance, recorder: Recorder, method: Method) -> Points:
    """Return a trial whose FMU is initialized."""
    start, stop = method.start, method.stop
    steps = steps_between(start, stop, method.longest)
    length, time = (stop - start) / steps, start
    recorder.note(start)
    for number in range(1, steps + 1):
        ended = instance.step(time, length)
        if ended and number < steps:
            return recorder.points(ENDED)
        time = start + number * length
        recorder.note(time)
    return recorder.finished(time)
