"""A clutch closes at 1 s, slips and locks."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State


class Clutch(Motion):
    """A clutch closes at 1 s, slips and locks."""

    lasts = 4.0
    w1 = State("rad/s", start=100.0)
    w2 = State("rad/s")
    J1 = Part(0.5, "kg m^2", "motor")
    J2 = Part(1.0, "kg m^2", "load")
    T = Part(60.0, "N m", "torque of the clutch that slips")
    speed = Response.end("rad/s", "speed of the load at the end")
    lost = Response.integral("J", "heat of the clutch")
    slip_time = Response.above("s", "time of slipping")

    def motion(self, t, y, p):
        s = y.w1 - y.w2
        C = np.where(t > 1.0, p.T * np.sign(s), 0.0)
        return {
            "w1": (5.0 - C) / p.J1,
            "w2": (C - 0.05 * y.w2) / p.J2,
            "speed": y.w2,
            "lost": C * s,
            "slip_time": s,
        }
