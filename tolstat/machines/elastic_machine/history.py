"""How one chain moved: curves over time, and the pictures they belong to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.elastic_machine import motion
from tolstat.machines.elastic_machine.declarations import description_of
from tolstat.machines.elastic_machine.motion import HEAD, Chain, StartUp
from tolstat.machines.elastic_machine.settings import Settings
from tolstat.machines.elastic_machine.start_up import LAWS
from tolstat.model.view import Axis, Chart, Curve, Mark, Panel, Span

Array = NDArray[np.float64]

WATCHED = ("error", "residual", "torque_peak")  # as `motion.loads` fills them
MOST_SHOWN = 4  # masses in one picture; all are in the data


def chart_of(
    time: Array, states: Array, marks: Array, machine: Array, settings: Settings
) -> Chart:
    """Chart a motion.

    Parameters
    ----------
    time : float64[time]
        s.
    states : float64[time, state]
        theta of each mass, then theta'.
    marks : float64[mark]
        Start, events, horizon, s.
    machine : float64[parameter]
        As the equations of motion read it.
    settings : Settings
        Of the machine.

    Returns
    -------
    Chart
        A curve of what has a peak is called as the response; what is left after
        start-up has a gap before its end.
    """
    n = len(settings.inertia)
    start_up = StartUp(*machine[:HEAD])
    ended = float(marks[int(start_up.ended)])
    chain = Chain(*machine[HEAD : HEAD + 3 * n].reshape(3, n))
    phase = np.searchsorted(marks[1:-1], time, side="right").astype(float)
    over = phase >= start_up.ended
    static, found = np.empty((n, len(time))), np.empty((3 * n, len(time)))
    motion.static_deflection(phase, machine[HEAD + 3 * n :], static)
    motion.loads(over, states.T, static, chain, found)
    found[n : 2 * n, ~over] = np.nan
    f = LAWS[settings.start_up_law].shape(time * start_up.per_t0)
    phi0__ = motion.acceleration(f, phase, start_up)

    watched = curves_of(found, settings)
    programmed = Curve(
        "acceleration", "rad/s^2", "phi0''", "of the programmed shaft", phi0__
    )  # fmt: skip
    return Chart(
        Axis("time", "s", "s"),
        time,
        (*watched, programmed),
        marks=peaks_of(watched, time),
        spans=(Span(0.0, ended, "start-up"),),
        panels=panels(n),
    )


def curves_of(found: Array, settings: Settings) -> tuple[Curve, ...]:
    """Name float64[3 masses, time], what has peaks, as the responses are."""
    responses = description_of(settings).responses
    return tuple(
        Curve(
            response.name,
            response.unit,
            response.symbol.strip("|"),
            response.sentence.removeprefix("peak of ").removeprefix("peak "),
            values,
            shown=response.shown,
        )
        for response, values in zip(responses, found, strict=False)
    )


def peaks_of(curves: tuple[Curve, ...], time: Array) -> tuple[Mark, ...]:
    """Find where each curve is greatest, to either side."""
    found = []
    for curve in curves:
        size = np.where(np.isfinite(curve.values), np.abs(curve.values), -1.0)
        at = int(size.argmax())
        if size[at] >= 0.0:
            where, value = float(time[at]), float(curve.values[at])
            found.append(Mark(curve.name, where, value))
    return tuple(found)


def panels(n: int) -> tuple[Panel, ...]:
    """List the pictures of n masses: of many, some from the first to the last."""
    shown = np.unique(np.linspace(1, n, min(n, MOST_SHOWN)).round().astype(int))
    error, residual, torque = (
        tuple(f"{name}_{s}" for s in shown.tolist()) for name in WATCHED
    )
    return (
        Panel("Dynamic errors", error),
        Panel("Left after start-up", residual),
        Panel("Spring torques", torque),
        Panel("Programmed motion", ("acceleration",)),
    )
