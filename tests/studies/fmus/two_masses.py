"""The machine of backlash.h as a model of this package."""

from __future__ import annotations

import numpy as np

from tolstat.moving import Motion, Part, Response, State


class TwoMasses(Motion):
    """A force drives a load through backlash."""

    name = "two_masses"
    lasts = 0.5  # s
    x1 = State("m")
    v1 = State("m/s")
    x2 = State("m")
    v2 = State("m/s")
    m1 = Part(0.4, "kg", "motor mass")
    m2 = Part(0.9, "kg", "load mass")
    k = Part(8e4, "N/m", "stiffness of the contact")
    c = Part(15.0, "N s/m", "damping of the contact")
    gap = Part(2e-4, "m", "backlash")
    F = Part(12.0, "N", "amplitude of the force")
    peak = Response.peak("N", "largest contact force")
    position = Response.end("m", "the load's place")

    def motion(self, t, y, p):
        """Return the rates, and the quantities of the responses."""
        distance, half = y.x1 - y.x2, p.gap / 2
        damping = p.c * (y.v1 - y.v2)
        upper = np.where(distance > half, p.k * (distance - half) + damping, 0.0)
        lower = np.where(distance < -half, p.k * (distance + half) + damping, 0.0)
        force = upper + lower
        return {
            "x1": y.v1, "v1": (p.F * np.cos(40.0 * t) - force) / p.m1,
            "x2": y.v2, "v2": (force - 2.0 * y.v2) / p.m2,
            "peak": force, "position": y.x2,
        }  # fmt: skip
