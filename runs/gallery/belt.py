"""A block on a belt sticks and slips."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State


class Belt(Motion):
    """A block on a belt sticks and slips."""

    lasts = 10.0
    x = State("m")
    v = State("m/s")
    m = Part(2.0, "kg", "block")
    k = Part(50.0, "N/m", "spring")
    F = Part(6.0, "N", "friction of fast sliding")
    pull = Response.greatest("N", "force of the spring")
    lost = Response.integral("J", "energy lost by friction")

    def motion(self, t, y, p):
        s = y.v - 0.1
        R = -p.F * np.sign(s) * (1.0 + 0.5 * np.exp(-np.abs(s) / 0.05))
        pull = p.k * y.x
        return {"x": y.v, "v": (R - pull) / p.m, "pull": pull, "lost": -R * s}
