"""Thirteen models typed as rates with kinks, and three smooth ones: what is named."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat.integrator.branches import unnamed_branches
from tolstat.integrator.problem import System

TABLE = np.linspace(0.0, 2 * np.pi, 13), [0, 0, 0, 1, 3, 6, 8, 6, 3, 1, 0, 0, 0]
SHOCK = [0.0, 0.5, 0.502, 0.504, 2.0], [0.0, 0.0, 500.0, 0.0, 0.0]


def stop(t, y, p):
    return y[1], np.where(y[0] < -p[0], p[1] * (-p[0] - y[0]), 0.0) - y[0]


def motor(t, y, p):
    return (np.where(y[0] < 100.0, 10.0 + 0.02 * y[0], 24.0 - 0.12 * y[0]) / p[0],)


def table_of(x, places, heights):
    height = 0.0 * x
    for i in range(len(places) - 1):
        slope = (heights[i + 1] - heights[i]) / (places[i + 1] - places[i])
        line = heights[i] + slope * (x - places[i])
        height = np.where((x >= places[i]) & (x < places[i + 1]), line, height)
    return height


def cam(t, y, p):
    turn = 25.0 * t
    angle = 2 * np.pi * (turn - np.floor(turn))
    return y[1], p[0] * (table_of(angle, *TABLE) - y[0])


def belt(t, y, p):
    s = y[1] - 0.1
    rest = np.where(s > 0.0, -1.0, np.where(s < 0.0, 1.0, 0.0))
    return y[1], rest * p[0] * (1.0 + 0.5 * np.exp(-np.abs(s) / 0.05)) - y[0]


def gear(t, y, p):
    x, g = y[0], p[0]
    F = np.where(x > g, p[1] * (x - g), np.where(x < -g, p[1] * (x + g), 0.0))
    return y[1], 3.0 * np.cos(300.0 * t) - F


def pulses(t, y, p):
    on = ((t > 0.3) & (t < 0.305)) | ((t > 0.9) & (t < 0.905))
    return y[1], np.where(on, p[0], 0.0) - y[0]


def shock(t, y, p):
    return y[1], p[0] * table_of(t, *SHOCK) - y[0]


def servo(t, y, p):
    wish = p[0] * (1e-3 - y[0]) - p[1] * y[1]
    return y[1], np.where(wish > 15.0, 15.0, np.where(wish < -15.0, -15.0, wish))


def pendulum(t, y, p):
    return y[1], -np.sin(y[0]) + np.where(y[0] < -p[0], -p[1] * (p[0] + y[0]), 0.0)


def brake(t, y, p):
    return y[1], np.where(y[1] > 0.0, -p[0], np.where(y[1] < 0.0, p[0], 0.0))


def clutch(t, y, p):
    s = y[0] - y[1]
    torque = np.where(s > 0.0, p[0], np.where(s < 0.0, -p[0], 0.0))
    torque = np.where(t > 1.0, torque, 0.0)
    return 5.0 - torque, torque - 0.05 * y[1]


def thermostat(t, y, p):
    aim = np.where(y[0] < 19.5, 1.0, np.where(y[0] > 20.5, 0.0, y[1]))
    return p[0] * y[1] - p[1] * (y[0] - 5.0), 1e3 * (aim - y[1])


def cylinder(t, y, p):
    drop = 20e5 - y[2]
    size = np.where(drop > 0.0, np.sqrt(np.abs(drop)), -np.sqrt(np.abs(drop)))
    F = np.where(y[0] > p[0], p[1] * (y[0] - p[0]), 0.0)
    return y[1], y[2] - F, size - y[1]


def flight(t, y, p):
    v = np.sqrt(y[2] * y[2] + y[3] * y[3])
    return y[2], y[3], -p[0] * v * y[2], -9.81 - p[0] * v * y[3]


def chain(t, y, p):
    return y[1], p[0] * (np.tanh(y[0]) - y[1])


def four_bar(t, y, p):
    return y[1], p[0] * np.cos(y[0]) / (1.0 + p[1] * np.sin(y[0]))


KINKED = [
    stop, motor, cam, belt, gear, pulses, shock, servo, pendulum, brake, clutch,
    thermostat, cylinder,
]  # fmt: skip


def lines_of(function, **options):
    def rates(moment, y, p, out):
        for i, value in enumerate(function(moment[0], y, p)):
            out[i] = value

    states = {motor: 1, cylinder: 3, flight: 4}.get(function, 2)
    return unnamed_branches(System(rates, np.ones(states)), 2, **options)


@pytest.mark.parametrize("function", KINKED)
def test_every_kinked_model_is_named_with_its_line(function):
    first = function.__code__.co_firstlineno
    source = (table_of.__code__ if function in (cam, shock) else None) or (
        function.__code__
    )
    numbers = {line for *_, line in source.co_lines() if line}
    lines = lines_of(function)
    assert lines and first
    assert any(int(line.rpartition(" ")[2]) in numbers for line in lines)
    assert all(line.startswith("test_kinked_models.py, line ") for line in lines)


@pytest.mark.parametrize("function", [flight, chain, four_bar])
def test_no_smooth_model_is(function):
    assert lines_of(function) == lines_of(function, bends=True) == ()
