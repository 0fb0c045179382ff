"""A ball bounces on a floor until it rests."""

from tolstat.moving import Motion, Part, Response, State, impact


class Ball(Motion):
    """A ball bounces on a floor until it rests."""

    lasts = 3.0
    h = State("m", start=lambda p: p.drop)
    v = State("m/s")
    bounces = State("1")
    drop = Part(1.0, "m", "height at the start")
    e = Part(0.8, "1", "restitution")
    height = Response.end("m", "height at the end")
    count = Response.end("1", "number of bounces")

    def motion(self, t, y, p):
        impact(y.h < 0.0, v=-p.e * y.v, bounces=y.bounces + 1.0)
        return {"h": y.v, "v": -9.81, "bounces": 0.0, "height": y.h, "count": y.bounces}
