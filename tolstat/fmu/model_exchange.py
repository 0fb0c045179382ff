"""Model exchange: CVode, of SUNDIALS in FMPy, integrates the rates of the FMU.

It takes single accepted steps. After each the FMU is told, as FMI demands: what it
remembers itself, such as peaks or delays, is wrong otherwise. Events are located by the
sign of indicators, end a step, and start the solver again.
"""

import ctypes
import math
from collections.abc import Callable
from ctypes import byref
from typing import Any

from tolstat.errors import ModelError
from tolstat.fmu.instance import DISCARD, FmuError, Instance
from tolstat.fmu.trial_points import ENDED, SOLVER, Method, Points, Recorder

MOST_STEPS = 2_000_000  # of a trial
CV_ONE_STEP, CV_ROOT_RETURN = 2, 2  # of CVODE's header; FMPy lacks the first
MOST_SHORT = 100  # steps without an advance, one after the other
END = 1e-12  # of the duration: closer to an end than this is at the end


def cvode_modules() -> tuple[Any, Any, Any]:
    """Return SUNDIALS, CVode and its library; ModelError without them."""
    try:
        from fmpy import sundials
        from fmpy.sundials import cvode
        from fmpy.sundials.libraries import sundials_cvode
    except (ImportError, OSError) as error:
        raise ModelError(
            "model exchange needs CVode of FMPy, which this computer lacks "
            f"({error}); use co-simulation"
        ) from None
    return sundials, cvode, sundials_cvode


class ConstantInputs:
    """Inputs that stay as they are set."""

    def apply(self, time: float) -> None:
        """Change nothing at a time."""


class Solver:
    """CVode for one FMU in one process; each trial restarts it, as its memory leaks."""

    def __init__(self, instance: Instance) -> None:
        sundials, cvode, sundials_cvode = cvode_modules()
        self._failure: FmuError | None = None
        self._cvode, self._sundials = cvode, sundials
        self._set_stop = sundials_cvode.CVodeSetStopTime
        self._set_stop.argtypes = [ctypes.c_void_p, ctypes.c_double]
        self._instance = instance
        states, indicators = instance.sizes()
        two = instance.file.fmi == 2
        rates = "getDerivatives" if two else "getContinuousStateDerivatives"
        heard, fmu = self._heard, instance.fmu

        class Guarded(sundials.CVodeSolver):  # type: ignore[misc, name-defined]
            """A solver that hears an FMU refuse: Python drops what callbacks raise."""

            def f(self, *arguments: Any) -> int:
                return heard(super().f, arguments)

            def g(self, *arguments: Any) -> int:
                return heard(super().g, arguments)

        self._solver = Guarded(
            nx=states,
            nz=indicators,
            get_x=fmu.getContinuousStates,
            set_x=fmu.setContinuousStates,
            get_dx=getattr(fmu, rates),
            get_z=fmu.getEventIndicators,
            get_nominals=fmu.getNominalsOfContinuousStates,
            set_time=fmu.setTime,
            input=ConstantInputs(),
            startTime=0.0,
        )

    def _heard(self, rates: Callable[..., int], arguments: tuple[Any, ...]) -> int:
        """Return what CVode expects of a callback: above 0 for a shorter step."""
        try:
            return rates(*arguments)
        except self._instance.refusal as error:
            self._failure = self._instance.refused(error)
            return 1 if self._failure.status == DISCARD else -1

    def aim(self, rtol: float, longest: float) -> None:
        """Set the tolerance and the longest step, s, of the next trial."""
        self._solver.reltol = rtol
        self._rtol = rtol
        self._cvode.CVodeSetMaxStep(self._solver.cvode_mem, longest)

    def restart(self, time: float, stop: float) -> None:
        """Begin at the states of the FMU; no step passes `stop`, s."""
        solver, memory = self._solver, self._solver.cvode_mem
        self._failure = None
        try:
            solver.reset(time)
        except self._instance.refusal as error:
            raise self._instance.refused(error) from None
        self._cvode.CVodeSVtolerances(memory, self._rtol, solver.abstol)
        self._set_stop(memory, stop)

    def refuse(self) -> None:
        """Raise what the FMU last refused since the restart, if it did."""
        if self._failure is not None:
            raise self._failure

    def advance(self, stop: float) -> tuple[float, bool]:
        """Take one accepted step; return its end, s, and whether an event lies there.

        Raises
        ------
        FmuError
            If the FMU fails.
        SolverError
            If the solver does.
        """
        solver, reached = self._solver, self._sundials.realtype(0.0)
        flag = self._cvode.CVode(
            solver.cvode_mem, stop, solver.x, byref(reached), CV_ONE_STEP
        )
        if flag < 0:
            self.refuse()
            raise SolverError(f"CVode ends with {flag}: {solver.error_info}")
        self._instance.call("setTime", reached.value)
        if not solver.discrete:
            self._instance.call("setContinuousStates", solver.px, solver.nx)
        return reached.value, flag == CV_ROOT_RETURN


class SolverError(Exception):
    """CVode does not reach the next point."""


def model_exchanged(instance: Instance, recorder: Recorder, method: Method) -> Points:
    """Return a trial whose FMU is initialized."""
    start, stop = method.start, method.stop
    end = stop - END * (stop - start)
    event = instance.update()
    if event.ends:
        return recorder.points(ENDED)
    instance.call("enterContinuousTimeMode")
    solver = instance.solver = instance.solver or Solver(instance)
    solver.aim(method.rtol, method.longest)
    solver.restart(start, min(stop, event.next_time))
    recorder.note(start)
    time, short = start, 0
    for _ in range(MOST_STEPS):
        before = time
        try:
            time, located = solver.advance(stop)
        except SolverError as error:
            return recorder.points(SOLVER, str(error))
        short = short + 1 if time - before < stop - end else 0
        if short > MOST_SHORT:  # CVode would continue for ever
            solver.refuse()
            return recorder.points(SOLVER, f"steps become too short at {time:.17g} s")
        requested, ends = instance.call("completedIntegratorStep")
        recorder.note(time)
        if located or requested or time >= event.next_time:
            instance.call("enterEventMode")
            event = instance.update()
            ends = ends or event.ends
            if not ends:
                instance.call("enterContinuousTimeMode")
                after = event.next_time if event.next_time > time else math.inf
                event = event._replace(next_time=after)
                if time < end:
                    solver.restart(time, min(stop, after))
                recorder.note(time)
        if time >= end:
            return recorder.finished(time)
        if ends:
            return recorder.points(ENDED)
    return recorder.points(SOLVER, f"more than {MOST_STEPS} steps")
