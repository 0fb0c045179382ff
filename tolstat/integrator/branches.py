"""Branches of compiled rates that neither a crossing nor a phase decides.

The rates are called once, uncompiled, with recording numbers. A comparison of what
moves is a branch, unless its quantity is a crossing of the system, or one of time alone
that changes its sign at marks. What bends only, as |x| and the greater of two, is named
where a survey has seen it inside steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import CellType, FunctionType
from typing import Any

import numpy as np

from tolstat.integrator.integrate import Integration
from tolstat.integrator.problem import MOMENT_ROWS, Block, System
from tolstat.integrator.residual import largest_residual
from tolstat.lanes.graph import Node, evaluated, in_order, jumps_in
from tolstat.lanes.recording import Recording
from tolstat.lanes.straight_line import is_traced

SPARE = 64  # rows of out, and parameters, beyond those that are known
GRID = 4001  # times at which quantities of time alone are evaluated
BRANCH = (
    "a branch that steps may jump over. Make its quantity a crossing, or let a phase "
    "begin there; a `Motion` finds both by itself."
)


def kink_words(surveyed: Sequence[Integration]) -> tuple[str, ...]:
    """Return a sentence for each kink of the rates that no crossing or mark meets."""
    sentences = dict[str, None]()
    for integration in surveyed:
        system, block, _ = integration
        residual = largest_residual([integration])
        kinked = residual is not None and residual.kinked
        parameters = block.parameters.shape[2]
        lines = unnamed_branches(system, parameters, block, bends=kinked)
        sentences |= {f"{line}: {BRANCH}": None for line in lines}
        if residual and kinked and not lines:
            sentences[residual.words] = None
    return tuple(sentences)


def unnamed_branches(
    system: System, parameters: int, block: Block | None = None, *, bends: bool = False
) -> tuple[str, ...]:
    """Return file and line of each branch of the rates that no crossing names.

    Nor the marks of the first trial of a block; `bends` too if they count. Empty, too,
    if the equations do what cannot be recorded, and for those of a `Motion`: what their
    code has beyond sides is the mix of what slides, whose release is a crossing.
    """
    if is_traced(system.rates):
        return ()
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
    sides = (node for node in in_order(out[:first]) if node.op == "side")
    kinks = [x.args[0] for x in sides] if bends else jumps_in(*out[:first])
    lines = (
        graph.kinks[q]
        for q in kinks
        if q not in named and not (block and _is_marked(q, block))
    )
    return tuple(dict.fromkeys(lines))


def _is_marked(quantity: Node, block: Block) -> bool:
    """Return whether a quantity of time alone changes its sign at marks, or never."""
    if quantity.kinds != {"t"}:
        return False
    marks, parameters = block.marks[0], block.parameters[0, 0]
    times = np.linspace(marks[0], marks[-1], GRID)

    def leaf(node: Node) -> Any:
        if node.op == "p":
            kind, number = node.args[0].split()
            return parameters[int(number) - 1] if kind == "parameter" else 1.0
        return times if node.op == "t" else None

    (values,) = evaluated([quantity], leaf)
    signs = np.sign(np.broadcast_to(values, times.shape))
    changes = np.flatnonzero(signs[1:] != signs[:-1])
    step = times[1] - times[0]
    near = np.abs(times[changes, None] + 0.5 * step - marks) <= step
    return bool(near.any(axis=1).all())


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
