"""A digital controller at 1 kHz moves a mass."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State, held, sampled


class Servo(Motion):
    """A digital controller at 1 kHz moves a mass."""

    lasts = 0.1
    x = State("m")
    v = State("m/s")
    area = State("m s", sentence="integral part of the controller")
    last = State("m", start=1e-3, sentence="error at the last sample")
    m = Part(1.0, "kg", "mass")
    kp = Part(2e4, "N/m", "proportional gain")
    ki = Part(2e5, "N/m/s", "integral gain")
    kd = Part(150.0, "N s/m", "derivative gain")
    overshoot = Response.greatest("m", "greatest position")
    force = Response.peak("N", "force of the drive")

    def motion(self, t, y, p):
        error = 1e-3 - y.x
        wish = p.kp * error + p.ki * y.area + p.kd * (error - y.last) / 1e-3
        F = held(np.clip(wish, -15.0, 15.0), every=1e-3)
        return {
            "x": y.v,
            "v": F / p.m,
            "area": sampled(y.area + 1e-3 * error, every=1e-3),
            "last": sampled(error, every=1e-3),
            "overshoot": y.x,
            "force": F,
        }
