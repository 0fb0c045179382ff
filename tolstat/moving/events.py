"""Events in `motion`, beside NumPy: samples, memories, contacts, impacts, an end."""

from __future__ import annotations

from contextvars import ContextVar
from typing import Any, NamedTuple

import numpy as np

from tolstat.errors import ModelError
from tolstat.lanes.graph import Node, Value
from tolstat.lanes.recording import Recording


class Sampled(NamedTuple):
    """A state that takes a value at each sample, and stays in between."""

    value: Value
    every: Value


class Impact(NamedTuple):
    """States that jump where a quantity falls below zero."""

    quantity: Node
    condition: Node  # of its side
    after: dict[str, Value]  # by state
    below: str  # state: 1 while the condition holds


class Tracing:
    """The graph that is being recorded, and the events in it."""

    def __init__(self) -> None:
        """Begin without events."""
        self.graph = Recording()
        self.starts: dict[str, float] = {}  # of states that events need
        self.held: dict[str, Sampled] = {}
        self.memories: dict[str, tuple[Value, Value]] = {}  # on, off
        self.ends: list[Node] = []  # below zero the trial ends
        self.impacts: list[Impact] = []

    def state(self, start: float) -> Node:
        """Return a state of an event, with its start."""
        name = f"event {len(self.starts) + 1}"
        self.starts[name] = start
        return self.graph.node("y", name)  # type: ignore[no-any-return]


tracing: ContextVar[Tracing | None] = ContextVar("tracing", default=None)


def _current() -> Tracing:
    current = tracing.get()
    if current is None:
        raise ModelError(
            "moving.held, sampled, memory, impact and ends work inside `motion` alone"
        )
    return current


def sampled(value: Any, *, every: Any) -> Sampled:
    """Return, for a state in place of its rate, what it becomes every so many s."""
    number = _current().graph.number
    return Sampled(number(value), number(every))


def held(value: Any, *, every: Any) -> Any:
    """Return a value as it was at the last sample, as a digital controller sees it.

    Parameters
    ----------
    value : number
        Read at the start, and then every so many seconds.
    every : number
        Period, s: a number, a part or a setting.
    """
    current = _current()
    state = current.state(0.0)
    state.dimension = getattr(value, "dimension", None)
    current.held[state.args[0]] = sampled(value, every=every)
    return state


def memory(on: Any, off: Any, *, start: bool = False) -> Any:
    """Return a condition that becomes true with `on`, false with `off`, else stays.

    Parameters
    ----------
    on, off : condition
        Such as y.T < 19.5 and y.T > 20.5.
    start : bool
        Its truth at the start, where neither holds.
    """
    current = _current()
    state, truth = current.state(float(start)), current.graph.truth
    current.memories[state.args[0]] = truth(on), truth(off)
    return current.graph.node(">", state, 0.5)


def ends(condition: Any) -> None:
    """End the trial where a comparison becomes true; its states stay.

    Parameters
    ----------
    condition : condition
        One comparison, such as y.h < 0. A second call adds another.
    """
    current = _current()
    current.ends.append(_falling("ends", condition))


def impact(condition: Any, **after: Any) -> None:
    """Give states other values where a comparison becomes true, as behind an impact.

    A ball that bounces lower and lower comes to rest, and leaves when it is pulled.

    Parameters
    ----------
    condition : condition
        One comparison, such as y.h < 0. A second call adds another.
    **after : number
        By state, as v=-p.e * y.v.
    """
    current = _current()
    quantity = _falling("impact", condition)
    if not after:
        raise current.graph.fault(
            "moving.impact needs states and their values, such as v=-p.e * y.v"
        )
    values = {name: current.graph.number(value) for name, value in after.items()}
    below = current.state(0.0).args[0]
    current.impacts.append(Impact(quantity, condition, values, below))


def _falling(name: str, condition: Any) -> Node:
    """Return the quantity that is below zero where a comparison of a state is true."""
    graph = _current().graph
    side = condition.args[0] if isinstance(condition, Node) and condition.args else None
    if not (isinstance(side, Node) and side.op == "side" and "y" in side.kinds):
        raise graph.fault(
            f"moving.{name} takes one comparison of a state, such as y.h < 0; call it "
            "again for another"
        )
    quantity: Node = side.args[0]
    below = condition.op in ("<", "<=")
    return quantity if below else graph.node("-", 0.0, quantity)


def contact(depth: Any, speed: Any, *, stiffness: Any, damping: Any = 0.0) -> Any:
    """Return the force of a contact, which pushes only: its damper does not pull.

    Parameters
    ----------
    depth : number
        How deep one part is in the other, m; below zero they are apart.
    speed : number
        Its rate, m/s.
    stiffness, damping : number
        N/m and N s/m.
    """
    push = np.maximum(stiffness * depth + damping * speed, 0.0)
    return np.where(depth > 0.0, push, 0.0)
