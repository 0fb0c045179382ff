"""One trial of an FMU: the values of its variables over time, or why there are none."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array


class Points(NamedTuple):
    """A simulated trial."""

    time: Array  # float64[point], s
    values: Array  # float64[point, variable], as the FMU has them
    failure: str = ""  # a word of `FAILURES`; empty if it reached the stop time
    reason: str = ""  # of a failure: the last message of the FMU or the solver


# why a trial of an FMU may have no answer, and what has to hold
ENDED, REFUSED, ERROR = "ended early", "step refused", "FMU error"
OUTSIDE, SOLVER = "outside its range", "solver failed"
FAILURES = {
    OUTSIDE: "parameters and inputs lie between min and max of the FMU",
    ENDED: "the FMU simulates until the stop time",
    REFUSED: "the FMU takes each step",
    ERROR: "the FMU reports no error",
    SOLVER: "CVode reaches the stop time",
}


class Recorder:
    """Collects the values of variables, point by point."""

    def __init__(self, read: Callable[[], list[float]]) -> None:
        self._read = read
        self._time: list[float] = []
        self._values: list[list[float]] = []

    def note(self, time: float) -> None:
        """Note the values at a time, s."""
        self._time.append(time)
        self._values.append(self._read())

    def points(self, failure: str = "", reason: str = "") -> Points:
        """Return all points."""
        values = np.array(self._values, dtype=np.float64)
        return Points(np.array(self._time), values, failure, reason)
