"""Jumps that the state triggers: relay, stick and slip, stop, backlash, impact.

Each is compared with SciPy's DOP853, which ends at each event and begins again behind
it, phase by phase.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.integrator.phases import END, by_phases, event, same
from tolstat.integrator.crossing import dry_friction
from tolstat.integrator.integrate import integrate
from tolstat.integrator.problem import SIDES, Accuracy, System
from tolstat.integrator.signatures import rates_signature
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows, write
from tolstat.status import Status

RTOL = 10.0 ** -np.arange(3, 10)


def errors(system, start, p, longest=0.1):
    """The states at the end, by rtol, and the steps."""
    found = [
        integrate(system, np.array([start]), np.array([p]), np.array([[0.0, END]]),
                  Accuracy(rtol, longest))
        for rtol in RTOL
    ]  # fmt: skip
    assert all(each.status[0] == Status.DONE for each in found)
    return np.array([each.states[0, -1] for each in found]), found


def check(system, start, p, reference):
    states, found = errors(system, start, p)
    off = np.abs(states - reference).max(axis=1)
    np.testing.assert_array_less(off, 10 * RTOL, err_msg=f"{off}")
    assert found[0].steps[0] < 1500


@compiled(rates_signature)
def relay(moment, y, p, out):
    """An oscillator that a relay with the sign of x drives: x'' = -x - 0.1 x' - s."""
    x, v = rows(y)[0], rows(y)[1]
    side = rows(moment)[SIDES]
    write(out, 0, (v, -x - 0.1 * v + rows(p)[0] * side, x))


def test_relay():
    drive = 0.3
    system = System(relay, np.ones(2), n_extremes=1, crossings=(0,))

    def rates(s):
        return lambda t, y: (y[1], -y[0] - 0.1 * y[1] + s * drive)

    phases = {
        "above": (rates(1), {"below": (event(lambda t, y: y[0], -1), same)}),
        "below": (rates(-1), {"above": (event(lambda t, y: y[0], 1), same)}),
    }
    check(system, [1.0, 0.0], [drive], by_phases(phases, "above", [1.0, 0.0]))


@compiled(rates_signature)
def belt(moment, y, p, out):
    """A block on a belt of speed p0, on a spring: static friction p1, sliding p2."""
    x, v = rows(y)[0], rows(y)[1]
    speed, most, sliding = rows(p)[0], rows(p)[1], rows(p)[2]
    slips, grips = rows(moment)[SIDES], rows(moment)[SIDES + 1]
    friction = dry_friction(slips, grips, -x, sliding)
    write(out, 0, (v, friction - x, v - speed, most - np.abs(x)))


def test_stick_and_slip():
    speed, most, sliding = 0.5, 1.0, 0.6
    system = System(belt, np.ones(2), n_extremes=2, crossings=(0, 1))
    phases = {
        "sticks": (
            lambda t, y: (speed, 0.0),
            {"slips": (event(lambda t, y: most - abs(y[0]), -1), same)},
        ),
        "slips": (
            lambda t, y: (y[1], sliding - y[0]),
            {"sticks": (event(lambda t, y: y[1] - speed, 1), same)},
        ),
    }
    reference = by_phases(phases, "sticks", [0.0, speed])
    check(system, [0.0, speed], [speed, most, sliding], reference)


@compiled(rates_signature)
def stop(moment, y, p, out):
    """A mass on a spring against a stop with spring and damper; work of the contact."""
    x, v = rows(y)[0], rows(y)[1]
    touches = rows(moment)[SIDES] < 0.0
    force = np.where(touches, -rows(p)[0] * x - rows(p)[1] * v, 0.0)
    write(out, 0, (v, force - 0.2 * (x - 1.0), force * v, x))


def test_a_stop_with_spring_and_damper():
    k, b = 50.0, 4.0
    system = System(stop, np.ones(2), n_quadratures=1, n_extremes=1, crossings=(0,))

    def contact(t, y):
        force = -k * y[0] - b * y[1]
        return y[1], force - 0.2 * (y[0] - 1.0), force * y[1]

    phases = {
        "free": (
            lambda t, y: (y[1], -0.2 * (y[0] - 1.0), 0.0),
            {"touches": (event(lambda t, y: y[0], -1), same)},
        ),
        "touches": (contact, {"free": (event(lambda t, y: y[0], 1), same)}),
    }
    *reference, work = by_phases(phases, "free", [2.5, 0.0, 0.0])
    check(system, [2.5, 0.0], [k, b], np.array(reference))
    _, found = errors(system, [2.5, 0.0], [k, b])
    off = np.array([abs(each.quadratures[0, -1, 0] - work) for each in found])
    np.testing.assert_array_less(off, 10 * RTOL)


@compiled(rates_signature)
def backlash(moment, y, p, out):
    """A mass between two flanks, play p0: stiff and damped contact, driven."""
    t, x, v = rows(moment)[0], rows(y)[0], rows(y)[1]
    upper, lower = rows(moment)[SIDES], rows(moment)[SIDES + 1]
    beyond = np.where(upper > 0.0, x - rows(p)[0], 0.0)
    beyond = np.where(lower > 0.0, x + rows(p)[0], beyond)
    damper = np.where((upper > 0.0) | (lower > 0.0), 0.5 * v, 0.0)
    force = -40.0 * beyond - damper
    push = 0.8 * np.cos(1.3 * t)
    write(out, 0, (v, push + force, x - rows(p)[0], -x - rows(p)[0]))


def test_backlash():
    play = 0.4
    system = System(backlash, np.ones(2), n_extremes=2, crossings=(0, 1))

    def push(t):
        return 0.8 * np.cos(1.3 * t)

    def flank(s):
        return lambda t, y: (
            y[1], push(t) - 40.0 * (y[0] - s * play) - 0.5 * y[1]
        )  # fmt: skip

    phases = {
        "free": (
            lambda t, y: (y[1], push(t)),
            {
                "up": (event(lambda t, y: y[0] - play, 1), same),
                "down": (event(lambda t, y: y[0] + play, -1), same),
            },
        ),
        "up": (flank(1), {"free": (event(lambda t, y: y[0] - play, -1), same)}),
        "down": (flank(-1), {"free": (event(lambda t, y: y[0] + play, 1), same)}),
    }
    check(system, [0.0, 0.1], [play], by_phases(phases, "free", [0.0, 0.1]))


@compiled(rates_signature)
def ball(moment, y, p, out):
    """A ball falls on a floor, and rests there when it bounces no more."""
    height, v = rows(y)[0], rows(y)[1]
    rests = rows(moment)[SIDES] == 0.0
    write(out, 0, (np.where(rests, 0.0, v), np.where(rests, 0.0, -1.0), height))


@compiled(rates_signature)
def bounce(moment, y, p, out):
    """It leaves the floor with a share p0 of its speed, or rests."""
    height, v = rows(y)[0], rows(y)[1]
    up = -rows(p)[0] * v
    rests = up < 1e-7
    write(out, 0, (height, np.where(rests, 0.0, up), np.where(rests, 0.0, 1.0)))


BALL = System(ball, np.ones(2), n_extremes=1, crossings=(0,), jump=bounce)


def test_impact_with_restitution():
    share = 0.8
    floor = event(lambda t, y: y[0], -1)
    phases = {
        "even": (
            lambda t, y: (y[1], -1.0),
            {"odd": (floor, lambda y: np.array([0.0, -share * y[1]]))},
        )
    }
    phases["odd"] = (
        phases["even"][0],
        {"even": next(iter(phases["even"][1].values()))},
    )
    check(BALL, [2.0, 0.0], [share], by_phases(phases, "even", [2.0, 0.0]))


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_a_ball_that_bounces_endlessly_comes_to_rest(share):
    """Infinitely many bounces in a finite time: t = sqrt(2 h) (1 + e) / (1 - e)."""
    marks = np.array([[0.0, END]])
    found = integrate(BALL, np.array([[2.0, 0.0]]), np.array([[share]]), marks,
                      Accuracy(1e-6, 0.1))  # fmt: skip
    assert found.status[0] == Status.DONE
    assert found.steps[0] < 600
    assert found.states[0, -1, 0] == pytest.approx(0.0, abs=1e-6)
    assert found.least[0, 0] > -1e-9


@compiled(rates_signature)
def graze(moment, y, p, out):
    """What lies behind (t - 1)^2 = p0, or behind two dips."""
    t = rows(moment)[0]
    dips = np.where(rows(p)[1] > 1.0, (t - 0.7) * (t - 1.3), t - 1.0)
    gap = dips * dips - rows(p)[0]
    write(out, 0, (np.maximum(-gap, 0.0), gap))


@pytest.mark.parametrize("dips", [1.0, 2.0])
@pytest.mark.parametrize("start", [0.0, 0.013, 0.5])
def test_a_grazing_crossing_takes_few_steps(dips, start):
    system = System(graze, np.ones(1), n_extremes=1, crossings=(0,))
    eps = np.concatenate([[0.0], 10.0 ** -np.arange(2, 17)])
    p = np.column_stack([eps, np.full_like(eps, dips)])
    marks = np.tile([start, 2.0], (len(eps), 1))
    found = integrate(system, np.zeros((len(eps), 1)), p, marks, Accuracy(1e-6, 0.1))
    assert found.status.max() == Status.DONE
    assert found.steps.max() <= 60
    if dips == 1.0:
        exact = 4 / 3 * eps**1.5
        np.testing.assert_allclose(found.states[:, 1, 0], exact, rtol=1e-4, atol=1e-14)


@compiled(rates_signature)
def rest(moment, y, p, out):
    """A quantity that reaches zero, stays there and leaves it."""
    u = rows(moment)[0] - 1.0
    gap = np.maximum(u - rows(p)[0], 0.0) + rows(p)[1] * np.minimum(u + rows(p)[0], 0.0)
    write(out, 0, (np.maximum(-gap, 0.0), gap))


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_quantity_that_stays_on_zero_takes_few_steps(way):
    system = System(rest, np.ones(1), n_extremes=1, crossings=(0,))
    half = np.array([0.5, 0.3, 0.1, 0.01, 1e-3, 0.0])
    p = np.column_stack([half, np.full_like(half, way)])
    marks = np.tile([0.0, 2.0], (len(half), 1))
    found = integrate(system, np.zeros((len(half), 1)), p, marks, Accuracy(1e-6, 0.1))
    assert found.status.max() == Status.DONE
    assert found.steps.max() <= 60
    exact = (1 - half) ** 2 / 2 if way > 0 else np.zeros_like(half)
    np.testing.assert_allclose(found.states[:, 1, 0], exact, atol=1e-5)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.8, 1.0])
def test_a_ball_never_falls_through_the_floor(share):
    """Also from the floor, from a hair above it, and at speed."""
    height, v = np.meshgrid([0.0, 1e-16, 1e-12, 1e-10, 1e-6, 1.0], [0.0, -1e-3, -30.0])
    start = np.column_stack([height.ravel(), v.ravel()])
    n = len(start)
    found = integrate(BALL, start, np.full((n, 1), share), np.tile([0.0, END], (n, 1)),
                      Accuracy(1e-6, 0.1, 20_000))  # fmt: skip
    done = found.status == Status.DONE
    assert done.sum() >= n - 2 and (found.least[done] > -1e-6).all()


@compiled(rates_signature)
def decay(moment, y, p, out):
    """The side of what decays without crossing zero, summed up."""
    t, side = rows(moment)[0], rows(moment)[SIDES]
    gap = np.exp(-200.0 * t)
    write(out, 0, (0.0 * gap, side, gap))


def test_what_decays_to_zero_keeps_its_side():
    system = System(decay, np.ones(1), n_quadratures=1, n_extremes=1, crossings=(0,))
    found = integrate(system, np.zeros((1, 1)), np.zeros((1, 1)),
                      np.array([[0.0, 2.0]]), Accuracy(1e-6, 0.1))  # fmt: skip
    assert found.quadratures[0, -1, 0] == pytest.approx(2.0)


@compiled(rates_signature)
def hold(moment, y, p, out):
    """A relay drives x to zero with p0, and holds it there against a load up to p0."""
    t, x = rows(moment)[0], rows(y)[0]
    side, holds = rows(moment)[SIDES], rows(moment)[SIDES + 1]
    most, load = rows(p)[0], rows(p)[1] * np.sin(t)
    relay = dry_friction(side, holds, load, most)
    write(out, 0, (load + relay, x, most - np.abs(load)))


@pytest.mark.parametrize("ratio", [1.1, 1.5])
def test_a_relay_holds_and_releases(ratio):
    most, load = 0.3, 0.3 * ratio
    system = System(hold, np.ones(1), n_extremes=2, crossings=(0, 1))

    def moving(side, direction):
        leaves = {"held": (event(lambda t, y: y[0], direction), same)}
        return lambda t, y: (load * np.sin(t) - side * most,), leaves

    phases = {
        "above": moving(1, -1),
        "below": moving(-1, 1),
        "held": (
            lambda t, y: (0.0,),
            {
                "above": (event(lambda t, y: load * np.sin(t) - most, 1), same),
                "below": (event(lambda t, y: load * np.sin(t) + most, -1), same),
            },
        ),
    }
    check(system, [0.2], [most, load], by_phases(phases, "above", [0.2]))


@compiled(rates_signature)
def pushed(moment, y, p, out):
    """A block of 5 kg that p0 pushes; friction at rest p1, sliding p2; a flank, p3.

    The flank's force is part of the load that the friction may hold.
    """
    x, v = rows(y)[0], rows(y)[1]
    slips, grips = rows(moment)[SIDES], rows(moment)[SIDES + 1]
    touches = rows(moment)[SIDES + 2]
    load = rows(p)[0] + np.where(touches < 0.0, -rows(p)[3] * x, 0.0)
    friction = dry_friction(slips, grips, load, rows(p)[2])
    write(out, 0, (v, (load + friction) / 5.0, v, rows(p)[1] - np.abs(load), x))


PUSHED = System(pushed, np.array([0.1, 0.1]), n_extremes=3, crossings=(0, 1, 2))
PUSHES = np.array([0.0, 10.0, -10.0, 29.0, 35.0, -35.0, 40.0, 45.0, -45.0])
AT_REST, SLIDING = 40.7, 29.3


def test_a_part_at_rest_sticks_until_the_load_exceeds_the_friction_at_rest():
    """Also where the load exceeds the sliding friction, and behind an idle mark."""
    p = np.column_stack([PUSHES, *np.ones((3, 9)) * [[AT_REST], [SLIDING], [0.0]]])
    marks = np.tile([0.0, 0.07, 0.2], (9, 1))
    found = integrate(PUSHED, np.zeros((9, 2)), p, marks, Accuracy(1e-6, 0.002))
    a = np.sign(PUSHES) * np.maximum(np.abs(PUSHES) - SLIDING, 0.0) / 5.0
    a[np.abs(PUSHES) < AT_REST] = 0.0
    np.testing.assert_allclose(found.states[:, -1, 0], a / 2 * 0.2**2, atol=1e-9)
    np.testing.assert_allclose(found.states[:, -1, 1], a * 0.2, atol=1e-9)


def test_a_part_that_stops_sticks_if_friction_at_rest_can_hold_it():
    p = np.column_stack([PUSHES, *np.ones((3, 9)) * [[AT_REST], [SLIDING], [0.0]]])
    start = np.tile([0.0, 0.1], (9, 1))
    found = integrate(PUSHED, start, p, np.tile([0.0, 0.2], (9, 1)),
                      Accuracy(1e-6, 0.002))  # fmt: skip
    slows = (SLIDING - PUSHES) / 5.0  # while it slides forward
    stops = slows * 0.2 > 0.1
    sticks = stops & (np.abs(PUSHES) < AT_REST)
    assert sticks.sum() == 4
    x, v = found.states[:, -1].T
    np.testing.assert_allclose(x[sticks], 0.1**2 / 2 / slows[sticks], rtol=1e-6)
    np.testing.assert_allclose(v[sticks], 0.0, atol=1e-9)
    np.testing.assert_allclose(v[~stops], 0.1 - 0.2 * slows[~stops], rtol=1e-6)


def test_a_trial_does_not_begin_with_the_sides_of_the_one_before_it():
    """The grip depends on the side of the flank; a lane takes one trial after another.

    The first eight end in contact with the flank, the ninth is one of them again.
    """
    rng = np.random.default_rng(5)
    p = np.column_stack([rng.uniform(-60, 60, 40), np.full(40, AT_REST),
                         np.full(40, SLIDING), rng.uniform(2e3, 2e4, 40)])  # fmt: skip
    start = np.column_stack([rng.uniform(-0.01, 0.01, 40), rng.normal(0, 0.1, 40)])
    marks = np.tile([0.0, 0.3], (40, 1))
    every = integrate(PUSHED, start, p, marks, Accuracy(1e-6, 0.01))
    for i in range(40):
        one = slice(i, i + 1)
        alone = integrate(PUSHED, start[one], p[one], marks[one], Accuracy(1e-6, 0.01))
        np.testing.assert_array_equal(every.states[one], alone.states)
        np.testing.assert_array_equal(every.steps[one], alone.steps)
