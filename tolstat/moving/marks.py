"""Times at which traced equations switch, trial by trial."""

from collections.abc import Iterable, Mapping

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.lanes.graph import Node, Value, evaluated, in_order

POINTS = 4001  # of a trial, at which a quantity that is not straight is looked at
LEAST = 5  # of them in each phase
HALVINGS = 60
NEAR = 1e-13  # of the duration: nearer marks are one


def marks_of(
    outputs: Iterable[Value],
    parts: Mapping[str, Array],
    duration: Array | float,
    samplings: Iterable[Value] = (),
) -> Array:
    """Return start, times of switching and of samples, and end: float64[trial, mark].

    Parameters
    ----------
    outputs : iterable of values
        All that the equations need: what switches by time alone is among its nodes.
    parts : dict of str to float64[trial, 1]
        Values of parts and settings.
    duration : float or float64[trial, 1]
        End of each trial, s.
    samplings : iterable of values
        Periods, s, whose multiples are marks.

    Returns
    -------
    float64[trial, mark]
        With one row if it is the same in all trials.
    """
    end = np.atleast_2d(duration)
    marks = np.concatenate([np.zeros_like(end), end], axis=1)
    for every in samplings:
        (period,) = evaluated([every], lambda node: _part(node, parts))
        period = np.atleast_2d(period)
        times = period * np.arange(1, 1 + int(np.max(end / period)))
        marks = _merged(marks, np.minimum(times, end))
    for node in in_order(outputs, into_sides=True):
        timed = node.op in ("side", "floor") and "y" not in node.args[0].kinds
        if timed and node.args[0].moves:
            marks = _merged(marks, _switches(node, marks, parts))
    return marks


def phase_values(
    nodes: list[Node], parts: Mapping[str, Array], marks: Array
) -> list[Array]:
    """Return the value of each node, constant in a phase: float64[trial, phase]."""
    middle = 0.5 * (marks[:, 1:] + marks[:, :-1])
    begin = marks[:, :-1]

    def leaf(node: Node) -> Array | None:
        if node.op == "t":
            return middle
        if node.op == "instant":  # when the phase begins with a sample; else never
            (every,) = evaluated(node.args, lambda node: _part(node, parts))
            off = np.abs(begin - every * np.rint(begin / every))
            return np.where(off <= NEAR * marks[:, -1:], begin, -1.0)
        return _part(node, parts)

    return evaluated(nodes, leaf)


def _part(node: Node, parts: Mapping[str, Array]) -> Array | None:
    return parts[node.args[0]] if node.op == "p" else None


def _switches(node: Node, marks: Array, parts: Mapping[str, Array]) -> Array:
    """Return the times at which a side or a floor changes: float64[trial, time]."""
    quantity = node.args[0]
    inner = [x for x in in_order([quantity]) if x.op in ("side", "floor")]
    fixed = dict(zip(inner, phase_values(inner, parts, marks), strict=True))

    def value_at(
        times: Array, trial: Integers | None = None, phase: Integers | None = None
    ) -> Array:
        def leaf(node: Node) -> Array | None:
            if node.op == "t":
                return times
            value = fixed[node] if node in fixed else _part(node, parts)
            if value is None:
                return None
            value = np.atleast_2d(value)
            if trial is None:
                return value[..., None]
            wide = np.broadcast_to(
                value, (max(len(value), len(marks)), marks.shape[1] - 1)
            )
            return wide[trial if len(wide) > 1 else 0, phase]

        (values,) = evaluated([quantity], leaf, into_sides=False)
        return np.asarray(values)

    count = max(LEAST, POINTS // (marks.shape[1] - 1))
    share = np.linspace(0.0, 1.0, count)
    times = marks[:, :-1, None] + np.diff(marks)[..., None] * share
    values = value_at(times)
    times = np.broadcast_to(times, values.shape)
    level = np.floor(values) if node.op == "floor" else (values > 0.0) * 1.0
    change = np.nan_to_num(np.diff(level))
    index = np.nonzero(change)
    repeats = np.abs(change[index]).astype(int)
    trial, phase, point = (np.repeat(x, repeats) for x in index)
    # the numbers that the quantity passes there, one after the other
    turn = np.arange(len(trial)) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    rises = change[trial, phase, point] > 0.0
    before = level[trial, phase, point]
    target = np.where(rises, before + 1.0 + turn, before - turn)
    if node.op == "side":
        target = 0.0 * target
    low, high = times[trial, phase, point], times[trial, phase, point + 1]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        past = (value_at(middle, trial, phase) - target > 0.0) == rises
        low, high = np.where(past, low, middle), np.where(past, middle, high)
    switches = np.full((len(values), 1 + len(trial)), np.inf)
    number = np.arange(len(trial)) - np.searchsorted(trial, trial)
    switches[trial, number] = high
    return switches[:, : 1 + int(number.max(initial=-1))]


def _merged(marks: Array, more: Array) -> Array:
    """Return marks with more of them, ascending; near ones are one, the end is last."""
    n = max(len(marks), len(more))
    both = [np.broadcast_to(x, (n, x.shape[1])) for x in (marks, more)]
    end = both[0][:, -1:]
    times = np.sort(np.minimum(np.concatenate(both, axis=1), end), axis=1)
    for i in range(1, times.shape[1]):
        near = times[:, i] - times[:, i - 1] <= NEAR * end[:, 0]
        times[:, i] = np.where(near, times[:, i - 1], times[:, i])
    times = np.where(end - times <= NEAR * end, end, times)
    new = np.any(np.diff(times) > 0.0, axis=0)
    return times[:, np.concatenate([[True], new])]
