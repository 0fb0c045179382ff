"""One trial of an FMU: the values of its variables over time, or why there are none."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.fmu.model_xml import FmuFile, Variable


@dataclass(frozen=True, kw_only=True)
class Method:
    """How trials of an FMU are simulated."""

    file: FmuFile
    model_exchange: bool
    start: float  # s
    stop: float
    longest: float  # step, s
    rtol: float
    new_instances: bool  # for each trial
    watched: tuple[Variable, ...]  # whose values are noted
    end_only: bool  # whether only those at the stop time are


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
    """Collects the values of variables, point by point, or at the stop time alone."""

    def __init__(self, read: Callable[[], list[float]], *, end_only: bool) -> None:
        self._read, self._end_only = read, end_only
        self._time: list[float] = []
        self._values: list[list[float]] = []

    def note(self, time: float) -> None:
        """Note the values at a time, s."""
        if not self._end_only:
            self._take(time)

    def _take(self, time: float) -> None:
        self._time.append(time)
        self._values.append(self._read())

    def finished(self, time: float) -> Points:
        """Return all points of a trial that is at the stop time, s."""
        if self._end_only:
            self._take(time)
        return self.points()

    def points(self, failure: str = "", reason: str = "") -> Points:
        """Return all points."""
        values = np.array(self._values, dtype=np.float64)
        return Points(np.array(self._time), values, failure, reason)
