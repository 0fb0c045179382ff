"""Impacts: restitution, rest, a floor that moves, two bodies, counters."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tolstat
from tolstat.errors import ModelError
from tolstat.moving import Motion, Part, Response, State, impact


class Ball(Motion):
    """A ball bounces on a floor."""

    lasts = 3.0
    h = State("m", start=1.0)
    v = State("m/s")
    n = State("1")
    e = Part(0.8, "1", "restitution")
    height = Response.end("m")
    bounces = Response.end("1")

    def motion(self, t, y, p):
        impact(y.h < 0.0, v=-p.e * y.v, n=y.n + 1.0)
        return {"h": y.v, "v": -9.81, "n": 0.0, "height": y.h, "bounces": y.n}


def bounced(e):
    """Return height and number of bounces after 3 s."""
    t, v, n = math.sqrt(2.0 / 9.81), e * math.sqrt(2.0 * 9.81), 1
    while v > 1e-9 and t + 2.0 * v / 9.81 <= 3.0:
        t, v, n = t + 2.0 * v / 9.81, e * v, n + 1
    left = 3.0 - t
    return (v * left - 9.81 * left**2 / 2.0 if v > 1e-9 else 0.0), n


def test_a_ball_bounces_as_computed_by_hand():
    shares = np.array([0.76, 0.8, 0.9, 1.0])
    frame = tolstat.evaluate(Ball, {"e": shares - 0.8}, {})
    known = np.array([bounced(e) for e in shares])
    np.testing.assert_allclose(frame[["height", "bounces"]], known, atol=1e-9)


def test_endless_bounces_end_at_rest():
    frame = tolstat.evaluate(Ball, {"e": np.array([0.0, 0.1, 0.5]) - 0.8}, {})
    assert (frame["status"] == "done").all() and frame["steps"].max() < 300
    assert frame["height"].abs().max() < 1e-9
    assert frame["bounces"][0] == 1.0


class Table(Motion):
    """A ball bounces and rests on a table that shakes, and is thrown up by it."""

    lasts = 3.0
    h = State("m", start=0.05)
    v = State("m/s")
    e = Part(0.3, "1", "restitution")
    height = Response.end("m")
    lost = Response.least("m", "distance")

    def motion(self, t, y, p):
        z, u = 0.01 * np.sin(40.0 * t), 0.4 * np.cos(40.0 * t)
        impact(y.h < z, v=u - p.e * (y.v - u))
        return {"h": y.v, "v": -9.81, "height": y.h, "lost": y.h - z}


def by_small_steps(e, n=600_000):
    dt, h, v = 3.0 / n, 0.05, 0.0
    for i in range(n):
        t = (i + 1) * dt
        v -= 9.81 * dt
        h += v * dt
        z, u = 0.01 * math.sin(40.0 * t), 0.4 * math.cos(40.0 * t)
        if h < z:
            h = z
            if v < u:
                v = u - e * (v - u) if u - v > 1e-3 else u
    return h


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_rest_on_what_moves(rtol):
    (row,) = tolstat.evaluate(Table, {}, {"rtol": rtol}).itertuples()
    assert row.height == pytest.approx(by_small_steps(0.3), rel=2e-3)
    assert row.height == pytest.approx(0.00580611184, rel=rtol)
    assert row.lost > -0.05 * rtol


class Pair(Motion):
    """One ball hits another one; a third state is halved where they pass 2 m."""

    lasts = 2.0
    x1 = State("m")
    x2 = State("m", start=1.0)
    v1 = State("m/s", start=2.0)
    v2 = State("m/s")
    passed = State("1", start=1.0)
    m1 = Part(1.0, "kg")
    m2 = Part(3.0, "kg")
    e = Part(0.5, "1")
    first = Response.end("m")
    second = Response.end("m")
    share = Response.end("1")

    def motion(self, t, y, p):
        s = (1.0 + p.e) * (y.v1 - y.v2) / (p.m1 + p.m2)
        impact(y.x1 > y.x2, v1=y.v1 - s * p.m2, v2=y.v2 + s * p.m1)
        impact(y.x2 > 2.0, passed=0.5 * y.passed)
        rates = {"x1": y.v1, "x2": y.v2, "v1": 0.0, "v2": 0.0, "passed": 0.0}
        return rates | {"first": y.x1, "second": y.x2, "share": y.passed}


def test_two_bodies_and_a_state_that_jumps_once():
    e = np.array([0.5, 1.0, 0.0])
    frame = tolstat.evaluate(Pair, {"e": e - 0.5}, {})
    v2 = (1.0 + e) * 2.0 / 4.0
    v1 = 2.0 - 3.0 * v2
    np.testing.assert_allclose(frame["first"], 1.0 + 1.5 * v1, atol=1e-9)
    np.testing.assert_allclose(frame["second"], 1.0 + 1.5 * v2, atol=1e-9)
    np.testing.assert_array_equal(frame["share"], [0.5, 0.5, 1.0])


def test_a_wrong_impact_is_a_sentence():
    def motion(self, t, y, p, condition=lambda y: y.h < 0.0, name="w"):
        impact(condition(y), **{name: 0.0})
        return {"h": y.v, "v": -9.81, "n": 0.0, "height": y.h, "bounces": y.n}

    with pytest.raises(ModelError, match="no state is called w"):
        type("Tried", (Ball,), {"motion": motion})
    with pytest.raises(ModelError, match="takes one comparison of a state"):
        type(
            "Tried",
            (Ball,),
            {"motion": lambda s, t, y, p: motion(s, t, y, p, lambda y: t > 1.0, "v")},
        )
    with pytest.raises(ModelError, match="impact needs states and their values"):
        type("Tried", (Ball,), {"motion": lambda s, t, y, p: impact(y.h < 0.0)})
