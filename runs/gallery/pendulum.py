"""A pendulum hits a stop."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State


class Pendulum(Motion):
    """A pendulum hits a stop."""

    lasts = 5.0
    a = State("rad", start=1.0, size=1.0)
    w = State("rad/s", size=3.0)
    l = Part(1.0, "m", "length")
    s = Part(0.3, "rad", "angle of the stop")
    k = Part(1e5, "1/s^2", "its stiffness")
    b = Part(50.0, "1/s", "its damping")
    moment = Response.peak("rad/s^2", "moment of the stop over the inertia")

    def motion(self, t, y, p):
        M = np.where(y.a < -p.s, p.k * (-p.s - y.a) - p.b * y.w, 0.0)
        return {"a": y.w, "w": -9.81 / p.l * np.sin(y.a) + M, "moment": M}
