"""A vehicle brakes on a slope, and is held there."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State


class Brake(Motion):
    """A vehicle brakes on a slope, and is held there."""

    lasts = 10.0
    x = State("m")
    v = State("m/s", start=20.0)
    m = Part(1000.0, "kg", "vehicle")
    F = Part(4000.0, "N", "force of the brakes")
    distance = Response.end("m", "braking distance")
    lost = Response.integral("J", "heat of the brakes")
    time = Response.above("s", "time to rest")

    def motion(self, t, y, p):
        R = -p.F * np.sign(y.v)
        return {
            "x": y.v,
            "v": R / p.m - 0.5,
            "distance": y.x,
            "lost": -R * y.v,
            "time": y.v,
        }
