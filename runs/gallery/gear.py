"""A pair of gears with backlash rattles."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State


class Gear(Motion):
    """A pair of gears with backlash rattles."""

    lasts = 0.3
    x = State("m", start=6e-5, size=1e-4)
    v = State("m/s", size=0.1)
    m = Part(1.0, "kg", "mass")
    k = Part(1e7, "N/m", "mesh")
    g = Part(5e-5, "m", "half of the backlash")
    b = Part(600.0, "N s/m", "damping of the mesh")
    T = Part(100.0, "N", "load")
    force = Response.greatest("N", "force of the mesh")
    time_free = Response.above("s", "time without contact")

    def motion(self, t, y, p):
        touches = np.abs(y.x) > p.g
        F = p.k * (y.x - np.clip(y.x, -p.g, p.g)) + np.where(touches, p.b * y.v, 0.0)
        load = p.T * (1.0 + 3.0 * np.cos(300.0 * t))
        return {
            "x": y.v,
            "v": (load - F) / p.m,
            "force": F,
            "time_free": p.g - np.abs(y.x),
        }
