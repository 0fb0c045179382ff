"""Branches of compiled rates that neither a crossing nor a phase decides.

The rates are called once, uncompiled, with recording numbers. A comparison of what
moves is a branch, unless its quantity is a crossing of the system. What bends only, as
|x| and the greater of two, is none.
"""

from __future__ import annotations

from collections.abc import Callable
from types import CellType, FunctionType
from typing import Any

from tolstat.integrator.problem import MOMENT_ROWS, System
from tolstat.lanes.graph import in_order, jumps_in
from tolstat.lanes.recording import Recording

SPARE = 64  # rows of out, and parameters, beyond those that are known


def unnamed_branches(system: System, parameters: int) -> tuple[str, ...]:
    """Return file and line of each branch of the rates that no crossing names.

    Empty, too, if the equations do what cannot be recorded.
    """
    graph, states = Recording(), len(system.scale)
    # sides and phase are constant over a step
    moment = [graph.node("p", f"moment {i}") for i in range(MOMENT_ROWS + SPARE)]
    moment[0] = graph.node("t", "t")
    y = [graph.node("y", f"state {i + 1}") for i in range(states)]
    p = [graph.node("p", f"parameter {i + 1}") for i in range(parameters)]
    first = states + system.n_quadratures
    out: list[Any] = [0.0] * (first + system.n_watched + SPARE)
    try:
        _uncompiled(system.rates, {})(moment, y, p, out)
        named = {
            node.args[0]
            for i in system.crossings
            for node in in_order([graph.compared(">", out[first + i])])
            if node.op == "side"
        }
    except Exception:  # whatever plain Python raises for a recording number
        return ()
    lines = (graph.kinks[q] for q in jumps_in(*out[:first]) if q not in named)
    return tuple(dict.fromkeys(lines))


def _uncompiled(function: Any, done: dict[int, Callable[..., Any]]) -> Any:
    """Return a compiled function as plain Python, with all that it calls."""
    plain = getattr(function, "py_func", None)
    if plain is None:
        return function
    if id(function) not in done:
        names: dict[str, Any] = {}
        cells = tuple(CellType() for _ in plain.__closure__ or ())
        python_function = FunctionType(
            plain.__code__, names, plain.__name__, plain.__defaults__, cells
        )
        done[id(function)] = python_function
        names |= {k: _uncompiled(v, done) for k, v in plain.__globals__.items()}
        for cell, before in zip(cells, plain.__closure__ or (), strict=True):
            cell.cell_contents = _uncompiled(before.cell_contents, done)
    return done[id(function)]
