"""NumPy's functions on recording numbers: each becomes nodes, each kink is noted.

A comparison of what changes is a `side` of a quantity, the difference: the sign that it
has until the next mark (of time alone) or crossing (of a state). Comparisons of one
quantity share one side, whichever way they are written.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from tolstat.lanes.graph import INFIX, Graph, Node, Value, in_order, same

NAMES = {
    "add": "+", "subtract": "-", "multiply": "*", "divide": "/", "true_divide": "/",
    "greater": ">", "greater_equal": ">=", "less": "<", "less_equal": "<=",
    "equal": "==", "not_equal": "!=", "logical_and": "&", "bitwise_and": "&",
    "logical_or": "|", "bitwise_or": "|",
}  # fmt: skip
FLIPPED = {">": "<", ">=": "<=", "<": ">", "<=": ">="}
NEGATED = {">": "<=", ">=": "<", "<": ">=", "<=": ">", "==": "!=", "!=": "=="}
SMOOTH = ("sin", "cos", "sqrt", "exp", "log", "arctan", "expm1", "log1p", "tanh")
# smooth functions by those
EXPANDED: Mapping[str, Callable[..., Value]] = {
    "positive": lambda x: x,
    "negative": lambda x: 0.0 - x,
    "square": lambda x: x * x,
    "reciprocal": lambda x: 1.0 / x,
    "tan": lambda x: np.sin(x) / np.cos(x),
    "sinh": lambda x: 0.5 * (np.expm1(x) - np.expm1(-x)),
    "cosh": lambda x: 0.5 * (np.exp(x) + np.exp(-x)),
    "hypot": lambda a, b: np.sqrt(a * a + b * b),
    "log10": lambda x: np.log(x) * (1.0 / math.log(10.0)),
    "log2": lambda x: np.log(x) * (1.0 / math.log(2.0)),
    "exp2": lambda x: np.exp(x * math.log(2.0)),
    "deg2rad": lambda x: x * (math.pi / 180.0),
    "radians": lambda x: x * (math.pi / 180.0),
    "rad2deg": lambda x: x * (180.0 / math.pi),
    "degrees": lambda x: x * (180.0 / math.pi),
    "arcsin": lambda x: np.arctan(x / np.sqrt((1.0 - x) * (1.0 + x))),
    "arccos": lambda x: 2.0 * np.arctan(np.sqrt((1.0 - x) / (1.0 + x))),
    "fmod": lambda x, m: np.copysign(np.abs(x) % np.abs(m), x),
    "round": lambda x: np.floor(x + 0.5),
    "rint": lambda x: np.floor(x + 0.5),
    "ceil": lambda x: -np.floor(-x),
    "heaviside": lambda x, h: np.where(x > 0.0, 1.0, 0.0),
}
ALLOWED = (
    "+ - * / ** %, < >, & | ~, sin, cos, tan, arctan, arcsin, exp, log, sqrt, tanh, "
    "hypot, abs, sign, minimum, maximum, clip, where, interp"
)


def sum_of_powers(coefficients: Any, x: Value) -> Value:
    """Return a polynomial, the highest power first."""
    value: Value = 0.0
    for coefficient in coefficients:
        value = value * x + coefficient
    return value


class Recording(Graph):
    """A graph that knows NumPy's functions."""

    def __init__(self) -> None:
        """Begin without any node."""
        super().__init__()
        self.spans: dict[Node, tuple[float, float]] = {}  # of remainders

    def call(self, name: str, *args: Any, **options: Any) -> Value:
        """Return what a function of NumPy returns, elementwise for arrays of nodes."""
        if options:
            raise self.fault(f"np.{name}: write it without {', '.join(options)}=")
        if name == "interp":
            return self._table(*args)
        if name == "select":
            return self._chosen(*args)
        if name == "polyval":
            return sum_of_powers(*args)
        if name == "clip":
            x, low, high = args
            x = x if low is None else self.call("maximum", x, low)
            return x if high is None else self.call("minimum", x, high)
        if any(isinstance(arg, np.ndarray | list | tuple) for arg in args):
            elementwise = np.frompyfunc(lambda *x: self.call(name, *x), len(args), 1)
            return elementwise(*map(_boxed, args))
        return self._of_numbers(name, *args)

    def _of_numbers(self, name: str, *args: Any) -> Value:
        op = NAMES.get(name, name)
        if op in ("&", "|", "logical_not", "invert", "where"):
            if op == "where":
                return self.select(self.truth(args[0]), *map(self.number, args[1:]))
            masks = [self.truth(arg) for arg in args]
            return self.node(op, *masks) if len(masks) > 1 else self.inverted(*masks)
        numbers = [self.number(arg) for arg in args]
        nodes = [arg for arg in numbers if isinstance(arg, Node)]
        if op in ("*", "/") and nodes and any(same(x, 1.0) for x in numbers):
            return self.unsimplified(op, *numbers)  # a typed 1.0 may have any unit
        stays = not any(node.moves for node in nodes)  # within a phase
        of_numpy = op in INFIX or (hasattr(np, op) and op not in ("negative", "power"))
        if stays and of_numpy:
            return self.node(op, *numbers)
        if name == "power":
            return self._power(*numbers)
        if op == "sqrt":
            numbers = [self._from_zero(*numbers)]
        if op in ("+", "-", "*", "/", *SMOOTH):
            return self.node(op, *numbers)
        if op in FLIPPED:
            return self.compared(op, self.node("-", *numbers))
        if op in ("==", "!="):
            raise self.fault("what moves equals a number for an instant only; use < >")
        if op in EXPANDED:
            return self.number(EXPANDED[op](*numbers))
        if rule := getattr(self, f"_{op}", None):
            return rule(*numbers)
        raise self.fault(
            f"np.{name} does not work in equations of motion; {ALLOWED} do"
        )

    def number(self, x: Any) -> Value:
        """Return an argument as a node or a float; a truth as 1 or 0."""
        if isinstance(x, Node):
            return self.select(x, 1.0, 0.0) if x.is_mask else x
        try:
            return float(x)
        except (TypeError, ValueError):
            raise self.fault(f"{x!r} is not a number") from None

    def truth(self, x: Any) -> Value:
        """Return a condition as a mask or a truth."""
        if isinstance(x, Node) and x.is_mask:
            return x
        if isinstance(x, bool | np.bool_):
            return bool(x)
        raise self.fault("a condition such as y.x > 0 is expected")

    # what has kinks -------------------------------------------------------------------

    def compared(self, op: str, q: Value) -> Value:
        """Return the truth of `q op 0`."""
        if not isinstance(q, Node) or not q.moves:
            return self.node(op, q, 0.0)
        if q.op in ("where", "bend"):
            mask, a, b = q.args
            a, b = self.compared(op, a), self.compared(op, b)
            return self.chosen_truth(mask, a, b)
        if q.op == "-":
            a, b = q.args
            for part, sign in ((a, 1), (b, -1)):  # a difference of what may be flat
                if isinstance(part, Node) and part.op in ("where", "bend"):
                    mask, *ends = part.args
                    pairs = [(e, b) if sign > 0 else (a, e) for e in ends]
                    truths = [self.compared(op, self.node("-", *p)) for p in pairs]
                    return self.chosen_truth(mask, *truths)
            if not isinstance(a, Node):
                if same(a, 0.0) or isinstance(b, Node):
                    turned = b if same(a, 0.0) else self.node("-", b, a)
                    return self.compared(FLIPPED[op], turned)
            elif isinstance(b, Node) and a.number > b.number:
                return self.compared(FLIPPED[op], self.node("-", b, a))
        if q.op == "*" and not isinstance(q.args[0], Node):
            factor, q = q.args
            return self.compared(op if factor > 0.0 else FLIPPED[op], q)
        self.kinks.setdefault(q, self.line())
        return self.node(op, self.node("side", q), 0.0)

    def chosen_truth(self, mask: Value, a: Value, b: Value) -> Value:
        """Return the truth a where a mask holds, and b elsewhere."""
        both = self.node("&", mask, a), self.node("&", self.inverted(mask), b)
        return self.node("|", *both)

    def inverted(self, mask: Value) -> Value:
        """Return where a mask does not hold."""
        if not isinstance(mask, Node):
            return not mask
        if mask.op in NEGATED:
            return self.node(NEGATED[mask.op], *mask.args)
        if mask.op in ("&", "|"):
            op = "|" if mask.op == "&" else "&"
            return self.node(op, *map(self.inverted, mask.args))
        return mask.args[0] if mask.op == "~" else self.node("~", mask)

    def select(self, mask: Value, a: Value, b: Value, op: str = "where") -> Value:
        """Return a where a mask holds, b elsewhere; each node decides by one truth."""
        if isinstance(a, bool) or (isinstance(a, Node) and a.is_mask):
            return self.chosen_truth(mask, a, b)
        if isinstance(mask, Node) and "y" in mask.kinds:
            if mask.op == "&":
                first, second = mask.args
                return self.select(first, self.select(second, a, b), b)
            if mask.op == "|":
                first, second = mask.args
                return self.select(first, a, self.select(second, a, b))
        return self.node(op, mask, a, b)

    def _absolute(self, x: Value) -> Value:
        return self.select(self.compared(">", x), x, 0.0 - x, "bend")

    def _maximum(self, a: Value, b: Value) -> Value:
        return self.select(self.compared(">", self.node("-", a, b)), a, b, "bend")

    def _minimum(self, a: Value, b: Value) -> Value:
        return self.select(self.compared("<", self.node("-", a, b)), a, b, "bend")

    _fmax, _fmin = _maximum, _minimum

    def _sign(self, x: Value) -> Value:
        above, below = self.compared(">", x), self.compared("<", x)
        if isinstance(above, Node) and above.op in (">", "<"):
            side = above.args[0]
            return side if above.op == ">" else 0.0 - side
        return self.select(above, 1.0, self.select(below, -1.0, 0.0))

    def _copysign(self, size: Value, sign: Value) -> Value:
        size = self.call("absolute", size)
        return self.select(self.compared(">=", sign), size, 0.0 - size)

    def _arctan2(self, a: Value, b: Value) -> Value:
        """Return the angle of (b, a), which jumps by a turn where b is below zero."""
        node, left = self.node, self.compared("<", b)
        radius = self.call("sqrt", node("+", node("*", a, a), node("*", b, b)))
        near = self.select(left, node("-", radius, b), node("+", radius, b))
        half = node("*", 2.0, self.call("arctan", node("/", a, near)))
        turn = self.select(self.compared("<", a), -math.pi, math.pi)
        return self.select(left, node("-", turn, half), half)

    def _floor(self, x: Value) -> Value:
        self.kinks.setdefault(x, self.line())
        if "y" not in x.kinds:
            return self.node("floor", x)
        # even below the crossings of sin(pi x) upwards, odd below the others; right
        # half a turn beyond them, too
        even = self.compared(">", np.sin(math.pi * x))
        twice = [2.0 * self.node("rint", 0.5 * x - shift) for shift in (0.25, 0.75)]
        return self.select(even, twice[0], twice[1] + 1.0)

    def _remainder(self, x: Value, m: Value) -> Value:
        value = self.node("-", x, m * self.call("floor", x / m))
        if isinstance(value, Node) and not isinstance(m, Node) and m > 0.0:
            self.spans[value] = 0.0, m
        return value

    def _power(self, x: Value, n: Value) -> Value:
        if isinstance(n, Node) or n != int(n) or abs(n) > 16:
            return self.node("**", self._from_zero(x), n)
        value: Value = 1.0
        for bit in f"{int(abs(n)):b}":
            value = self.node("*", value, value)
            value = self.node("*", value, x) if bit == "1" else value
        return self.node("/", 1.0, value) if n < 0 else value

    def _from_zero(self, x: Value) -> Value:
        """Return what a bend keeps above zero, as |x|, at least 0 behind it, too."""
        bends = any(node.op == "bend" for node in in_order([x]))
        return self.node("maximum", x, 0.0) if bends else x

    def _chosen(self, masks: Any, values: Any, default: Any = 0.0) -> Value:
        chosen: Value = self.number(default)
        for mask, value in zip(masks[::-1], values[::-1], strict=True):
            chosen = self.select(self.truth(mask), self.number(value), chosen)
        return chosen

    def _table(self, x: Value, places: Any, heights: Any) -> Value:
        """Return a table's value: straight lines, constant outside."""
        at, y = np.asarray(places, float), np.asarray(heights, float)
        if at.ndim != 1 or at.shape != y.shape or np.any(np.diff(at) < 0.0):
            raise self.fault(
                "np.interp: two lists of numbers, places ascending, needed"
            )
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes = np.where(np.diff(at) > 0.0, np.diff(y) / np.diff(at), 0.0)
        lower, upper = self.spans.get(x, (-math.inf, math.inf))
        # height, slope and knot of the first stretch, and of each behind a knot
        stretches = [(y[0], 0.0, at[0]), *zip(y[:-1], slopes, at[:-1], strict=True)]
        stretches.append((y[-1], 0.0, at[-1]))
        lines = [tuple(map(float, stretch)) for stretch in stretches]
        by_state = isinstance(x, Node) and "y" in x.kinds
        chosen = [self._on(x, *lines[0])] if by_state else [*lines[0]]
        for i, knot in enumerate(at.tolist()):
            if knot >= upper:
                break
            behind = self.call("greater_equal", x, knot) if knot > lower else True
            jumps = knot in at[:i] or knot in at[i + 1 :]
            new = [self._on(x, *lines[i + 1])] if by_state else lines[i + 1]
            op = "where" if jumps or not by_state else "bend"
            pairs = zip(new, chosen, strict=True)
            chosen = [self.select(behind, a, b, op) for a, b in pairs]
        return chosen[0] if by_state else self._on(x, *chosen)

    def _on(self, x: Value, height: Value, slope: Value, knot: Value) -> Value:
        """Return the value on a line through a knot."""
        rise = self.node("*", slope, self.node("-", x, knot))
        return self.node("+", height, rise)


def _boxed(x: Any) -> Any:
    """Return an array of objects, also of one node: NumPy passes it on as it is."""
    if not isinstance(x, Node):
        return np.asarray(x, object)
    box = np.empty((), object)
    box[()] = x
    return box
