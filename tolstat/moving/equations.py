"""Equations of a motion, traced once: what becomes compiled code, what is a mark."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError, UnitError, allowed_names, told
from tolstat.integrator.problem import SIDES, System
from tolstat.lanes.graph import FOREIGN, Node, Value, evaluated, in_order, rebuilt, same
from tolstat.lanes.recording import ALLOWED
from tolstat.lanes.straight_line import compiled_text, constants_of, text_of
from tolstat.moving.declarations import Letters, Response, State
from tolstat.moving.events import Impact, Sampled, Tracing, tracing
from tolstat.moving.rests import (
    Rest,
    below,
    held_rates,
    rest_of,
    side_behind,
    states_behind,
)
from tolstat.moving.sliding import Slides, mixed, slides_of
from tolstat.units.conversion import check_si, dimension, si_unit

AT_REST = 1e-9  # of its largest value: a quantity with a side is zero
NEAR = 1e-6  # of the load, beyond that which lets a quantity slide: it just stops
KEPT = (
    "for what stays in between, write memory(on, off), held(value, every=...) or "
    "a state with sampled(value, every=...)"
)
EXTREMES = "peak", "greatest", "least"
Motion = Callable[[Any, Any, Any], Any]


class Equations:
    """The traced equations of a motion.

    Attributes
    ----------
    states : dict of str to float or callable
        Starts of the states, those of samples and memories at the end.
    quantities, raw : dict of str to value
        What responses are taken of, by name; and without the mix of a slide.
    """

    def __init__(
        self,
        motion: Motion,
        states: Mapping[str, State],
        parts: Mapping[str, str],
        responses: Mapping[str, Response],
    ) -> None:
        """Call `motion` with recording numbers; `parts` have units by name.

        It is called twice: both records are the same, unless it keeps, draws or reads
        what is not recorded.

        Raises
        ------
        ModelError
            With file, line and what to write, if it does what cannot be traced.
        """
        units = {**parts, **{name: state.unit for name, state in states.items()}}
        # a plain number may stand for anything, as a temperature
        typed = {name: unit for name, unit in units.items() if unit != "1"}
        dimensions = _dimensions({**typed, "t": "s", "1": "1"})
        events, returned = _record(motion, states, parts, dimensions)
        self.graph, self.responses = events.graph, responses
        _check_names(returned, [*states, *responses])
        again = _record(motion, states, parts, dimensions)
        if _content(*again) != _content(events, returned):
            raise ModelError(
                "motion gives other equations when it is called again: it keeps values "
                "in a list or a variable, draws random numbers or reads a clock. Its "
                f"values depend on t, y and p alone; {KEPT}"
            )
        for name in (name for impact in events.impacts for name in impact.after):
            if name not in states:
                words = allowed_names(name, [*states])
                raise ModelError(f"moving.impact: no state is called {name}; {words}")
        rates = {name: self._rate(name, returned[name], events) for name in states}
        rates |= dict.fromkeys(events.starts, 0.0)
        starts = {name: state.start for name, state in states.items()}
        self.states = {**starts, **events.starts}
        self.quantities = {
            name: self.graph.number(returned[name]) for name in responses
        }
        for name, value in {**rates, **self.quantities}.items():
            if isinstance(value, Node) and name in returned:
                self._check_unit(name, value, states)
        self.graph.dimensions = {}  # what is made of these equations is not checked
        self._arrange(rates, events)

    def _rate(self, name: str, value: Any, events: Tracing) -> Value:
        if isinstance(value, Sampled):
            events.held[name] = value
            return 0.0
        return self.graph.number(value)

    def _check_unit(self, name: str, value: Node, states: Mapping[str, State]) -> None:
        """Refuse a returned quantity with another unit than its declaration has."""
        kind = "" if name in states else self.responses[name].kind
        unit = states[name].unit if name in states else self.responses[name].unit
        needed = _dimensions({name: unit})[name]
        if kind == "above" or unit == "1":
            return
        if kind in ("", "integral"):
            needed = needed / self.graph.dimensions["t"]
        if value.dimension is not None and value.dimension != needed:
            words = f"in {_unit_of(value.dimension)}; {_unit_of(needed)} is needed"
            raise ModelError(f"motion returns '{name}' {words}")

    def _arrange(self, rates: Mapping[str, Value], events: Tracing) -> None:
        """Put the outputs of the compiled functions in order."""
        rests = [rest_of(impact, rates) for impact in events.impacts]
        impacts = [*zip(events.impacts, rests, strict=True)]
        for impact, rest in impacts:
            rates = held_rates(impact, rest, rates)
        self.samplings = [sample.every for sample in events.held.values()]
        self.integrals = self._named("integral", "above")
        self.watched = self._named(*EXTREMES)
        integrals = [*map(self._integrand, self.integrals)]
        watched = [self.quantities[name] for name in self.watched]
        decisions = [truth for pair in events.memories.values() for truth in pair]
        decisions += [impact.condition for impact in events.impacts]
        used = [*integrals, *watched, *decisions, *events.ends]
        slides = slides_of(rates, used, self.graph.kinks)
        releases = {
            q: slide.release
            for q, slide in slides.items()
            if isinstance(slide.release, Node) and slide.release.moves
        }
        # a quantity that is held at zero is not above it
        above = [self.responses[name].kind == "above" for name in self.integrals]
        filled = mixed([*rates.values(), *integrals, *watched], slides)
        for i, (raw, holds) in enumerate(zip(integrals, above, strict=True)):
            if holds:
                filled[len(rates) + i] = raw
        self.raw = self.quantities
        along = mixed([*self.raw.values()], slides)
        self.quantities = dict(zip(self.raw, along, strict=True))
        opening = [
            rest.release
            for rest in rests
            if isinstance(rest.release, Node) and rest.release.moves
        ]
        sides = list[Node]()
        more = [*releases.values(), *mixed([*opening, *events.ends], slides)]
        values = more
        while len(new := _sides_of([*filled, *used, *values])) > len(sides):
            sides = new
            values = [*mixed(sides, slides), *more]
        self.sides = {side: SIDES + i for i, side in enumerate(sides)}
        self.counts = len(integrals), len(watched), len(values)
        first = len(watched)
        self.crossings = tuple(range(first, first + len(values)))
        self.ends = tuple(range(len(values) - len(events.ends), len(values)))
        self.values = values
        self.functions = {"rates": [*filled, *values]}
        if watched or values:
            self.functions["watch"] = [*filled[len(rates) + len(integrals) :], *values]
        if events.held or events.memories or releases or impacts:
            keys = [*releases, *opening]
            rows = {q: len(sides) + i for i, q in enumerate(keys)}
            self.functions["jump"] = self._jump(events, slides, impacts, rows)
        outputs = [x for output in self.functions.values() for x in output]
        self.constants = constants_of(outputs)
        self.text = text_of(
            self.functions,
            {
                "p": {node: i for i, node in enumerate(self.constants)},
                "y": {name: i for i, name in enumerate(self.states)},
                "moment": self.sides,
            },
        )

    def _named(self, *kinds: str) -> list[str]:
        """Return the responses of some kinds."""
        return [name for name, r in self.responses.items() if r.kind in kinds]

    def _integrand(self, name: str) -> Value:
        quantity, graph = self.quantities[name], self.graph
        if self.responses[name].kind == "integral":
            return quantity
        return graph.number(graph.compared(">", quantity))

    def _jump(
        self,
        events: Tracing,
        slides: Slides,
        impacts: Sequence[tuple[Impact, Rest]],
        rows: Mapping[Node, int],
    ) -> list[Value]:
        """Return the states and the sides behind a mark or a crossing.

        `rows` are those of the releases, by the quantity that slides or by the release
        of a rest.
        """
        graph = self.graph
        node = graph.node
        new = {name: node("y", name) for name in self.states}
        behind: dict[str, Value] = {}

        def replace(x: Node, args: list[Value]) -> Value | None:
            return behind.get(x.args[0]) if x.op == "y" else self._sign_of(x, args)

        for name, (value, every) in events.held.items():
            (value,) = rebuilt([value], replace)
            sample = node("==", node("t", "t"), node("instant", every))
            new[name] = node("where", sample, value, node("y", name))
            if name in events.starts:  # what reads it at the same instant reads this
                behind[name] = new[name]
        for name, (on, off) in events.memories.items():
            new[name] = graph.select(on, 1.0, graph.select(off, 0.0, node("y", name)))
        for impact, rest in impacts:
            new |= states_behind(impact, rest, new)
        met = [name for impact, _ in impacts for name in impact.after]
        jumping = {name: new[name] for name in (*events.held, *events.memories, *met)}

        def moved(x: Node, args: list[Value]) -> Value | None:
            return jumping.get(x.args[0]) if x.op == "y" else None

        sides = [node("moment", SIDES + i) for i in range(len(self.values))]
        for i, value in enumerate(self.values):
            (after,) = rebuilt([value], moved)
            if not same(after, value):
                changed = False
                for x in in_order([value]):
                    if x.op == "y" and x.args[0] in jumping:
                        changed = node("|", changed, node("!=", jumping[x.args[0]], x))
                sign = node("where", node(">", after, 0.0), 1.0, -1.0)
                sides[i] = node("where", changed, sign, sides[i])
        for impact, rest in impacts:
            quantity = impact.condition.args[0].args[0]
            i, opens = self.sides[quantity] - SIDES, False
            if rest.release in rows:
                opens = node("<", node("moment", SIDES + rows[rest.release]), 0.0)
            value, speed = rebuilt([quantity, rest.speed], moved)
            if same(value, quantity):
                sides[i] = side_behind(impact, rest, speed, sides[i], opens)
            new[impact.below] = below(impact, sides[i])
        for q in slides:  # what just stops to slide has a side at once
            if q not in rows:
                continue
            i, row = self.sides[q] - SIDES, rows[q]
            load, factor = slides[q].load, slides[q].factor
            most = node("*", -1.0 - NEAR, factor)
            leaves = node("<", node("moment", SIDES + row), 0.0)
            near = node("<=", node("maximum", load, node("-", 0.0, load)), most)
            leaves = node("&", leaves, near)
            way = node("where", node(">", load, 0.0), 1.0, -1.0)
            rests = node("==", node("moment", SIDES + i), 0.0)
            sides[i] = node("where", node("&", rests, leaves), way, sides[i])
        return [*new.values(), *sides]

    def _sign_of(self, x: Node, args: list[Value]) -> Value | None:
        """Return the sign of a quantity that is no crossing; None but for its side."""
        if x.op != "side" or x.args[0] in self.sides:
            return None
        (value,) = rebuilt([x.args[0]], self._sign_of)
        return self.graph.node("where", self.graph.node(">", value, 0.0), 1.0, -1.0)

    @property
    def identity(self) -> str:
        """What decides its numbers, beside the code of the engine."""
        nodes = in_order([*self.constants, *self.quantities.values()], into_sides=True)
        rows = [
            (x.op, *(a.number if isinstance(a, Node) else a for a in x.args))
            for x in nodes
        ]
        return f"{self.text} {rows} {self.samplings}"

    def along(
        self,
        outputs: Sequence[Value],
        t: Array,
        y: Mapping[str, Array],
        p: Mapping[str, Array],
    ) -> list[Array]:
        """Return outputs at times and states, by NumPy."""
        leaves = {"t": {"t": t}, "y": y, "p": p}

        def leaf(node: Node) -> Any:
            return leaves[node.op][node.args[0]] if node.op in leaves else None

        def sign(value: Array) -> Array:
            least = AT_REST * np.nanmax(np.abs(value), initial=0.0)
            return np.where(np.abs(value) <= least, 0.0, np.sign(value))

        return evaluated(outputs, leaf, sign=sign)

    def sizes(self, start: Array, scale: Array, p: Mapping[str, Array]) -> list[float]:
        """Return how much each crossing's quantity changes with the sizes of states."""
        places = start[:, None] + np.diag(scale)
        both = np.concatenate([start[:, None], places], axis=1)
        y = {name: both[None, i] for i, name in enumerate(self.states)}
        rows = self.along(self.values, np.zeros((1, 1)), y, p)
        changes = [np.abs(np.asarray(x) - np.ravel(x)[0]) for x in rows]
        return [float(np.nan_to_num(np.max(x))) for x in changes]

    @cached_property
    def module(self) -> Any:
        """The compiled functions."""
        return compiled_text(self.text)

    def system(self, scale: Array, sizes: Sequence[float]) -> System:
        """Return the compiled equations, with the sizes of states and crossings."""
        return System(
            self.module.rates,
            scale,
            getattr(self.module, "watch", None),
            *self.counts,
            crossings=self.crossings,
            jump=getattr(self.module, "jump", None),
            jumps_at_marks="jump" in self.functions,
            ends=self.ends,
            sizes=tuple(sizes),
        )


def _record(
    motion: Motion,
    states: Mapping[str, State],
    parts: Mapping[str, str],
    dimensions: Mapping[str, Any],
) -> tuple[Tracing, Any]:
    """Return the record of a call of `motion`, and what it returns."""
    events = Tracing()
    events.graph.dimensions, events.graph.unit_of = {**dimensions}, _unit_of
    node = events.graph.node
    y = Letters("state", {name: node("y", name) for name in states})
    p = Letters("part", {name: node("p", name) for name in parts})
    token = tracing.set(events)
    try:
        returned = motion(node("t", "t"), y, p)
    except ModelError as error:
        raise error if ", line " in str(error) else _fault(error) from error
    except Exception as error:
        raise _fault(error) from error
    finally:
        tracing.reset(token)
    return events, returned


def _content(events: Tracing, returned: Any) -> str:
    """Return all of a record, without its objects."""

    def plain(x: Any) -> Any:
        if isinstance(x, Node):
            return f"node {x.number}", x.graph is events.graph
        if isinstance(x, Mapping):
            return {name: plain(value) for name, value in x.items()}
        if isinstance(x, np.ndarray):
            return plain(x.tolist())
        if isinstance(x, list | tuple):
            return [*map(plain, x)]
        return x if isinstance(x, str | float | int | np.generic) else type(x).__name__

    kept = events.held, events.memories, events.ends, events.impacts
    nodes = ((x.op, x.args) for x in events.graph.nodes.values())
    return repr(plain([returned, *kept, *nodes]))


def _dimensions(units: Mapping[str, str]) -> dict[str, Any]:
    """Return dimensions by name, angles as plain numbers; refuse what is no SI unit."""
    dimensions = {}
    for name, unit in units.items():
        try:
            check_si(unit)
        except UnitError as error:
            raise ModelError(f"{name}: {error}") from None
        full = dimension(unit)
        dimensions[name] = full / dimension("rad") ** full.get("[angle]", 0)
    return dimensions


def _unit_of(kind: Any) -> str:
    """Return the unit of a dimension in words."""
    try:
        return si_unit(kind)
    except UnitError:
        return str(kind)


def _sides_of(outputs: Sequence[Value]) -> list[Node]:
    """Return the quantities of the sides of states that outputs need."""
    nodes = in_order(outputs, into_sides=True)
    return [x.args[0] for x in nodes if x.op == "side" and "y" in x.kinds]


def _check_names(returned: Any, names: Sequence[str]) -> None:
    if not isinstance(returned, Mapping):
        raise ModelError(
            "motion returns a dict: the rate of each state and the quantity of each "
            f"response by name, not {type(returned).__name__}"
        )
    for name in returned:
        if name not in names:
            raise ModelError(f"motion returns '{name}'; {allowed_names(name, names)}")
    for name in names:
        if name not in returned:
            raise ModelError(f"motion returns nothing for '{name}', which is declared")


def _fault(error: Exception) -> ModelError:
    """Return an error of the author's code with its line."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f for f in frames if not f.filename.startswith(FOREIGN)]
    problem = told(error)
    if isinstance(error, TypeError | AttributeError):
        problem += f"; {ALLOWED} work in equations of motion"
    if not lines:
        return ModelError(problem)
    return ModelError(
        f"{Path(lines[-1].filename).name}, line {lines[-1].lineno}: {problem}"
    )
