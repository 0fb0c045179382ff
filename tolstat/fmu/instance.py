"""One instance of an FMU: its library, loaded by FMPy, with one face for FMI 2 and 3.

A library changes its process: it may crash, print, or set how floats are rounded. So
only worker processes load one, and one at a time.
"""

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from ctypes import byref
from typing import Any, NamedTuple

from tolstat.errors import ModelError
from tolstat.fmu.model_xml import FmuFile, Variable
from tolstat.fmu.unpacked import unpacked

FATAL = 4
DISCARD = 2
TERMINATED = 3  # fmi2Terminated, of fmi2GetBooleanStatus
EXIT_CODE = 70  # of a process whose FMU reports a fatal error
NEEDED = "pip install tolstat[fmu]"


def fmpy_modules() -> tuple[Any, Any, Any]:
    """Return the modules of FMPy; ModelError without it."""
    try:
        from fmpy import fmi1, fmi2, fmi3
    except ImportError:
        raise ModelError(f"FMUs need FMPy: {NEEDED}") from None
    return fmi1, fmi2, fmi3


class FmuError(Exception):
    """A call that an FMU answers with discard or error; its last message."""

    def __init__(self, function: str, status: int, message: str) -> None:
        super().__init__(f"{function}: {message or 'no message'}")
        self.status = status


class Event(NamedTuple):
    """What an event leaves."""

    ends: bool  # whether the FMU ends the simulation
    next_time: float  # of the next event that is known, s; infinite without


class Instance:
    """An instance of an FMU in this process."""

    def __init__(self, file: FmuFile, *, model_exchange: bool) -> None:
        self.file = file
        self.model_exchange = model_exchange
        self._message = ""
        self.solver: Any = None  # of model exchange
        self.trials = 0  # that followed a reset
        fmi1, fmi2, fmi3 = fmpy_modules()
        self.refusal: type[Exception] = fmi1.FMICallException
        if file.fmi == 2:
            kind = fmi2.FMU2Model if model_exchange else fmi2.FMU2Slave
        else:
            kind = fmi3.FMU3Model if model_exchange else fmi3.FMU3Slave
        identifier = file.model_exchange if model_exchange else file.co_simulation
        try:
            self.fmu = kind(
                guid=file.token,
                unzipDirectory=str(unpacked(file)),
                modelIdentifier=identifier,
                instanceName=identifier,
            )
        except AttributeError as error:  # undefined symbol
            tool = f" ({file.tool})" if file.tool else ""
            raise ModelError(
                f"{file.path.name} does not export a function of FMI {file.fmi}: "
                f"{str(error).rpartition(':')[2].strip()}{tool}"
            ) from None
        except Exception as error:  # FMPy has no class for it
            raise ModelError(f"{file.path.name}: {error}") from None
        self._instantiate = self._how_to_instantiate()
        self.renew(free=False)
        self.fresh = True  # whether no trial has run in it

    def renew(self, *, free: bool = True) -> None:
        """Make a new instance of the same library."""
        if free:
            self.free()
        try:
            self._instantiate()
        except Exception as error:
            raise ModelError(
                f"{self.file.path.name} cannot be instantiated: "
                f"{self._message or error}"
            ) from None
        self.fresh = True

    def free(self) -> None:
        """Free the instance; its library stays loaded, as unloading may crash."""
        name = f"fmi{self.file.fmi}FreeInstance"
        getattr(self.fmu, name)(self.fmu.component)

    def _how_to_instantiate(self) -> Callable[[], None]:
        if self.file.fmi == 3:

            def note(_: Any, status: int, category: bytes, message: bytes) -> None:
                self._note(message)

            return lambda: self.fmu.instantiate(logMessage=note)
        from fmpy import calloc, fmi2, free

        def note_2(*arguments: Any) -> None:
            self._note(arguments[-1])

        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(note_2)
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
        try:  # formats messages, which Python cannot
            from fmpy.logging import addLoggerProxy

            addLoggerProxy(byref(callbacks))
        except Exception:
            pass
        return lambda: self.fmu.instantiate(callbacks=callbacks)

    def _note(self, message: bytes | None) -> None:
        text = (message or b"").decode("utf-8", "replace")
        self._message = " ".join(text.split())

    def call(self, function: str, *arguments: Any) -> Any:
        """Return what a function of FMPy returns; raise FmuError if the FMU refuses.

        After a fatal error no instance of the process may be touched: it ends.
        """
        try:
            return getattr(self.fmu, function)(*arguments)
        except self.refusal as error:
            raise self.refused(error) from None

    def refused(self, error: Any) -> FmuError:
        """Return what FMPy raised as ours; end the process after a fatal error."""
        if error.status == FATAL:
            print(f"fatal error in {error.function}: {self._message}", flush=True)
            sys.stderr.flush()
            os._exit(EXIT_CODE)
        return FmuError(error.function, error.status, self._message)

    def begin(
        self, start: float, stop: float, rtol: float, values: Mapping[Variable, Any]
    ) -> None:
        """Reset the FMU, set values and initialize it."""
        self._message = ""
        if not self.fresh:
            self.call("reset")
        self.fresh = False
        if self.file.fmi == 2:
            self.call("setupExperiment", rtol, start, stop)
        parameters = {v: x for v, x in values.items() if v.causality != "input"}
        inputs = {v: x for v, x in values.items() if v.causality == "input"}
        self._set(parameters)
        if self.file.fmi == 2:
            self.call("enterInitializationMode")
        else:
            self.call("enterInitializationMode", rtol, start, stop)
        self._set(inputs)
        self.call("exitInitializationMode")

    def _set(self, values: Mapping[Variable, Any]) -> None:
        """Set values, those of one type in one call."""
        by_setter: dict[str, dict[int, Any]] = {}
        for variable, value in values.items():
            setter = f"set{self._accessor(variable)}"
            by_setter.setdefault(setter, {})[variable.reference] = value
        for setter, chosen in by_setter.items():
            self.call(setter, [*chosen], [*chosen.values()])

    def _accessor(self, variable: Variable) -> str:
        """Return the name under which FMPy reads and sets such a variable."""
        if variable.type == "Enumeration":
            return "Integer" if self.file.fmi == 2 else "Int64"
        return variable.type

    def reader(self, variables: Sequence[Variable]) -> Callable[[], list[float]]:
        """Return what reads the values of variables, as numbers."""
        groups: dict[str, dict[int, int]] = {}  # by getter: position and reference
        for position, variable in enumerate(variables):
            group = groups.setdefault(f"get{self._accessor(variable)}", {})
            group[position] = variable.reference

        def read() -> list[float]:
            values = dict[int, float]()
            for getter, group in groups.items():
                numbers = self.call(getter, [*group.values()])
                values |= zip(group, map(float, numbers), strict=True)
            return [values[position] for position in range(len(variables))]

        return read

    def step(self, time: float, length: float) -> bool:
        """Let co-simulation advance; return whether the FMU has ended by itself.

        Raises
        ------
        FmuError
            If it refuses the step, or fails.
        """
        if self.file.fmi == 3:
            _, ends, early, _ = self.call("doStep", time, length)
            if early and not ends:
                raise FmuError("fmi3DoStep", DISCARD, "it returns before the step ends")
            return bool(ends)
        try:
            self.call("doStep", time, length)
        except FmuError as error:
            if error.status == DISCARD and self._terminated():
                return True
            raise
        return False

    def _terminated(self) -> bool:
        try:
            return bool(self.call("getBooleanStatus", TERMINATED))
        except FmuError:
            return False

    def sizes(self) -> tuple[int, int]:
        """Return the numbers of states and of event indicators of model exchange."""
        if self.file.fmi == 2:
            return self.file.states, self.file.indicators
        states = self.call("getNumberOfContinuousStates")
        return states, self.call("getNumberOfEventIndicators")

    def update(self) -> Event:
        """Let an event of model exchange settle."""
        function = "newDiscreteStates" if self.file.fmi == 2 else "updateDiscreteStates"
        while True:
            more, ends, _, _, scheduled, time = self.call(function)
            if ends or not more:
                return Event(bool(ends), float(time) if scheduled else float("inf"))


_present: list[Instance] = []  # of this process: at most one


def instance_of(file: FmuFile, *, model_exchange: bool) -> Instance:
    """Return the instance of this process; another one is freed first."""
    for instance in _present:
        same = instance.file.sha256 == file.sha256
        if same and instance.model_exchange == model_exchange:
            return instance
        instance.free()
    _present.clear()
    _present.append(Instance(file, model_exchange=model_exchange))
    return _present[0]
