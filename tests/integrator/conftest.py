"""Toy systems: known answers, jumps, failures."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat.integrator.problem import Step, System
from tolstat.integrator.signatures import rates_signature
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows, write
from tolstat.lanes.vector import WIDTH


def pendulum_rates(t, y, p):
    """A driven, damped pendulum in plain NumPy; works compiled and uncompiled."""
    angle, speed = y[0], y[1]
    return speed, -p[0] * np.sin(angle) - p[1] * speed + p[2] * np.cos(3.0 * t)


pendulum_on_lanes = compiled()(pendulum_rates)


@compiled(rates_signature)
def pendulum(moment, y, p, out):
    write(out, 0, pendulum_on_lanes(rows(moment)[0], rows(y), rows(p)))


def step_of(**given):
    """Return the arrays of a step: those given, and nothing else."""
    empty = {name: np.zeros((0, WIDTH)) for name in Step._fields}
    empty |= dict.fromkeys(("crossings", "damped", "sloped"), np.zeros(0, np.int64))
    return Step(**(empty | given))


@compiled(rates_signature)
def oscillator(moment, y, p, out):
    """X'' = -p x; the work integral of x'^2; watched: x, and x above p[1]."""
    Y, P = rows(y), rows(p)
    write(out, 0, (Y[1], -P[0] * Y[0], Y[1] * Y[1], Y[0], Y[0] - P[1]))


@compiled(rates_signature)
def oscillator_watch(moment, y, p, out):
    Y, P = rows(y), rows(p)
    write(out, 0, (Y[0], Y[0] - P[1]))


@compiled(rates_signature)
def blow_up(moment, y, p, out):
    """Y' = y^2 reaches infinity at t = 1/y(0); p > 0 makes the rate a square root."""
    Y, P = rows(y), rows(p)
    write(out, 0, (np.where(P[0] > 0.0, np.sqrt(1.0 - Y[0]), Y[0] * Y[0]),))


@compiled(rates_signature)
def kick(moment, y, p, out):
    """Rate of y that jumps to p at t = 0.5, unannounced; the integral of y."""
    t, Y, P = rows(moment)[0], rows(y), rows(p)
    write(out, 0, (np.where(t > 0.5, P[0], 0.0), Y[0]))


@pytest.fixture
def kick_system():
    return System(kick, np.array([1.0]), n_quadratures=1)


@pytest.fixture
def oscillator_system():
    return System(
        oscillator,
        np.array([1.0, 1.0]),
        oscillator_watch,
        n_quadratures=1,
        n_extremes=1,
        n_above=1,
    )


@pytest.fixture
def blow_up_system():
    return System(blow_up, np.array([1.0]))


def rubbing_rates(t, y, p):
    """A pushed pendulum with friction; p[2] of the lambda of its speed is named."""
    angle, speed = y[0], y[1]
    slip = p[1] * speed
    friction = p[0] * np.arctan(slip)
    relaxation = p[2] * p[0] * p[1] / (1.0 + slip * slip)
    return speed, np.cos(3.0 * t) - np.sin(angle) - friction, relaxation


rubbing_on_lanes = compiled()(rubbing_rates)


@compiled(rates_signature)
def rubbing(moment, y, p, out):
    write(out, 0, rubbing_on_lanes(rows(moment)[0], rows(y), rows(p)))


@pytest.fixture
def damped_system():
    return System(rubbing, np.array([1.0, 1.0]), damped=(1,))


@pytest.fixture
def undamped_system():
    return System(rubbing, np.array([1.0, 1.0]), n_quadratures=1)
