"""One trial of an FMU in this process, and whether its reset forgets nothing.

Trials reset one instance. An FMU that forgets to reset a memory would answer by the
trials before. So some trials are simulated again in a new instance: if that differs in
any bit, each trial has a new instance from then on.
"""

from collections.abc import Mapping
from threading import Lock
from typing import Any

from tolstat.errors import ModelError
from tolstat.fmu.co_simulation import co_simulated
from tolstat.fmu.instance import DISCARD, FmuError, Instance, instance_of
from tolstat.fmu.model_exchange import model_exchanged
from tolstat.fmu.model_xml import Variable
from tolstat.fmu.trial_points import ERROR, REFUSED, Method, Points, Recorder
from tolstat.fmu.unpacked import forgets, note_forgetting

CHECKED = 8  # trials of a process after its first, and one of each EVERY
EVERY = 100
_turn = Lock()  # a process has one instance, which is of one thread at a time


def simulated(method: Method, values: Mapping[Variable, Any]) -> Points:
    """Return the trial with these values, as the FMU takes them."""
    with _turn:
        instance = instance_of(method.file, model_exchange=method.model_exchange)
        if instance.fresh:
            return _once(instance, method, values)
        if method.new_instances or forgets(method.file):
            instance.renew()
            return _once(instance, method, values)
        points = _once(instance, method, values)
        instance.trials += 1
        if instance.trials > CHECKED and instance.trials % EVERY:
            return points
        instance.renew()
        alone = _once(instance, method, values)
        if not _same(points, alone):
            if instance.trials > CHECKED:
                raise ModelError(
                    f"{method.file.path.name} forgets to reset what it remembers: a "
                    "trial depends on those before it; set new_instances = true in "
                    "[settings]"
                )
            note_forgetting(method.file)
        return alone


def _once(instance: Instance, method: Method, values: Mapping[Variable, Any]) -> Points:
    reader = instance.reader(method.watched)
    recorder = Recorder(reader, end_only=method.end_only)
    follow = model_exchanged if method.model_exchange else co_simulated
    try:
        instance.begin(method.start, method.stop, method.rtol, values)
        return follow(instance, recorder, method)
    except FmuError as error:
        word = REFUSED if error.status == DISCARD else ERROR
        return recorder.points(word, str(error))


def _same(first: Points, second: Points) -> bool:
    """Return whether two trials agree in each bit."""
    arrays = zip(first[:2], second[:2], strict=True)
    same = all(a.tobytes() == b.tobytes() for a, b in arrays)
    return same and first.failure == second.failure
