"""How one ring was cut: curves over time, and the pictures they belong to."""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.ring.parameters import Rings, force, out_of_roundness
from tolstat.model.view import Axis, Chart, Curve, Level, Mark, Panel


def chart_of(time: Array, states: Array, rings: Rings, static: float) -> Chart:
    """Chart a motion.

    Returns
    -------
    Chart
        Depth of cut, displacements of ring and tool at the tool, cutting forces.
    """
    n = rings.on.s.shape[1]
    U = np.zeros(len(time))
    for j in range(n):
        U = (
            U
            + rings.at.u_a[0, j] * states[:, j]
            + rings.at.u_b[0, j] * states[:, n + j]
        )
    X = states[:, 4 * n]
    blank = out_of_roundness(rings, time)
    t_R = rings.t_R0[0] + U + X + blank
    curves = (
        Curve("depth_min", "m", "t_R", "depth of cut", t_R),
        Curve("ring_displacement", "m", "U", "of the ring at the tool, outwards", U),
        Curve("tool_travel", "m", "X_P", "displacement of the tool", X),
        Curve("blank", "m", "", "what the blank is out of round", blank),
        Curve(
            "radial_force_peak", "N", "P_R", "radial cutting force",
            force(rings.c_R[0], rings.x_R[0], t_R),
        ),
        Curve(
            "tangential_force_peak", "N", "P_T", "tangential cutting force",
            force(rings.c_T[0], rings.x_T[0], t_R),
        ),
    )  # fmt: skip
    marks: tuple[Mark, ...] = ()
    if np.isfinite(t_R).all():
        at = int(t_R.argmin())
        marks = (Mark("depth_min", float(time[at]), float(t_R[at]), "least"),)
    levels = [Level(0.0, "out of the cut below")]
    if np.isfinite(static):
        levels.append(Level(static, "static depth"))
    moved = ["tool_travel", "ring_displacement"]
    moved += ["blank"] if blank.any() else []
    return Chart(
        Axis("time", "s", "s"),
        time,
        curves,
        marks=marks,
        panels=(
            Panel("Depth of cut", ("depth_min",), levels=tuple(levels)),
            Panel("Displacements at the tool", tuple(moved)),
            Panel("Cutting forces", ("radial_force_peak", "tangential_force_peak")),
        ),
    )
