"""A cam follower on a lift table."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State

PLACES = np.linspace(0.0, 2.0 * np.pi, 13)
LIFTS = 1e-3 * np.array([0, 0, 0, 0.5, 2.5, 5.5, 8.0, 5.5, 2.5, 0.5, 0, 0, 0])


class Cam(Motion):
    """A cam follower on a lift table."""

    lasts = 0.12
    x = State("m")
    v = State("m/s")
    m = Part(0.2, "kg", "follower")
    k = Part(4e5, "N/m", "contact")
    c = Part(5e3, "N/m", "spring")
    b = Part(40.0, "N s/m", "damper")
    force = Response.greatest("N", "force of the contact")

    def motion(self, t, y, p):
        lift = np.interp((157.0 * t) % (2.0 * np.pi), PLACES, LIFTS)
        F = p.k * (lift - y.x)
        return {"x": y.v, "v": (F - p.b * y.v - p.c * y.x) / p.m, "force": F}
