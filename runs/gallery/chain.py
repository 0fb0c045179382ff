"""Five masses between stiff springs, pushed at one end."""

import numpy as np

from tolstat.moving import Motion, Part, Response, State


class Chain(Motion):
    """Five masses between stiff springs, pushed at one end."""

    lasts = 0.05
    x1, x2, x3, x4, x5 = (State("m") for _ in range(5))
    v1, v2, v3, v4, v5 = (State("m/s") for _ in range(5))
    m = Part(1.0, "kg", "each mass")
    k = Part(1e6, "N/m", "each spring")
    b = Part(20.0, "N s/m", "each damper")
    force = Response.peak("N", "force of the first spring")

    def motion(self, t, y, p):
        x = np.array([0.0, y.x1, y.x2, y.x3, y.x4, y.x5])
        v = np.array([0.0, y.v1, y.v2, y.v3, y.v4, y.v5])
        F = p.k * np.diff(x) + p.b * np.diff(v)
        push = np.where(t < 0.002, 1000.0, 0.0)
        rates = (np.array([*F[1:], push]) - F) / p.m
        names = range(1, 6)
        return {
            **{f"x{i}": v[i] for i in names},
            **{f"v{i}": rates[i - 1] for i in names},
            "force": F[0],
        }
