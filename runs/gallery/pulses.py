"""Three short pushes on an oscillator."""

from tolstat.moving import Motion, Part, Response, State


class Pulses(Motion):
    """Three short pushes on an oscillator."""

    lasts = 2.0
    x = State("m")
    v = State("m/s")
    m = Part(2.0, "kg", "mass")
    c = Part(200.0, "N/m", "spring")
    b = Part(1.0, "N s/m", "damper")
    F = Part(200.0, "N", "push")
    peak = Response.peak("m", "largest deflection")

    def motion(self, t, y, p):
        push = sum((t > at) & (t < at + 0.005) for at in (0.3, 0.9, 1.5)) * p.F
        return {"x": y.v, "v": (push - p.b * y.v - p.c * y.x) / p.m, "peak": y.x}
