"""Co-simulation: the FMU integrates by itself, from one communication point to another.

What it does between two points tolstat cannot see. An explicit one may be wrong without
a word, so audits take a quarter of the step, or model exchange.
"""

import math

from tolstat.fmu.instance import Instance
from tolstat.fmu.trial_points import ENDED, Points, Recorder

ROUNDING = 1e-9  # of a number of steps


def steps_between(start: float, stop: float, longest: float) -> int:
    """Return the least number of equal steps that are not longer than `longest`, s."""
    return max(1, math.ceil((stop - start) / longest - ROUNDING))


def co_simulated(
    instance: Instance,
    recorder: Recorder,
    *,
    start: float,
    stop: float,
    longest: float,
    end_only: bool,
) -> Points:
    """Return a trial whose FMU is initialized.

    `end_only`: values are read at the stop time alone.
    """
    steps = steps_between(start, stop, longest)
    length = (stop - start) / steps
    if not end_only:
        recorder.note(start)
    for number in range(steps):
        ended = instance.step(start + number * length, length)
        last = number + 1 == steps
        if ended and not last:
            return recorder.points(ENDED)
        if last or not end_only:
            recorder.note(start + (number + 1) * length)
    return recorder.points()
