"""A mass on a spring hits a stop, whose damper cannot pull."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State, contact


class Stop(Motion):
    """A mass on a spring hits a stop."""

    lasts = 2.0
    x = State("m", start=0.1, size=0.1)
    v = State("m/s", size=1.0)
    m = Part(2.0, "kg", "mass")
    k = Part(200.0, "N/m", "spring")
    g = Part(0.05, "m", "gap")
    ks = Part(1e5, "N/m", "stiffness of the stop")
    bs = Part(100.0, "N s/m", "its damping")
    force = Response.peak("N", "force of the stop")
    lost = Response.integral("J", "energy lost in it")

    def motion(self, t, y, p):
        F = contact(-p.g - y.x, -y.v, stiffness=p.ks, damping=p.bs)
        lost = np.where(F > 0.0, p.bs * y.v**2, 0.0)
        return {"x": y.v, "v": (F - p.k * y.x) / p.m, "force": F, "lost": lost}
