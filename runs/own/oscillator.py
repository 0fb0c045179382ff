"""A damped oscillator that is pushed: a machine that moves, on tolstat's integrator.

tolstat run runs/own/oscillator.toml --machine runs/own/oscillator.py:Oscillator
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tolstat import (
    Axis,
    Chart,
    Contributor,
    Curve,
    Description,
    History,
    Model,
    Outcome,
    Response,
    setting,
)
from tolstat.moving import (
    Accuracy,
    System,
    compiled,
    integrate,
    named,
    rates_signature,
    rows,
    write,
)


class State(NamedTuple):
    x: float
    v: float


class Machine(NamedTuple):
    m: float
    b: float
    c: float
    F: float


@compiled(rates_signature)
def rates(moment, y, p, out):
    """Fill x', x'' of m x'' + b x' + c x = F; the power lost; what has a peak: x."""
    x, v = named(State, y)
    m, b, c, F = named(Machine, p)
    push = np.where(rows(moment)[1] == 0.0, F, 0.0)  # in the first phase alone
    write(out, 0, (v, (push - b * v - c * x) / m, b * v * v, x))


SYSTEM = System(rates, np.array([1e-3, 0.1]), n_quadratures=1, n_extremes=1)


@dataclass(frozen=True)
class Settings:
    push: float = setting(100.0, "force of the push", unit="N", above=0.0)
    length: float = setting(0.02, "how long it lasts", unit="s", above=0.0)
    horizon: float = setting(0.5, "how long one looks", unit="s", above=0.0)
    rtol: float = setting(1e-6, "integration tolerance", above=0.0)
    max_step: float = setting(1e-2, "longest step", unit="s", above=0.0)


class Oscillator(Model):
    name = "oscillator"
    title = "damped oscillator of 2 kg on 8 kN/m, pushed"
    settings = Settings
    failures = {"cannot be built": "mass and stiffness are above 0, damping not below"}

    def describe(self, settings):
        parts = ("mass", "m"), ("damping", "b"), ("stiffness", "c")
        return Description(
            tuple(Contributor(name, "1", letter) for name, letter in parts),
            (
                Response("peak", "m", "x", "peak displacement"),
                Response("lost", "J", "E", "energy lost in the damper"),
                Response("frequency", "Hz", "f", "natural frequency without damping"),
            ),
        )

    def impossible(self, deviations, settings):
        mass, damping, stiffness = 1 + deviations.T
        built = (mass > 0) & (stiffness > 0) & (damping >= 0)
        return {"cannot be built": ~built}

    def evaluate(self, deviations, settings):
        return outcome_of(*solved(deviations, settings))

    def history(self, deviations, settings, step):
        time = np.arange(0.0, settings.horizon, step)
        machine, solution = solved(deviations[None, :], settings, time)
        x, v = solution.history[0].T
        position = Curve("peak", "m", "x", "position", x)
        speed = Curve("speed", "m/s", "v", "speed", v)
        chart = Chart(Axis("time", "s"), time, (position, speed))
        return History(chart, outcome_of(machine, solution))


def solved(deviations, settings, samples=None):
    """Integrate the machines of deviations[trial, contributor]."""
    nominal = np.array([2.0, 16.0, 8000.0])  # kg, N s/m, N/m
    push = np.full((len(deviations), 1), settings.push)
    machines = np.hstack([nominal * (1 + deviations), push])
    marks = np.tile([0.0, settings.length, settings.horizon], (len(machines), 1))
    start = np.zeros((len(machines), 2))
    accuracy = Accuracy(settings.rtol, settings.max_step)
    found = integrate(SYSTEM, start, machines, marks, accuracy, samples=samples)
    return machines, found


def outcome_of(machines, solution):
    """Arrange the responses as `describe` lists them."""
    m, _, c, _ = machines.T
    answers = (
        solution.peak[:, 0],
        solution.quadratures[:, -1, 0],
        np.sqrt(c / m) / (2 * np.pi),
    )
    return Outcome(np.stack(answers, axis=1), solution.status, solution.steps)
