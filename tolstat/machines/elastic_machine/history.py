"""How one chain moved: curves over time, and the pictures they belong to."""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.elastic_machine import motion
from tolstat.machines.elastic_machine.declarations import Settings, description_of
from tolstat.machines.elastic_machine.motion import HEAD, Chain, StartUp
from tolstat.machines.elastic_machine.start_up import LAWS
from tolstat.model.view import Axis, Chart, Curve, Panel, Span, peaks_of

WATCHED = ("error", "residual", "torque_peak")  # as `motion.loads` fills them
MOST_SHOWN = 4  # masses in one picture; all are in the data


def chart_of(
    time: Array, states: Array, marks: Array, machine: Array, settings: Settings
) -> Chart:
    """Chart a motion.

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

    responses = description_of(settings).responses
    watched = tuple(map(Curve.of, responses, found))
    programmed = Curve(
        "acceleration", "rad/s^2", "phi0''", "of the programmed shaft", phi0__
    )  # fmt: skip
    return Chart(
        Axis("time", "s", "s"),
        time,
        (*watched, programmed),
        marks=peaks_of(watched, time, words=""),
        spans=(Span(0.0, ended, "start-up"),),
        panels=panels(n),
    )


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
