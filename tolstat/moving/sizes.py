"""Sizes of the states of a motion, to which their errors are related."""

from collections.abc import Mapping

import numpy as np

from tolstat.arrays import Array
from tolstat.integrator.examination import proposed_scale
from tolstat.integrator.integrate import integrate, observed
from tolstat.integrator.problem import Accuracy
from tolstat.lanes.slope import slope
from tolstat.moving.equations import Equations

SIZING = Accuracy(1e-6, np.inf, 200_000)
POINTS = 4001  # of the nominal trial, at which responses are looked at
LEAST = 1e-3  # of the largest value of a state: smaller sizes cost steps by rounding


def sizes_of(
    equations: Equations,
    declared: list[float | None],
    block: tuple[Array, Array, Array],
    values: Mapping[str, Array],
) -> Array:
    """Return float64[state], from the nominal trial.

    A size is as declared, or the largest value of the state. It is less where a
    response changes by its own size already when the state changes by less, as the
    force of a stiff stop.

    Parameters
    ----------
    equations : Equations
    declared : list of float or None
        Declared sizes.
    block : tuple of arrays
        Start, parameters and marks of the nominal trial.
    values : dict of str to float64[1, 1]
        Its parts and settings.
    """
    start, _, marks = block
    typed = np.array([x is not None for x in declared])
    scale = np.array(
        [x or abs(s) or 1.0 for x, s in zip(declared, start[0], strict=True)]
    )
    # the second time with the sizes of the first
    for _ in range(2 if not typed.all() else 0):
        proposed = proposed_scale(equations.system(scale, []), *block, SIZING)
        scale = np.where(typed, scale, proposed)
    times = np.linspace(marks[0, 0], marks[0, -1], POINTS)
    system = equations.system(scale, [])
    with observed():  # hidden from a survey of trials, which it is not
        history = integrate(system, *block, SIZING, samples=times).history[0]
    largest = np.nanmax(np.abs(history), axis=0, initial=0.0)
    for size in _sizes_of_responses(equations, times, history, values):
        scale = np.minimum(scale, np.maximum(size, LEAST * largest))
    return scale


def _sizes_of_responses(
    equations: Equations, times: Array, history: Array, values: Mapping[str, Array]
) -> list[Array]:
    """Return, for each response, by how much states change it by its own size."""
    names = [*equations.states]
    motion = dict(zip(names, history.T, strict=True))
    still = dict.fromkeys(names, 0.0)
    sizes = []
    for name, response in equations.responses.items():
        if response.kind == "above":
            continue
        raw = equations.raw[name]
        slopes = [slope(raw, still | {state: 1.0}) for state in names]
        rows = equations.along([raw, slope(raw, still), *slopes], times, motion, values)
        quantity, by_time, *by_state = (
            np.broadcast_to(row, (1, len(times)))[0] for row in rows
        )
        seen = np.isfinite(quantity)
        if not seen.any():
            continue
        changes = np.abs(np.array(by_state) - by_time)[:, seen]
        quantity = np.abs(quantity[seen]) if response.kind == "peak" else quantity[seen]
        if response.kind == "integral":
            size, change = np.mean(np.abs(quantity)), np.mean(changes, axis=1)
        else:
            places = {"end": -1, "least": np.argmin(quantity)}
            place = places.get(response.kind, np.argmax(quantity))
            size, change = np.max(np.abs(quantity)), changes[:, place]
        with np.errstate(divide="ignore", invalid="ignore"):
            # a power of two is the same on each processor
            power = np.round(np.log2(size / change))
        sizes.append(np.where(np.isfinite(power), 2.0**power, np.inf))
    return sizes
