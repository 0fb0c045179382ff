"""A heater with a hysteresis of 1 K."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State, memory


class Thermostat(Motion):
    """A heater with a hysteresis of 1 K."""

    lasts = 3600.0
    T = State("1", start=15.0, sentence="temperature, deg C")
    P = Part(2000.0, "W", "heater")
    C = Part(4e5, "J", "heat for 1 K")
    G = Part(60.0, "W", "loss for 1 K")
    energy = Response.integral("J", "energy of the heater")
    warmest = Response.greatest("1", "highest temperature")

    def motion(self, t, y, p):
        on = memory(y.T < 19.5, y.T > 20.5)
        heat = np.where(on, p.P, 0.0)
        return {"T": (heat - p.G * (y.T - 5.0)) / p.C, "energy": heat, "warmest": y.T}
