"""A model that moves, as its equations: the face for authors."""

from __future__ import annotations

import dataclasses
import inspect
import re
import threading
from collections.abc import Callable, Mapping
from functools import cache, cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.integrator.integrate import integrate
from tolstat.integrator.problem import Accuracy, Solution, System
from tolstat.lanes.digest import digest
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Contributor, Description
from tolstat.model.description import Response as Described
from tolstat.model.settings import setting
from tolstat.model.view import Axis, Chart, Curve
from tolstat.moving.declarations import Letters, Part, Response, State
from tolstat.moving.equations import KEPT, Equations
from tolstat.moving.marks import marks_of, phase_values
from tolstat.moving.sizes import sizes_of

STEPS = 50  # at least, in a trial
_lock = threading.Lock()


class Motion(Model):
    """A model whose equations of motion are plain NumPy.

    A subclass declares states, parts, responses and how long a trial `lasts`, s, and
    has `motion`. It is called when the class is made, with numbers that record
    what is done to them: what switches by time becomes marks, what switches by a state
    becomes crossings.
    """

    lasts: ClassVar[Any]  # s, or a `tolstat.setting` in s
    states: ClassVar[Mapping[str, State]]
    parts: ClassVar[Mapping[str, Part]]
    responses: ClassVar[Mapping[str, Response]]
    equations: ClassVar[Equations]

    def motion(self, t: Any, y: Any, p: Any) -> Mapping[str, Any]:
        """Return the rate of each state and the quantity of each response, by name.

        Parameters
        ----------
        t : number
            Time, s.
        y, p : names
            States, and parts and settings: y.x, p.m.
        """
        raise NotImplementedError

    def __init_subclass__(cls, **options: Any) -> None:
        """Trace the equations of a class that has some."""
        super().__init_subclass__(**options)
        declared = {k: v for kind in cls.__mro__[::-1] for k, v in vars(kind).items()}

        def declared_as(kind: type) -> dict[str, Any]:
            return {k: v for k, v in declared.items() if isinstance(v, kind)}

        cls.states, cls.parts, cls.responses = map(declared_as, (State, Part, Response))
        if cls.motion is Motion.motion:
            return
        words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()
        cls.name = vars(cls).get("name", words)
        cls.title = vars(cls).get("title", (cls.__doc__ or cls.name).split("\n")[0])
        fields = {k: v for k, v in declared.items() if isinstance(v, dataclasses.Field)}
        cls.settings = _settings(cls, fields)
        units = {
            name: getattr(field.metadata["kind"], "unit", "") or "1"
            for name, field in fields.items()
            if isinstance(field.default, float)
        }
        try:
            _check(cls)
            units |= {name: part.unit for name, part in cls.parts.items()}
            cls.equations = Equations(
                _unchanged(cls()), cls.states, units, cls.responses
            )
        except ModelError as error:
            raise ModelError(f"{cls.__name__}: {error}") from error

    @property
    def source_digest(self) -> str:
        """The digest of the code and of the equations with their tables."""
        return digest(super().source_digest, self.equations.identity)

    def describe(self, settings: Any) -> Description:
        """Return parts and responses."""
        return Description(
            tuple(
                Contributor(
                    name,
                    x.unit,
                    name,
                    x.sentence,
                    size=x.nominal or None,
                    shown=x.shown,
                )
                for name, x in self.parts.items()
            ),
            tuple(
                Described(name, x.unit, name, x.sentence, shown=x.shown)
                for name, x in self.responses.items()
            ),
        )

    def evaluate(self, deviations: Array, settings: Any) -> Outcome:
        """Return the responses of trials."""
        solution, values, marks = self._solved(deviations, settings)
        return self._outcome(solution, values, marks)

    def history(self, deviations: Array, settings: Any, step: float) -> History:
        """Return states and quantities of responses over time."""
        values = self._values(deviations[None, :], settings)
        (end,) = np.ravel(self._duration(values))
        times = sample_times(float(end), step)
        solution, values, marks = self._solved(deviations[None, :], settings, times)
        motion = dict(zip(self.equations.states, solution.history[0].T, strict=True))
        by_name = self._quantities(times, motion, values)
        curves = [
            Curve(name, x.unit, name, x.sentence, motion[name])
            for name, x in self.states.items()
            if name not in self.responses
        ]
        for name, x in self.responses.items():
            if x.kind not in ("integral", "above"):
                curve = np.broadcast_to(by_name[name], (1, len(times)))[0]
                curves.append(
                    Curve(name, x.unit, name, x.sentence, curve, shown=x.shown)
                )
        chart = Chart(Axis("time", "s"), times, tuple(curves))
        return History(chart, self._outcome(solution, values, marks))

    def _values(self, deviations: Array, settings: Any) -> dict[str, Array]:
        """Return parts and settings by name, float64[trial, 1]."""
        columns = deviations.T[:, :, None]
        values = {
            name: part.nominal + column
            for (name, part), column in zip(self.parts.items(), columns, strict=True)
        }
        for field in dataclasses.fields(settings):
            if isinstance(value := getattr(settings, field.name), float):
                values[field.name] = np.array([[value]])
        return values

    def _duration(self, values: Mapping[str, Array]) -> Any:
        return values.get("lasts", self.lasts)

    def _start(self, values: Mapping[str, Array], trials: int) -> Array:
        letters = Letters("part", values)
        starts = [
            start(letters) if callable(start) else start
            for start in self.equations.states.values()
        ]
        columns = [np.broadcast_to(start, (trials, 1)) for start in starts]
        return np.concatenate(columns, axis=1).astype(float)

    def _block(self, values: Mapping[str, Array], trials: int) -> tuple[Array, ...]:
        """Return starts, parameters and marks of trials, as `integrate` takes them."""
        equations = self.equations
        outputs = [x for output in equations.functions.values() for x in output]
        marks = marks_of(outputs, values, self._duration(values), equations.samplings)
        constants = phase_values(equations.constants, values, marks)
        shape = trials, marks.shape[1] - 1
        rows = [np.broadcast_to(np.atleast_2d(x), shape) for x in constants]
        parameters = np.stack(rows, axis=2) if rows else np.zeros((trials, 1, 0))
        marks = np.broadcast_to(marks, (trials, marks.shape[1]))
        return self._start(values, trials), parameters.astype(float), marks

    def _solved(
        self, deviations: Array, settings: Any, samples: Array | None = None
    ) -> tuple[Solution, dict[str, Array], Array]:
        values = self._values(deviations, settings)
        fixed = dataclasses.replace(settings, rtol=1e-6, max_step=1.0)
        with _lock:
            system = _system(type(self), fixed)
        start, parameters, marks = self._block(values, len(deviations))
        accuracy = Accuracy(settings.rtol, settings.max_step)
        solution = integrate(
            system, start, parameters, marks, accuracy, samples=samples
        )
        return solution, values, marks

    def _outcome(
        self, solution: Solution, values: Mapping[str, Array], marks: Array
    ) -> Outcome:
        equations, trials = self.equations, len(solution.status)
        last = solution.states[:, -1, :, None]
        states = {name: last[:, i] for i, name in enumerate(equations.states)}
        ended = solution.ended[:, :1]
        end = np.where(np.isnan(ended), marks[:, -1:], ended)
        at_end = self._quantities(end, states, values)
        taken = {
            "peak": solution.peak + 0.0,  # never -0
            "greatest": solution.greatest,
            "least": solution.least,
        }
        columns = []
        for name, response in self.responses.items():
            if response.kind in taken:
                column = taken[response.kind][:, equations.watched.index(name)]
            elif response.kind == "end":
                column = np.broadcast_to(at_end[name], (trials, 1))[:, 0]
            else:
                column = solution.quadratures[:, -1, equations.integrals.index(name)]
            columns.append(column)
        return Outcome(np.stack(columns, axis=1), solution.status, solution.steps)

    def _quantities(
        self, t: Array, y: Mapping[str, Array], p: Mapping[str, Array]
    ) -> dict[str, Array]:
        quantities = self.equations.quantities
        values = self.equations.along([*quantities.values()], t, y, p)
        return dict(zip(quantities, values, strict=True))


@cache
def _system(cls: type[Motion], settings: Any) -> System:
    """Return the compiled equations, their sizes measured on the nominal trial."""
    model, equations = cls(), cls.equations
    nominal = np.zeros((1, len(cls.parts)))
    values = model._values(nominal, settings)
    start, parameters, marks = model._block(values, 1)
    declared = [x.size for x in cls.states.values()]
    declared += [1.0] * (start.shape[1] - len(declared))
    scale = sizes_of(equations, declared, (start, parameters, marks), values)
    sizes = equations.sizes(start[0], scale, values)
    return equations.system(scale, sizes)


def _unchanged(model: Motion) -> Callable[..., Any]:
    """Return the equations of a model, which must not change its attributes."""

    def motion(t: Any, y: Any, p: Any) -> Any:
        before = {**vars(model)}
        returned = model.motion(t, y, p)
        after = vars(model)
        for name in [*(before | after)]:
            own = getattr(type(model), name, None)
            if after.get(name) is before.get(name) or isinstance(own, cached_property):
                continue
            raise ModelError(
                f"{_place(model)}: motion changes self.{name}. It is called to record "
                f"the equations only, so no step would change it; {KEPT}. A value of "
                "this instant is a variable without self"
            )
        return returned

    return motion


def _place(model: Motion) -> str:
    """Return file and line of the equations."""
    code = inspect.unwrap(type(model).motion).__code__
    return f"{Path(code.co_filename).name}, line {code.co_firstlineno}"


def _settings(cls: type[Motion], fields: Mapping[str, Any]) -> type:
    """Return the settings of a motion: the author's, `rtol` and `max_step`."""
    length = _length(cls)
    longest = float(length) / STEPS if isinstance(length, int | float) else 1.0
    common = {
        "rtol": setting(1e-6, "integration tolerance", above=0.0),
        "max_step": setting(longest, "longest step", unit="s", above=0.0),
    }
    annotated = [
        (name, type(field.default), field)
        for name, field in {**fields, **common}.items()
    ]
    return dataclasses.make_dataclass("Settings", annotated, frozen=True)


def _length(cls: type[Motion]) -> Any:
    """Return how long a trial lasts by default, as it is declared."""
    lasts = getattr(cls, "lasts", None)
    return lasts.default if isinstance(lasts, dataclasses.Field) else lasts


def _check(cls: type[Motion]) -> None:
    """Refuse declarations that are missing or do not fit."""
    length = _length(cls)
    if not isinstance(length, int | float) or not length > 0.0:
        raise ModelError(f"lasts = {length!r}: how long a trial lasts, in s, is needed")
    if not cls.states:
        raise ModelError('no state is declared; write x = State("m", start=0.1)')
    both = {*cls.states} & {*cls.responses}
    if both:
        raise ModelError(f"{', '.join(both)}: a state and a response need two names")
