"""The ring as points and lines: its outer face, the rollers, the edge of the tool."""

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.ring.declarations import Asked
from tolstat.machines.ring.harmonics import displacements
from tolstat.machines.ring.parameters import Rings
from tolstat.model.mechanism import Line, Mechanism
from tolstat.model.view import Axis, Chart

POINTS = 60  # of the ring
LINES = (
    Line("ring", (*range(POINTS), 0), "first"),
    Line("tool", (POINTS, POINTS + 1), "second", joints=True),
)
BARS = {
    "radial_force_peak": "second", "tangential_force_peak": "fourth",
    "roller_1_max": "first", "roller_2_max": "third",
}  # fmt: skip
SENTENCE = (
    "A ring of nominal size on its rollers, deflected, and the edge of the tool, at "
    "its nominal angle. The depth of cut lies between them."
)


def mechanism_of(
    chart: Chart, states: Array, rings: Rings, settings: Asked
) -> Mechanism:
    """Return the mechanism of one trial, from its history and its states there."""
    n, frames = rings.on.s.shape[1], len(chart.at)
    theta = np.linspace(0.0, 2 * np.pi, POINTS, endpoint=False)
    face_place = displacements(theta, rings.on)
    a, b = states[:, :n].T, states[:, n : 2 * n].T
    face = settings.middle_radius + 0.5 * settings.thickness
    outwards = (face_place.u_a @ a + face_place.u_b @ b).T
    along = (face_place.v_a @ a + face_place.v_b @ b).T
    # the tool moves inwards, from the depth of cut as set
    tool = -float(rings.t_R0[0]) - states[:, 4 * n]
    tool_angle = settings.tool_angle
    blunt = 0.1 * face  # how long the tool is drawn
    angles = np.array([*theta, tool_angle, tool_angle])
    radii = face + np.array([0.0] * POINTS + [0.0, blunt])
    reference = radii[:, None] * _directions(angles)
    off = np.column_stack([outwards, tool, tool])
    turned = np.column_stack([along, np.zeros((frames, 2))])
    points = reference + (
        off[:, :, None] * _directions(angles)
        + turned[:, :, None] * _directions(angles + np.pi / 2)
    )
    half = settings.support_angle / 2
    rollers = [
        (face + blunt / 2) * _directions(np.array([angle]))
        + blunt / 2 * _directions(np.linspace(0, 2 * np.pi, 25))
        for angle in (np.pi - half, np.pi + half)
    ]
    bars = {curve.name: curve for curve in chart.curves}
    return Mechanism(
        Axis("time", "s", "s"), chart.at, points, LINES, tuple(rollers),
        tuple(bars[name]._replace(colour=colour) for name, colour in BARS.items()),
        np.broadcast_to(reference, points.shape), SENTENCE,
    )  # fmt: skip


def _directions(angles: Array) -> Array:
    """Return where the paper's angles point, [angle, 2]; its pi is below."""
    return np.column_stack([-np.sin(angles), np.cos(angles)])
