"""Rest behind impacts: what bounces lower and lower stays where it has met.

The gap q is zero then, and its side 0. Behind an impact the states change along the
direction of its impulse; so does the force at rest, whose size keeps q'' at zero. Where
q'' without that force is above zero, the gap opens.
"""

from collections.abc import Mapping
from typing import NamedTuple

from tolstat.lanes.graph import Node, Value, same
from tolstat.lanes.slope import slope
from tolstat.moving.events import Impact

NEAR = 1e-9  # of the speed before: behind the impact, it is at rest
Rates = Mapping[str, Value]


class Rest(NamedTuple):
    """What holds at rest behind an impact."""

    speed: Value  # q'
    release: Value  # below zero the gap opens: -q'' without the force at rest
    still: dict[str, Value]  # by state: its value that makes q' zero
    rates: dict[str, Value]  # by state: its rate that makes q'' zero


def rest_of(impact: Impact, rates: Rates) -> Rest:
    """Return what holds at rest behind an impact."""
    new = impact.quantity.graph.node
    speed = slope(impact.quantity, rates)
    push = slope(speed, rates)
    by_state = {name: _partial(speed, name, rates) for name in impact.after}
    moving = [name for name, change in by_state.items() if not same(change, 0.0)]
    if not moving:  # what only counts
        return Rest(speed, 0.0, {}, {})
    first = moving[0]
    jumps = {
        name: new("-", value, new("y", name)) for name, value in impact.after.items()
    }
    direction = {name: _partial(jumps[name], first, rates) for name in moving}
    along: Value = 0.0
    for name in moving:
        along = along + by_state[name] * direction[name]
    still, held = {}, {}
    for name in moving:
        share = new("/", direction[name], along)
        still[name] = new("y", name) - speed * share
        held[name] = rates[name] - push * share
    return Rest(speed, new("-", 0.0, push), still, held)


def held_rates(impact: Impact, rest: Rest, rates: Rates) -> dict[str, Value]:
    """Return rates that are those of rest where the side of the gap is 0."""
    new, still = impact.quantity.graph.node, _at_rest(impact)
    held = {name: new("where", still, x, rates[name]) for name, x in rest.rates.items()}
    return {**rates, **held}


def states_behind(impact: Impact, rest: Rest, states: Rates) -> dict[str, Value]:
    """Return the states behind an impact and at rest, otherwise those that are."""
    new = impact.quantity.graph.node
    behind = {}
    for name, value in impact.after.items():
        still = rest.still.get(name, states[name])
        held = new("where", _at_rest(impact), still, states[name])
        # what was at rest, and is below by the error of a step, stays there
        if rest.still:
            value = new("where", new("<", rest.speed, 0.0), value, still)
        behind[name] = new("where", _meets(impact), value, held)
    return behind


def side_behind(
    impact: Impact, rest: Rest, speed: Value, side: Value, opens: Value
) -> Value:
    """Return the side of the comparison's quantity behind an impact.

    Parameters
    ----------
    impact, rest : Impact, Rest
    speed : value
        q' behind it.
    side : value
        Without the impact.
    opens : value
        Whether the gap opens from rest.
    """
    new = impact.quantity.graph.node
    up = 1.0 if impact.condition.op in ("<", "<=") else -1.0
    least = new("*", NEAR, new("maximum", rest.speed, new("-", 0.0, rest.speed)))
    passes = new("where", new("<", speed, new("-", 0.0, least)), -up, 0.0)
    met = new("where", new(">", speed, least), up, passes)
    met = new("where", new("<", rest.speed, 0.0), met, 0.0)
    if not rest.still:
        met = -up
    behind = new("where", _meets(impact), met, side)
    return new("where", new("&", new("==", behind, 0.0), opens), up, behind)


def below(impact: Impact, side: Value) -> Value:
    """Return 1 where the comparison holds on a side, else 0."""
    return impact.quantity.graph.node(
        "where", impact.quantity.graph.node(impact.condition.op, side, 0.0), 1.0, 0.0
    )


def _at_rest(impact: Impact) -> Value:
    """Return whether the side is 0, or was until the error of a step moved it."""
    side: Node = impact.condition.args[0]
    new = side.graph.node
    return new("|", new("==", side, 0.0), _meets(impact))


def _meets(impact: Impact) -> Value:
    """Return whether the comparison has just become true."""
    new = impact.quantity.graph.node
    return new("&", impact.condition, new("<", new("y", impact.below), 0.5))


def _partial(value: Value, state: str, rates: Rates) -> Value:
    """Return the derivative of a value by a state alone."""
    still = dict.fromkeys(rates, 0.0)
    by_time, both = slope(value, still), slope(value, {**still, state: 1.0})
    return both if same(by_time, 0.0) else both - by_time
