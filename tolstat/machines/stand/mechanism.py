"""The stand as points and lines: from the side, and from above."""

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.stand.declarations import RESPONSES, Settings
from tolstat.machines.stand.motion import Motion, State
from tolstat.machines.stand.parameters import Parameters
from tolstat.model.mechanism import Line, Mechanism
from tolstat.model.view import Axis, Curve

SENTENCE = "Above: from the side. Below: from above, the carriage between its guides."
BARS = {
    "rod_force_1": "first", "rod_force_2": "second", "shaft_9_moment": "third",
    "drive_moment": "fourth",
}  # fmt: skip
AXIS, PIN_1, PIN_2, HINGE_1, HINGE_2, END_1, END_2 = range(7)  # from the side
ABOVE = 7  # the first point from above: axes, pins, hinges, corners, ends of guides
LINES = (
    Line("carriage, side", (END_1, HINGE_1, HINGE_2, END_2), "third"),
    Line("crank and rod 1, side", (AXIS, PIN_1, HINGE_1), "first", joints=True),
    Line("crank and rod 2, side", (AXIS, PIN_2, HINGE_2), "second", joints=True),
    Line("carriage", tuple(ABOVE + i for i in (6, 7, 8, 9, 6)), "third"),
    Line("crank and rod 1", tuple(ABOVE + i for i in (0, 2, 4)), "first", joints=True),
    Line("crank and rod 2", tuple(ABOVE + i for i in (1, 3, 5)), "second", joints=True),
    Line("guide 1", (ABOVE + 10, ABOVE + 11), "ink"),
    Line("guide 2", (ABOVE + 12, ABOVE + 13), "ink"),
)
CORNERS = np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])


def mechanism_of(
    time: Array,
    moving: tuple[State, Motion],
    unyawed: tuple[State, Motion],
    p: Parameters,
    settings: Settings,
) -> Mechanism:
    """Return the mechanism of one trial.

    States and motions at the times, s: as it moves, and the same without its yaw.
    """
    clearance = float(p.delta[0] * p.dh[0]) / 2
    points, reference = (
        _points(*motion, p, settings, beside)
        for motion, beside in ((moving, clearance), (unyawed, 0.0))
    )
    loads, words = moving[1].loads._asdict(), {r.name: r for r in RESPONSES}
    bars = (
        Curve.of(words[name], loads[name])._replace(colour=colour)
        for name, colour in BARS.items()
    )
    turn = np.linspace(0.0, 2 * np.pi, 61)
    wheel = settings.r3 * np.column_stack([np.cos(turn), np.sin(turn)])
    return Mechanism(
        Axis("time", "s", "s"), time, points, LINES, (wheel,), tuple(bars), reference,
        SENTENCE,
    )  # fmt: skip


def _points(
    y: State, moved: Motion, p: Parameters, settings: Settings, beside: float
) -> Array:
    """Return float64[moment, point, 2]; guides are so far beside the carriage, m."""
    N, pins = settings, moved.places
    below = -1.6 * N.r3 - N.dl_s  # where the middle of the view from above lies
    still, a = np.zeros_like(y.x), (p.off + p.dl_s / 2, p.off - p.dl_s / 2)
    sin, cos = np.sin(y.alpha), np.cos(y.alpha)
    from_side = [
        (still, still), (pins.pin1_x, pins.pin1_y), (pins.pin2_x, pins.pin2_y),
        (pins.hinge1_x, still + p.h_1), (pins.hinge2_x, still + p.h_2),
        *((y.x + end * p.dh / 2, still + N.h) for end in (-1.0, 1.0)),
    ]  # fmt: skip
    from_above = [
        *((still, still + end * N.dl_s / 2) for end in (1.0, -1.0)),
        (pins.pin1_x, still + N.dl_s / 2), (pins.pin2_x, still - N.dl_s / 2),
        (pins.hinge1_x, a[0] * cos), (pins.hinge2_x, a[1] * cos),
        *(
            (y.x + along * cos + across * sin, across * cos - along * sin)
            for along, across in CORNERS * [float(p.dh[0]), N.dl_s] / 2
        ),
        *(
            (still + x, still + side * (N.dl_s / 2 + beside))
            for side in (1.0, -1.0)
            for x in (N.l - N.r - N.dh, N.l + N.r + N.dh)
        ),
    ]  # fmt: skip
    places = [*from_side, *((x, up + below) for x, up in from_above)]
    return np.moveaxis(np.array(places), (1, 2), (2, 0))
