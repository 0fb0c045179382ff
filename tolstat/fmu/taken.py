"""What a response takes of an output over the time: "max force", "mean speed", ...

Each internal point counts: communication points of co-simulation; each accepted step
of model exchange, and both sides of an event.
"""

import re
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError, allowed_names
from tolstat.fmu.base_units import FmuUnit
from tolstat.fmu.model_xml import Variable
from tolstat.model.description import Response
from tolstat.units.conversion import dimension, si_unit
from tolstat.units.grammar import quantity

KINDS = {
    "end": "at the end",
    "max": "largest value of",
    "min": "least value of",
    "peak": "largest magnitude of",
    "mean": "mean over time of",
    "integral": "integral over time of",
    "time": "time of",
}
EXAMPLES = '"end force", "max force", "time force above 20 N"'
_SIDES = re.compile(r"(?P<name>.+?)\s+(?P<side>above|below)\s+(?P<level>.+)")


class Taken(NamedTuple):
    """What a response takes of one variable."""

    kind: str  # one of KINDS
    name: str  # of the variable
    side: str = ""  # "above" or "below" of a time
    level: str = ""  # with its unit

    @classmethod
    def read(cls, text: str) -> "Taken":
        """Return what a text of a study asks for.

        Raises
        ------
        ModelError
            If it cannot be read.
        """
        kind, _, name = text.strip().partition(" ")
        name = name.strip()
        if kind not in KINDS or not name:
            raise ModelError(
                f"'{text}': {allowed_names(kind, KINDS)}; then the name of an output, "
                f"such as {EXAMPLES}"
            )
        if kind != "time":
            return cls(kind, name)
        parts = _SIDES.fullmatch(name)
        if parts is None:
            raise ModelError(f"'{text}': such as \"time force above 20 N\"")
        return cls(kind, parts["name"], parts["side"], parts["level"])


class Reduction(NamedTuple):
    """How a response is made of the values of a variable."""

    name: str
    taken: Taken
    variable: Variable
    unit: FmuUnit  # of the variable
    si: str  # unit of the response
    level: float  # SI, of a time above or below

    @classmethod
    def read(
        cls, name: str, taken: Taken, variable: Variable, unit: FmuUnit
    ) -> "Reduction":
        """Return how a response is made; a UnitError if its unit or level is wrong."""
        si, level = unit.si, 0.0
        if taken.kind == "time":
            si, level = "s", quantity(taken.level, unit.si)
        elif taken.kind == "integral":
            si = si_unit(dimension(unit.si) * dimension("s"))
        return cls(name, taken, variable, unit, si, level)

    def value(self, time: Array, values: Array) -> float:
        """Return the response, SI, of values as the FMU has them."""
        si = self.unit.factor * values + self.unit.offset
        return take(self.taken.kind, self.taken.side, self.level, time, si)

    @property
    def response(self) -> Response:
        """The response, as a model declares it."""
        kind, source = self.taken.kind, self.variable.sentence or self.variable.name
        source = self.unit.named_in(source)
        words = f"{KINDS[kind]} {source}" if kind != "end" else f"{source} at the end"
        if kind == "time":
            words = f"time of {source} {self.taken.side} {self.taken.level}"
        timed = kind in ("time", "integral")
        display = "" if timed else self.unit.display
        return Response(self.name, self.si, sentence=words, shown=display)


def take(kind: str, side: str, level: float, time: Array, values: Array) -> float:
    """Return what is taken of the values float64[point] at these times, s."""
    if kind == "end":
        return float(values[-1])
    if kind == "max":
        return float(values.max())
    if kind == "min":
        return float(values.min())
    if kind == "peak":
        return float(np.abs(values).max())
    lengths = np.diff(time)
    if kind == "time":
        return _time_above(values - level if side == "above" else level - values, time)
    integral = float(np.sum(lengths * (values[1:] + values[:-1]) / 2))
    return integral if kind == "integral" else integral / float(time[-1] - time[0])


def _time_above(excess: Array, time: Array) -> float:
    """Return how long an excess is above zero; it is a line between two points."""
    before, after = excess[:-1], excess[1:]
    width = np.where(before == after, 1.0, np.abs(after - before))
    crossing = np.maximum(before, after) / width
    share = np.where((before > 0) & (after > 0), 1.0, np.clip(crossing, 0.0, 1.0)) * (
        np.maximum(before, after) > 0
    )
    return float(np.sum(share * np.diff(time)))
