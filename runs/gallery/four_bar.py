"""A crank drives a rocker by a coupler; the rocker carries a load."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State


class FourBar(Motion):
    """A crank drives a rocker by a coupler."""

    lasts = 1.0
    a = State("rad", sentence="angle of the crank")
    w = State("rad/s", start=20.0)
    crank = Part(0.1, "m", "crank")
    coupler = Part(0.3, "m", "coupler")
    rocker = Part(0.25, "m", "rocker")
    base = Part(0.3, "m", "between the fixed joints")
    J = Part(0.05, "kg m^2", "crank and flywheel")
    T = Part(5.0, "N m", "load of the rocker, against its motion")
    swing = Response.greatest("rad", "greatest angle of the rocker")
    slowest = Response.least("rad/s", "lowest speed of the crank")

    def motion(self, t, y, p):
        u, h = p.base - p.crank * np.cos(y.a), p.crank * np.sin(y.a)
        far = np.hypot(u, h)
        bend = np.arccos((p.rocker**2 + far**2 - p.coupler**2) / (2.0 * p.rocker * far))
        b = np.pi - np.arctan(h / u) - bend
        # of the coupler, and the transmission db/da
        c = np.arctan2(
            p.rocker * np.sin(b) - p.crank * np.sin(y.a),
            p.base + p.rocker * np.cos(b) - p.crank * np.cos(y.a),
        )
        i = p.crank * np.sin(y.a - c) / (p.rocker * np.sin(b - c))
        load = p.T * np.sign(i * y.w)
        return {"a": y.w, "w": (2.0 - load * i) / p.J, "swing": b, "slowest": y.w}
