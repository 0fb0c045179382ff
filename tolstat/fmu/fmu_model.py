"""A model that others wrote: an FMU. Worker processes load it and run its trials."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from tolstat.arrays import Array, Integers, Truths
from tolstat.errors import ModelError, UnitError, allowed_names
from tolstat.fmu.fmu_settings import method_settings, settings_class, start_of
from tolstat.fmu.fmu_trial import simulated
from tolstat.fmu.instance import fmpy_modules
from tolstat.fmu.model_exchange import cvode_modules
from tolstat.fmu.model_xml import FmuFile, read_fmu
from tolstat.fmu.parameters import quantities, typed_name, unit_of
from tolstat.fmu.prepared import Prepared
from tolstat.fmu.taken import Reduction, Taken
from tolstat.fmu.trial_points import FAILURES, OUTSIDE, Method
from tolstat.fmu.unpacked import forgets, unpacked
from tolstat.lanes.digest import digest
from tolstat.model.checked import RESERVED
from tolstat.model.contract import History, Model, Outcome
from tolstat.model.description import Description
from tolstat.model.settings import column, setting
from tolstat.model.view import Axis, Chart, Curve

FINEST = 200_000  # steps of an audit
LEAST_RTOL, TIGHTER = 1e-12, 100.0
RESPONSES = "responses"
FORGETS = (
    "The FMU forgets to reset what it remembers: a trial would depend on those before "
    "it. So each trial has a new instance."
)


class FmuModel(Model):
    """An FMU of FMI 2.0 or 3.0, by co-simulation or model exchange.

    Contributors are its real parameters and inputs with a start value; responses are
    taken of its outputs, as [responses] of a study says.

    Parameters
    ----------
    path : Path
        Its file.

    Raises
    ------
    ModelError
        If it is no FMU that tolstat can run.
    """

    failures = FAILURES
    isolated = True  # its library may crash, hang or print
    row_by_row = True

    def __init__(self, path: Path) -> None:
        self.file = file = read_fmu(path)
        vars(self).update(name=file.name, title=file.title or f"FMU {path.name}")
        fields = method_settings(file)
        self._settable, self._outputs = quantities(
            file, {*RESERVED, *fields, RESPONSES}
        )
        table = {
            name: {"taken": f"end {output.variable.name}"}
            for name, output in self._outputs.items()
        }
        words = (
            "what each takes of an output: end, max, min, peak (magnitude), mean, "
            'integral, such as "max force"; or "time force above 20 N"'
        )
        fields[RESPONSES] = setting(
            table,
            words,
            columns={"taken": column("what is taken of an output", like="")},
        )
        fields |= {name: x.setting() for name, x in self._settable.items()}
        vars(self).update(settings=settings_class(self, file, fields))
        self._contributors = {
            n: x for n, x in self._settable.items() if x.variable.real
        }
        self._variables = {v.name: v for v in file.variables if v.numeric}
        self._last: tuple[Any, Prepared] | None = None  # settings, as they were
        vars(self).update(assumptions=_assumptions(file))

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how other processes make it, from its file."""
        return FmuModel, (self.file.path.resolve(),)

    @property
    def integrates(self) -> bool:
        """Whether tolstat's integrator solves it: others do."""
        return False

    @property
    def source_digest(self) -> str:
        """The digest of the FMU, of FMPy, and of the code that runs them."""
        try:
            fmpy = version("fmpy")
        except PackageNotFoundError:
            fmpy = "not installed"
        return digest(super().source_digest, self.file.sha256, f"FMPy {fmpy}")

    def describe(self, settings: Any) -> Description:
        """Return parameters and inputs as contributors, and the responses."""
        return self._prepare(settings).description

    def impossible(self, deviations: Array, settings: Any) -> Mapping[str, Truths]:
        """Return which trials lie outside of min and max of the FMU."""
        least, most = self._prepare(settings).bounds
        sizes = self._prepare(settings).sizes + deviations
        outside = np.any((sizes < least) | (sizes > most), axis=1)
        return {OUTSIDE: np.asarray(outside, np.bool_)}

    def tightened(self, settings: Any) -> Any | None:
        """Return a quarter of the step and a tighter rtol, by model exchange if it can.

        Co-simulation may be wrong without a word; model exchange shares nothing with
        it.
        """
        span = settings.stop - start_of(self.file)
        return dataclasses.replace(
            settings,
            max_step=max(settings.max_step / 4, span / FINEST),
            rtol=max(settings.rtol / TIGHTER, LEAST_RTOL),
            model_exchange=bool(self.file.model_exchange),
        )

    def preload(self) -> None:
        """Import FMPy, and unpack the FMU; its library stays out of this process."""
        fmpy_modules()
        unpacked(self.file)
        if self.file.model_exchange:
            with suppress(ModelError):  # trials without it need no CVode
                cvode_modules()

    def notes(self) -> tuple[str, ...]:
        """Return whether it forgets to reset what it remembers."""
        return (FORGETS,) if forgets(self.file) else ()

    def evaluate(self, deviations: Array, settings: Any) -> Outcome:
        """Return the outcome of trials, one after the other."""
        prepared = self._prepare(settings)
        responses = np.full((len(deviations), len(prepared.reductions)), np.nan)
        failed = {word: np.zeros(len(deviations), np.bool_) for word in FAILURES}
        reasons = dict[int, str]()
        for number, row in enumerate(deviations):
            points = simulated(prepared.method, prepared.values(row))
            if points.failure:
                failed[points.failure][number] = True
                reasons[number] = points.reason
            else:
                responses[number] = prepared.responses(points)
        return Outcome(responses, failed=failed, output=reasons)

    def history(self, deviations: Array, settings: Any, step: float) -> History:
        """Return the outputs over time, and the variables of its responses."""
        prepared = self._prepare(settings)
        watched = prepared.method.watched
        more = [x.variable for x in self._outputs.values()]
        union = (*watched, *(v for v in more if v not in watched))
        method = dataclasses.replace(prepared.method, watched=union, end_only=False)
        points = simulated(method, prepared.values(deviations))
        failed = {points.failure: np.ones(1, np.bool_)} if points.failure else {}
        reasons = {0: points.reason} if points.failure else {}
        values = points.values.reshape(-1, len(union))
        response = np.full((1, len(prepared.reductions)), np.nan)
        if not points.failure:
            response[0] = prepared.responses(points)
        names = {x.variable: x.name for x in self._outputs.values()}
        for variable in watched:
            if variable not in names:
                names[variable] = typed_name(variable.name, names.values())
        chosen = _thinned(points.time, step)
        curves = []
        for variable, line in zip(union, values.T, strict=True):
            unit = unit_of(variable, self.file)
            curve = Curve(
                names[variable], unit.si, "",
                unit.named_in(variable.sentence or variable.name),
                unit.factor * line[chosen] + unit.offset, shown=unit.display,
            )  # fmt: skip
            curves.append(curve)
        chart = Chart(Axis("time", "s"), points.time[chosen], tuple(curves))
        return History(chart, Outcome(response, failed=failed, output=reasons))

    def _prepare(self, settings: Any) -> Prepared:
        """Return what is common to all trials of these settings."""
        if self._last is None or self._last[0] is not settings:
            self._last = settings, self._prepared(settings)
        return self._last[1]

    def _prepared(self, settings: Any) -> Prepared:
        file, parts = self.file, self._contributors
        reductions = tuple(
            self._reduction(name, row["taken"])
            for name, row in settings.responses.items()
        )
        if not reductions:
            error = self.fault(
                'it has no outputs; name variables in [responses], such as x = "end x"'
            )
            error.section = RESPONSES
            raise error
        watched = tuple(dict.fromkeys(x.variable for x in reductions))
        return Prepared(
            contributors=parts,
            sizes=np.array([getattr(settings, n) for n in parts], dtype=np.float64),
            constants={
                x.variable: x.to_fmu(value)
                for name, x in self._settable.items()
                if name not in parts and (value := getattr(settings, name)) != x.start
            },
            reductions=reductions,
            method=Method(
                file=file,
                model_exchange=settings.model_exchange,
                start=start_of(file),
                stop=settings.stop,
                longest=settings.max_step,
                rtol=settings.rtol,
                new_instances=settings.new_instances,
                watched=watched,
                end_only=all(x.taken.kind == "end" for x in reductions),
            ),
        )

    def _reduction(self, name: str, text: str) -> Reduction:
        """Return how a response of a study is made."""
        try:
            taken = Taken.read(text)
            variable = self._variables.get(taken.name)
            if variable is None and taken.name in self._outputs:
                variable = self._outputs[taken.name].variable
            if variable is None:
                names = [x.variable.name for x in self._outputs.values()]
                raise ModelError(
                    f"the FMU has no variable {taken.name}; "
                    f"{allowed_names(taken.name, names)}"
                )
            return Reduction.read(name, taken, variable, unit_of(variable, self.file))
        except (ModelError, UnitError) as error:
            wrong = ModelError(f"{name}: {error}")
            wrong.section = RESPONSES
            raise wrong from None


def _assumptions(file: FmuFile) -> tuple[str, ...]:
    """Return what the numbers of an FMU rest on."""
    tool = f", made by {file.tool}" if file.tool else ""
    return (
        f"{file.path.name} (FMI {file.fmi}{tool}) is as its makers say; tolstat knows "
        "its description alone.",
        "Inputs keep their values over the whole time.",
    )


def _thinned(time: Array, step: float) -> Integers:
    """Return which points are shown, about one every `step` s; the first and last are.

    An event has two points at one time.
    """
    if len(time) < 2:
        return np.arange(len(time))
    cells = np.floor((time - time[0]) / step)
    first = np.concatenate([[True], np.diff(cells) > 0])
    first[-1] = True
    return np.flatnonzero(first)
