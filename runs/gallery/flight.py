"""A ball is thrown and flies until it lands."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State, ends


class Flight(Motion):
    """A ball is thrown and flies until it lands."""

    lasts = 10.0
    x = State("m")
    h = State("m")
    u = State("m/s", start=lambda p: p.v0 * np.cos(p.angle))
    w = State("m/s", start=lambda p: p.v0 * np.sin(p.angle))
    v0 = Part(30.0, "m/s", "speed")
    angle = Part(0.7, "rad", "angle")
    c = Part(0.01, "1/m", "drag")
    range = Response.end("m", "range")
    time = Response.end("s", "time of flight")

    def motion(self, t, y, p):
        ends(y.h < 0.0)
        v = np.hypot(y.u, y.w)
        return {
            "x": y.u,
            "h": y.w,
            "u": -p.c * v * y.u,
            "w": -9.81 - p.c * v * y.w,
            "range": y.x,
            "time": t,
        }
