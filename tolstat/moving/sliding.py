"""Motion along a jump: where both sides lead back to it, their mix that stays there.

The side of such a quantity is 0. Its rates are then a share of those of both sides, so
that the quantity does not change (A. F. Filippov). Friction -F sign(v) sticks so, and
slips where the load exceeds it: the share would leave 0 to 1. That is a crossing, too.
Two quantities that move each other are solved together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from tolstat.errors import ModelError
from tolstat.lanes.graph import Node, Value, in_order, jumps_in, rebuilt, same
from tolstat.lanes.recording import NEGATED
from tolstat.lanes.slope import slope


class Slide(NamedTuple):
    """How a quantity slides at zero."""

    mix: Value  # from -1 to 1, of the rates on both sides
    release: Value  # below zero it leaves
    load: Value  # its speed without the jump; it leaves to the side of its sign
    factor: Value  # what the jump adds to it, times the side: below zero


Rates = Mapping[str, Value]
Slides = Mapping[Node, Slide]  # by quantity


def slides_of(
    rates: Rates, outputs: Sequence[Value], kinks: Mapping[Node, str]
) -> Slides:
    """Return the quantities that may slide.

    Parameters
    ----------
    rates : dict of str to value
        Of each state.
    outputs : sequence of values
        What else depends on sides.
    kinks : dict of node to str
        File and line of each quantity.

    Raises
    ------
    ModelError
        If more than two quantities move each other by their jumps.
    """
    quantities = [
        node.args[0]
        for node in in_order([*rates.values(), *outputs], into_sides=True)
        if node.op == "side" and "y" in node.kinds
    ]
    speeds = {q: slope(q, rates) for q in quantities}
    jumping = {q: jumps_in(speed) for q, speed in speeds.items()}
    sliding = [q for q in quantities if q in jumping[q]]
    slides = dict[Node, Slide]()
    for q in sliding:
        others = [
            r
            for r in sliding
            # parallel ones are never at zero together
            if not same(_core(speeds[r]), _core(speeds[q]))
            and (r in jumping[q] or q in jumping[r])
        ]
        if len(others) > 1:
            lines = "; ".join(kinks[x] for x in (q, *others))
            raise ModelError(
                f"{lines}: more than two jumps move each other, such as friction of "
                "three parts on each other; put a spring between two of them, or give "
                "one a smooth friction, such as np.tanh(v / 0.001)"
            )
        slides[q] = _of_two(q, others[0], rates) if others else _of_one(q, rates)
    return slides


def _core(speed: Value) -> Value:
    """Return a speed without constant factors."""
    while isinstance(speed, Node) and speed.op in ("-", "*", "/"):
        if len(moving := [x for x in speed.nodes if x.moves]) != 1:
            break
        factor = {
            "-": same(speed.args[0], 0.0),
            "*": True,
            "/": same(speed.args[0], moving[0]),
        }
        if not factor[speed.op]:
            break
        speed = moving[0]
    return speed


def _on_sides(rates: Rates, sides: Mapping[Node, float]) -> Rates:
    """Return the rates on given sides of some quantities."""

    def replace(node: Node, args: list[Value]) -> Value | None:
        return sides.get(node.args[0]) if node.op == "side" else None

    return dict(zip(rates, rebuilt([*rates.values()], replace), strict=True))


def _speed(q: Node, rates: Rates, sides: Mapping[Node, float]) -> Value:
    return slope(q, _on_sides(rates, sides))


def _of_one(q: Node, rates: Rates) -> Slide:
    """Return how a quantity slides that no other one's jump changes."""
    above, below = (_speed(q, rates, {q: side}) for side in (1.0, -1.0))
    constant, factor = 0.5 * (above + below), 0.5 * (above - below)
    return Slide(_clipped(q, constant, factor), 0.0 - above * below, constant, factor)


def _clipped(q: Node, constant: Value, factor: Value) -> Value:
    """Return s of constant + factor s = 0, from -1 to 1; 0 if nothing leads back."""
    new = q.graph.node
    share = new("minimum", new("maximum", new("/", 0.0 - constant, factor), -1.0), 1.0)
    return new("where", new("<", factor, 0.0), share, 0.0)


def _of_two(q: Node, r: Node, rates: Rates) -> Slide:
    """Return how a quantity slides whose speed another one's jump changes."""
    terms = {}
    for x in (q, r):
        both = _speed(x, rates, {q: 1.0, r: 1.0})
        by_q = 0.5 * (both - _speed(x, rates, {q: -1.0, r: 1.0}))
        by_r = 0.5 * (both - _speed(x, rates, {q: 1.0, r: -1.0}))
        terms[x] = both - by_q - by_r, by_q, by_r
    (a, aq, ar), (b, bq, br) = terms[q], terms[r]
    new = q.graph.node
    side_r = new("side", r)
    # both slide: solved together, then within -1 to 1 one after the other
    both_q = new("/", b * ar - a * br, aq * br - ar * bq)
    mix_q = new("minimum", new("maximum", both_q, -1.0), 1.0)
    for _ in range(2):
        mix_r = _clipped(r, b + bq * mix_q, br)
        mix_q = _clipped(q, a + ar * mix_r, aq)
    other = new("where", new("==", side_r, 0.0), mix_r, side_r)
    alone = _clipped(q, a + ar * side_r, aq)
    mix = new("where", new("==", side_r, 0.0), mix_q, alone)
    load = a + ar * other
    return Slide(mix, (aq - load) * (aq + load), load, aq)


def mixed(outputs: Sequence[Value], slides: Slides) -> list[Value]:
    """Return outputs whose jumps are mixed where the side is 0.

    What is not linear in a jump is mixed as a whole: of its values on both sides.
    """
    jumps: dict[Node, frozenset[Node]] = {}  # by new node: in which quantities

    def jumps_of(x: Value) -> frozenset[Node]:
        return jumps.get(x, frozenset()) if isinstance(x, Node) else frozenset()

    def replace(node: Node, args: list[Value]) -> Value | None:
        if node.op == "side":
            if node.args[0] not in slides:
                return node
            value = _mix(node, slides, -1.0, 1.0, node)
            jumps[value] = frozenset({node.args[0]})
            return value
        if node.op in NEGATED and isinstance(side := node.args[0], Node):
            return node if side.op == "side" else None  # masks keep their side
        value = node if not node.nodes else node.graph.node(node.op, *args)
        if not isinstance(value, Node):
            return value
        inner = args[1:] if node.op in ("where", "bend") else args
        jumps_by_arg = [jumps_of(x) for x in inner]
        together = frozenset[Node]().union(*jumps_by_arg)
        whole = frozenset[Node]()
        quantity = _quantity_of(node)
        if quantity is not None and quantity in slides:
            whole = frozenset({quantity})
        elif node.op in ("where", "bend", "+", "-"):
            pass
        elif node.op == "*":
            whole = jumps_by_arg[0] & jumps_by_arg[1]
        else:
            whole = jumps_by_arg[1] if node.op == "/" else together
        for q in whole:
            upper, lower = (_on(value, {q: side}) for side in (1.0, -1.0))
            value = _mix(node.graph.node("side", q), slides, lower, upper, value)
        if isinstance(value, Node):
            jumps[value] = together | whole
        return value

    return rebuilt(outputs, replace)


def _quantity_of(node: Node) -> Node | None:
    """Return the quantity by whose side a node chooses; None for any other."""
    mask = node.args[0] if node.op == "where" else None
    side = mask.args[0] if isinstance(mask, Node) else None
    return side.args[0] if isinstance(side, Node) and side.op == "side" else None


def _on(value: Value, sides: Mapping[Node, float]) -> Value:
    """Return a value on given sides of some quantities."""
    return _on_sides({"": value}, sides)[""]


def _mix(side: Node, slides: Slides, lower: Value, upper: Value, value: Value) -> Value:
    """Return a value, of both sides the mix where the side is 0."""
    new = side.graph.node
    share = 0.5 * (1.0 + slides[side.args[0]].mix)
    middle = new("+", lower, share * new("-", upper, lower))
    return new("where", new("==", side, 0.0), middle, value)
