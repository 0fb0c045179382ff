"""Equations as a graph of the operations that plain NumPy does on recording numbers.

Common terms are one node. A node knows on what it depends: on time "t", on what moves
("y"), on the phase between two times at which something switches; else it is a
constant of the trial.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tolstat.errors import ModelError

PACKAGE = Path(__file__).parents[1]
HIDDEN = tuple(str(PACKAGE / room) for room in ("lanes", "moving"))
# code that is not the author's: this room's, NumPy's, SciPy's, Python's
SITE = Path(np.__file__).parents[1]
FOREIGN = (
    *HIDDEN,
    *(str(SITE / name) for name in ("numpy", "scipy", "pandas")),
    *("<__", "<frozen", "<string>"),
)

INFIX: Mapping[str, Callable[..., Any]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "**": np.power,
    ">": np.greater, ">=": np.greater_equal, "<": np.less, "<=": np.less_equal,
    "==": np.equal, "!=": np.not_equal, "&": np.logical_and, "|": np.logical_or,
}  # fmt: skip
# `bend` is a `where` that does not jump; a side is the sign of its quantity
CALLED: Mapping[str, Callable[..., Any]] = {
    "where": np.where,
    "bend": np.where,
    "side": np.sign,
    "~": np.logical_not,
}
MASKS = {">", ">=", "<", "<=", "==", "!=", "&", "|", "~", "isfinite"}

SIMPLE = {"+": 0.0, "-": 0.0, "*": 1.0, "/": 1.0, "**": 1.0, "&": True, "|": False}
LEAVES = ("t", "y", "p", "instant", "moment")
OF_NUMBERS = ("sin", "cos", "exp", "log", "arctan", "expm1", "log1p", "tanh")

Value = Any  # a node, or a plain number


class Node(np.lib.mixins.NDArrayOperatorsMixin):
    """A number of the equations that records what is done to it."""

    def __init__(self, graph: Graph, op: str, args: tuple[Value, ...]) -> None:
        """Join the graph; `args` are nodes and numbers, of a leaf its name."""
        self.graph, self.op, self.args, self.number = graph, op, args, len(graph.nodes)
        kinds: frozenset[str] = frozenset().union(*(arg.kinds for arg in self.nodes))
        if op in ("side", "floor"):  # constant until the next mark or crossing
            kinds = kinds & {"y"} or (kinds and frozenset({"phase"}))
        own = {"t": "t", "y": "y", "moment": "y", "instant": "phase"}.get(op)
        self.kinds: frozenset[str] = kinds | {own} if own else kinds
        # an object to be multiplied, divided, raised and compared; None if not known
        self.dimension = dimension_of(graph, op, args)

    __hash__ = object.__hash__

    @property
    def nodes(self) -> list[Node]:
        """The arguments that are nodes."""
        return [arg for arg in self.args if isinstance(arg, Node)]

    @property
    def moves(self) -> bool:
        """Whether it changes within a phase."""
        return bool(self.kinds - {"phase"})

    @property
    def is_mask(self) -> bool:
        """Whether it is true or false."""
        return self.op in MASKS

    def __array_ufunc__(self, ufunc: Any, method: str, *args: Any, **kws: Any) -> Any:
        if method != "__call__" or kws:
            raise self.graph.fault(f"np.{ufunc.__name__}: only plain arguments work")
        return self.graph.call(ufunc.__name__, *args)

    def __array_function__(self, f: Any, types: Any, args: Any, kws: Any) -> Any:
        return self.graph.call(f.__name__, *args, **kws)

    def __bool__(self) -> bool:
        raise self.graph.fault(
            "what moves is not true or false once and for all; write "
            "np.where(condition, a, b) for `if`, & and | for `and` and `or`, "
            "np.maximum for max"
        )

    def __float__(self) -> float:
        raise self.graph.fault(
            "this takes plain numbers; write np.sin for math.sin, y.x for float(y.x), "
            "np.interp for a table or a spline"
        )

    __complex__ = __float__

    def __index__(self) -> int:
        raise self.graph.fault(
            "a whole plain number is needed here; write np.floor for int, np.where or "
            "np.select to choose a value, np.interp for a table"
        )

    __int__ = __index__

    def __round__(self, digits: int | None = None) -> Any:
        raise self.graph.fault("round() takes plain numbers; write np.round(x)")

    def __iter__(self) -> Any:
        raise self.graph.fault("it is one number, not a list; y.x names a state")


class Graph:
    """Nodes by operation and arguments, and where each kink stands."""

    def __init__(self) -> None:
        """Begin without any node."""
        self.nodes: dict[Any, Node] = {}
        self.kinks: dict[Node, str] = {}  # quantity -> file and line
        self.dimensions: dict[str, Any] = {}  # of states, parts and "t" by name
        self.unit_of: Callable[[Any], str] = str  # the word for a dimension

    def call(self, name: str, *args: Any, **options: Any) -> Value:
        """Return what a function of NumPy returns."""
        raise NotImplementedError

    def node(self, op: str, *args: Value) -> Value:
        """Return the node of an operation, or its value where all is a number."""
        if not any(isinstance(arg, Node) for arg in args) and op not in LEAVES:
            with np.errstate(all="ignore"):
                return function_of(op)(*args).item()
        if (simpler := _simplified(op, args)) is not None:
            return simpler
        return self.unsimplified(op, *args)

    def unsimplified(self, op: str, *args: Value) -> Node:
        """Return the node of an operation as it is written."""
        key = (op, *(a.number if isinstance(a, Node) else (a,) for a in args))
        if key not in self.nodes:
            self.nodes[key] = Node(self, op, args)
        return self.nodes[key]

    def line(self) -> str:
        """Return file and line of the author's code that runs."""
        frame = sys._getframe(1)
        while frame and frame.f_code.co_filename.startswith(FOREIGN):
            frame = frame.f_back  # type: ignore[assignment]
        if not frame:
            return "equations"
        return f"{Path(frame.f_code.co_filename).name}, line {frame.f_lineno}"

    def fault(self, problem: str) -> ModelError:
        """Return an error with the author's line."""
        return ModelError(f"{self.line()}: {problem}")


def function_of(op: str) -> Callable[..., Any]:
    """Return the NumPy function of an operation."""
    function: Callable[..., Any] = INFIX.get(op) or CALLED.get(op) or getattr(np, op)
    return function


def dimension_of(graph: Graph, op: str, args: tuple[Value, ...]) -> Any:
    """Return the dimension of an operation; refuse a sum of two kinds.

    Numbers may have any, so nothing is known of their products.
    """
    if op in LEAVES or not graph.dimensions:
        return graph.dimensions.get(args[0]) if args else None
    known: list[Any] = [getattr(arg, "dimension", None) for arg in args]
    plain = graph.dimensions.get("1")
    if op in ("+", "-", "where", "bend", "maximum", "minimum"):
        summed = [d for d in known[-2:] if d is not None]
        if len(summed) == 2 and summed[0] != summed[1]:
            units = " and ".join(map(graph.unit_of, summed))
            raise graph.fault(f"{units} are added or compared; units must be the same")
        return summed[0] if summed else None
    if op in ("*", "/") and None not in known:
        return known[0] * known[1] if op == "*" else known[0] / known[1]
    if op in OF_NUMBERS:
        if known[0] not in (None, plain, graph.dimensions.get("t")):  # exp(-t) is usual
            unit = graph.unit_of(known[0])
            raise graph.fault(
                f"np.{op} of {unit}; an angle or a plain number is needed"
            )
        return plain
    exponent = 0.5 if op == "sqrt" else args[1] if op == "**" else None
    if exponent is not None and known[0] is not None and not isinstance(exponent, Node):
        raised = known[0] ** exponent
        # of m^1.5 no unit can be written: as of a typed number, nothing is known
        return raised if all(x == int(x) for x in raised.values()) else None
    return plain if op == "side" else known[0] if op in ("rint", "floor") else None


def _simplified(op: str, args: tuple[Value, ...]) -> Value | None:
    """Return a simpler value of an operation, if there is one."""
    if op in ("where", "bend"):
        mask, a, b = args
        if isinstance(mask, bool):
            return a if mask else b
        return a if same(a, b) else None
    if op not in SIMPLE or len(args) != 2:
        return None
    for number, other, first in ((*args, True), (*args[::-1], False)):
        if not isinstance(number, Node):
            if number == SIMPLE[op] and not (first and op in ("-", "/", "**")):
                return other
            if number == 0.0 and (op == "*" or (op == "/" and first)):
                return 0.0
            if op in ("&", "|"):  # the other truth decides
                return number
    if op == "-" and same(*args):
        return 0.0
    a, b = args
    twice = op == "-" and isinstance(b, Node) and b.op == "-" and same(a, 0.0)
    return b.args[1] if twice and same(b.args[0], 0.0) else None


def same(a: Value, b: Value) -> bool:
    """Return whether two values are one node, or equal numbers."""
    nodes = isinstance(a, Node) or isinstance(b, Node)
    return a is b if nodes else bool(a == b)


def in_order(outputs: Iterable[Value], into_sides: bool = False) -> list[Node]:
    """Return all nodes that outputs need, arguments first.

    The quantity of a side belongs to them with `into_sides`.
    """
    waiting = [x for x in outputs if isinstance(x, Node)]
    reached = dict.fromkeys(waiting)
    while waiting:
        node = waiting.pop()
        for arg in node.nodes if into_sides or node.op != "side" else ():
            if arg not in reached:
                reached[arg] = None
                waiting.append(arg)
    return sorted(reached, key=lambda node: node.number)


def jumps_in(*outputs: Value) -> dict[Node, None]:
    """Return the quantities whose sides make outputs jump; those of bends do not."""
    reached, waiting = dict[Node, None](), [*outputs]
    while waiting:
        node = waiting.pop()
        if isinstance(node, Node) and node not in reached:
            reached[node] = None
            if node.op != "side":
                waiting += node.args[1:] if node.op == "bend" else node.args
    return {node.args[0]: None for node in reached if node.op == "side"}


def evaluated(
    outputs: Sequence[Value],
    leaf: Callable[[Node], Any],
    *,
    into_sides: bool = True,
    sign: Callable[..., Any] = np.sign,
) -> list[Any]:
    """Return values by NumPy; `leaf` gives that of a node, or None to compute it.

    `sign` is that of the quantity of a side.
    """
    values: dict[Node, Any] = {}
    with np.errstate(all="ignore"):
        for node in in_order(outputs, into_sides):
            value = leaf(node)
            if value is None:
                args = [values[x] if isinstance(x, Node) else x for x in node.args]
                value = (sign if node.op == "side" else function_of(node.op))(*args)
            values[node] = value
    return [values[x] if isinstance(x, Node) else x for x in outputs]


def rebuilt(
    outputs: Sequence[Value], replace: Callable[[Node, list[Value]], Value | None]
) -> list[Value]:
    """Return outputs with some nodes replaced; `replace` gets a node and its new args.

    It returns None for a node that stays, of the new arguments.
    """
    new: dict[Node, Value] = {}
    for node in in_order(outputs):
        leaf = node.op == "side" or not node.nodes
        args = (
            [*node.args]
            if leaf
            else [new.get(x, x) if isinstance(x, Node) else x for x in node.args]
        )
        value = replace(node, args)
        if value is None:
            value = node if leaf else node.graph.node(node.op, *args)
        new[node] = value
    return [new[x] if isinstance(x, Node) else x for x in outputs]
