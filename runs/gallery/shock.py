"""A load from a table, with two shocks of 4 ms in it."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State

TIMES = [0.0, 0.5, 0.502, 0.504, 1.0, 1.2, 1.4, 1.402, 1.404, 2.0]
LOADS = [0.0, 0.0, 500.0, 0.0, 0.0, 20.0, 0.0, -300.0, 0.0, 0.0]


class Shock(Motion):
    """A load from a table, with two shocks of 4 ms in it."""

    lasts = 2.0
    x = State("m")
    v = State("m/s")
    m = Part(2.0, "kg", "mass")
    c = Part(200.0, "N/m", "spring")
    b = Part(4.0, "N s/m", "damper")
    f = Part(1.0, "1", "factor of the load")
    peak = Response.peak("m", "largest deflection")

    def motion(self, t, y, p):
        F = p.f * np.interp(t, TIMES, LOADS)
        return {"x": y.v, "v": (F - p.b * y.v - p.c * y.x) / p.m, "peak": y.x}
