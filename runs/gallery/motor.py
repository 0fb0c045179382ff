"""A motor with a torque curve runs up."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State


class Motor(Motion):
    """A motor with a torque curve runs up."""

    lasts = 6.0
    w = State("rad/s")
    J = Part(0.1, "kg m^2", "inertia")
    f = Part(1.0, "1", "factor of the torque")
    time_to_190 = Response.above("s", "time to 190 rad/s")
    end = Response.end("rad/s", "speed at the end")

    def motion(self, t, y, p):
        torque = p.f * np.interp(y.w, [0.0, 100.0, 200.0], [10.0, 12.0, 0.0])
        return {"w": torque / p.J, "time_to_190": 190.0 - y.w, "end": y.w}
