"""A cylinder with a valve drives a mass into its end cushion."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State, contact


class Cylinder(Motion):
    """A cylinder with a valve drives a mass into its end cushion."""

    lasts = 0.45
    x = State("m")
    v = State("m/s")
    q = State("Pa", start=1e5, sentence="pressure")
    m = Part(50.0, "kg", "mass")
    A = Part(2e-3, "m^2", "piston")
    stroke = Part(0.2, "m", "stroke")
    Q = Part(1e-3, "m^3/s", "flow of the valve at 10 bar")
    force = Response.peak("N", "force of the end stop")
    time = Response.above("s", "time to the stop")

    def motion(self, t, y, p):
        drop = 20e5 - y.q
        turbulent = np.sign(drop) * np.sqrt(np.abs(drop) / 1e6)
        flow = p.Q * np.where(np.abs(drop) > 1e4, turbulent, drop / 1e5)
        F = contact(y.x - p.stroke, y.v, stiffness=1e7, damping=2e4)
        return {
            "x": y.v,
            "v": ((y.q - 1e5) * p.A - 500.0 * y.v - F) / p.m,
            "q": 1e9 * (flow - p.A * y.v) / (1e-4 + p.A * y.x),
            "force": F,
            "time": p.stroke - y.x,
        }
