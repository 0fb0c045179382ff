"""Models of the gallery: errors, steps, times and lines, traced and typed.

    python -m tests.studies.benchmarks.motions [NAME ...]

Traced: as they stand. Typed: the same equations as plain `np.where` in compiled rates,
without marks, crossings and sliding, with the same sizes of states; the longest step
is the whole time for both. Errors of three trials are those beside the references,
those of SciPy; its time is that of the reference, at 1e-12.
"""

from __future__ import annotations

import inspect
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.moving import references
from tests.moving.gallery import NAMES, TRIALS, deviations_of, model_of
from tolstat.errors import ModelError
from tolstat.integrator.integrate import integrate
from tolstat.integrator.problem import Accuracy, System
from tolstat.lanes.graph import Node, Value, rebuilt
from tolstat.lanes.straight_line import compiled_text, constants_of, text_of
from tolstat.model.contract import Outcome
from tolstat.moving.marks import phase_values
from tolstat.moving.motion import _system

MANY, RTOL, MOST = 400, 1e-6, 1_000_000


def without_sides(values: list[Value]) -> list[Value]:
    """Return values whose branches are decided by what they compare."""

    def replace_side(node: Node, args: list[Value]) -> Value | None:
        new = node.graph.node
        if node.op == "floor":  # of time; a floor is constant in a phase
            return new("rint", new("-", args[0], 0.5))
        if node.op != "side":
            return None
        (quantity,) = without_sides([node.args[0]])
        below = new("where", new("<", quantity, 0.0), -1.0, 0.0)
        return new("where", new(">", quantity, 0.0), 1.0, below)

    return rebuilt(values, replace_side)


def scale_of(model: Any) -> Any:
    """Return the sizes of its states."""
    fixed = replace(model.settings(), rtol=1e-6, max_step=1.0)
    return _system(type(model), fixed).scale


class Typed:
    """A model whose rates decide by `np.where`, as they would be typed."""

    def __init__(self, model: Any) -> None:
        """Compile it; ModelError if it has samples, memories, impacts or ends."""
        equations = model.equations
        if len(equations.states) > len(model.states) or equations.ends:
            raise ModelError("needs an event")
        self.counts = equations.counts[:2]
        count = len(equations.states) + sum(self.counts)
        outputs = without_sides(equations.functions["rates"][:count])
        self.constants = constants_of(outputs)
        rows = {
            "p": {node: i for i, node in enumerate(self.constants)},
            "y": {name: i for i, name in enumerate(equations.states)},
            "moment": {},
        }
        functions = {"rates": outputs}
        self.rates = compiled_text(text_of(functions, rows)).rates
        self.model = model

    def outcome(self, deviations: Any, settings: Any) -> Outcome:
        """Return responses and steps."""
        model = self.model
        values = model._values(deviations, settings)
        end = np.broadcast_to(model._duration(values), (len(deviations), 1))
        marks = np.concatenate([0.0 * end, end], axis=1)
        rows = phase_values(self.constants, values, marks)
        p = [np.broadcast_to(np.atleast_2d(row), end.shape)[:, 0] for row in rows]
        parameters = np.stack(p, axis=1) if p else np.zeros((len(end), 0))
        system = System(self.rates, scale_of(model), None, *self.counts)
        start = model._start(values, len(deviations))
        accuracy = Accuracy(settings.rtol, settings.max_step, MOST)
        solution = integrate(system, start, parameters, marks, accuracy)
        return model._outcome(solution, values, marks)


def measured(evaluate: Callable[..., Outcome], model: Any, settings: Any) -> list[str]:
    """Return error, steps of the nominal trial, and ms of many trials."""
    deviations = deviations_of(model)
    outcome = evaluate(deviations, settings)
    nominal = np.array([part.nominal for part in model.parts.values()])
    reference = getattr(references, model.name)
    known = np.array([reference(*row) for row in nominal + deviations])
    error = np.abs(outcome.responses - known).max(axis=0) / np.abs(known).max(axis=0)
    many = np.tile(deviations, (MANY // TRIALS + 1, 1))[:MANY]
    if outcome.steps.max() > MOST // 20:
        return [f"{np.nanmax(error):.1e}", str(outcome.steps[0]), "-"]
    seconds = []
    for _ in range(3):
        began = time.process_time()
        evaluate(many, settings)
        seconds.append(time.process_time() - began)
    return [
        "fails" if np.isnan(error).any() else f"{error.max():.1e}",
        str(outcome.steps[0]),
        f"{1e3 * min(seconds):.0f}",
    ]


def lines_of(code: str) -> int:
    """Return the lines of code, without those of docstrings and empty ones."""
    lines = [line.strip() for line in code.splitlines()]
    return sum(bool(line) and not line.startswith(('"""', "#")) for line in lines)


def main() -> None:
    """Print a row of the table for each model."""
    for name in sys.argv[1:] or NAMES:
        model = model_of(name)
        duration = float(np.ravel(model.lasts)[0])
        settings = replace(model.settings(), rtol=RTOL, max_step=duration)
        reference = getattr(references, name)
        nominal = [part.nominal for part in model.parts.values()]
        began = time.process_time()
        reference(*nominal)
        scipy = 1e3 * (time.process_time() - began)
        cells = [*measured(model.evaluate, model, settings)]
        try:
            cells += measured(Typed(model).outcome, model, settings)
        except ModelError:
            cells += ["-", "-", "-"]
        file = Path(inspect.getfile(type(model))).read_text("utf-8")
        cells += [f"{lines_of(file)}", f"{lines_of(inspect.getsource(reference))}"]
        print("|", " | ".join([name, *cells, f"{scipy:.0f}"]), "|", flush=True)


if __name__ == "__main__":
    main()
