"""One trial of an FMU in this process, and whether its reset forgets nothing.

Trials reset one instance. An FMU that forgets to reset a memory would answer by the
trials before. So some trials are simulated again in a new instance: if that differs in
any bit, each trial has a new instance from then on.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from threading import Lock
from typing import Any

from tolstat.errors import ModelError
from tolstat.fmu.co_simulation import co_simulated
from tolstat.fmu.instance import DISCARD, FmuError, Instance, instance_of
from tolstat.fmu.model_exchange import model_exchanged
from tolstat.fmu.model_xml import FmuFile, Variable
from tolstat.fmu.trial_points import ERROR, REFUSED, Points, Recorder
from tolstat.fmu.unpacked import forgets, note_forgetting

CHECKED = 8  # trials of a process after its first, and one of each EVERY
EVERY = 100
_turn = Lock()  # a process has one instance, which is of one thread at a time


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

    def simulated(self, values: Mapping[Variable, Any]) -> Points:
        """Return the trial with these values, as the FMU takes them."""
        with _turn:
            return self._simulated(values)

    def _simulated(self, values: Mapping[Variable, Any]) -> Points:
        instance = instance_of(self.file, model_exchange=self.model_exchange)
        if instance.fresh:
            return self._once(instance, values)
        if self.new_instances or forgets(self.file):
            instance.renew()
            return self._once(instance, values)
        points = self._once(instance, values)
        instance.trials += 1
        if instance.trials > CHECKED and instance.trials % EVERY:
            return points
        instance.renew()
        alone = self._once(instance, values)
        if not _same(points, alone):
            if instance.trials > CHECKED:
                raise ModelError(
                    f"{self.file.path.name} forgets to reset what it remembers: a "
                    "trial depends on those before it; set new_instances = true in "
                    "[settings]"
                )
            note_forgetting(self.file)
        return alone

    def _once(self, instance: Instance, values: Mapping[Variable, Any]) -> Points:
        recorder = Recorder(instance.reader(self.watched))
        try:
            instance.begin(self.start, self.stop, self.rtol, values)
            if self.model_exchange:
                return model_exchanged(
                    instance, recorder, start=self.start, stop=self.stop,
                    rtol=self.rtol, longest=self.longest, end_only=self.end_only,
                )  # fmt: skip
            return co_simulated(
                instance, recorder, start=self.start, stop=self.stop,
                longest=self.longest, end_only=self.end_only,
            )  # fmt: skip
        except FmuError as error:
            word = REFUSED if error.status == DISCARD else ERROR
            return recorder.points(word, str(error))


def _same(first: Points, second: Points) -> bool:
    """Return whether two trials agree in each bit."""
    arrays = zip(first[:2], second[:2], strict=True)
    same = all(a.tobytes() == b.tobytes() for a, b in arrays)
    return same and first.failure == second.failure
