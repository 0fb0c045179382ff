"""Models whose steps miss something short, and their right values in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tolstat import Contributor, Description, Model, Outcome, Response, setting
from tolstat.moving import (
    Accuracy,
    System,
    compiled,
    integrate,
    rates_signature,
    rows,
    write,
)

HORIZON = 2.0  # s


@dataclass(frozen=True)
class Settings:
    rtol: float = setting(1e-6, "integration tolerance", above=0.0)
    max_step: float = setting(0.5, "longest step", unit="s", above=0.0)


@compiled(rates_signature)
def pushed(moment, y, p, out):
    """Y' = -c y, and a push 1/w for the time w from 1 s on."""
    t, c, w = rows(moment)[0], rows(p)[0], rows(p)[1]
    push = np.where((t > 1.0) & (t < 1.0 + w), 1.0 / w, 0.0)
    write(out, 0, (push - c * rows(y)[0],))


@compiled(rates_signature)
def controlled(moment, y, p, out):
    """A drift, and a controller that removes it within 20 ms of each second."""
    t, speed = rows(moment)[0], rows(p)[0]
    phase = t - np.floor(t)
    acts = (phase > 0.67) & (phase < 0.69)
    write(out, 0, (np.where(acts, 49.0 * speed, -speed),))


@compiled(rates_signature)
def toothed(moment, y, p, out):
    """The angle turns evenly; a table has one tooth of area 1 at angle 1, wide w."""
    angle, speed, w = rows(y)[0], rows(p)[0], rows(p)[1]
    tooth = np.maximum(0.0, 1.0 - np.abs(angle - 1.0) / w) / w
    write(out, 0, (speed, tooth))


@compiled(rates_signature)
def braked(moment, y, p, out):
    """A mass touches a brush from 1 m to 1 m + w; it takes the energy a w per mass."""
    x, v, w, a = rows(y)[0], rows(y)[1], rows(p)[0], rows(p)[1]
    write(out, 0, (v, np.where((x > 1.0) & (x < 1.0 + w), -a, 0.0)))


@compiled(rates_signature)
def swung(moment, y, p, out):
    """An oscillator."""
    x, v, w = rows(y)[0], rows(y)[1], rows(p)[0]
    write(out, 0, (v, -w * w * x))


class Short(Model):
    """A system of one deviation `d` and one response `end`."""

    settings = Settings
    rates, scale, start, column = pushed, (1.0,), (1.0,), 0

    def describe(self, settings):
        return Description((Contributor("d", "1"),), (Response("end", "1", shown="1"),))

    def parameters(self, d):
        return ()

    def evaluate(self, deviations, settings):
        n, d = len(deviations), deviations[:, 0]
        kind = type(self)
        system = System(kind.__dict__["rates"], np.array(self.scale))
        parameters = [np.broadcast_to(x, n) for x in self.parameters(d)]
        found = integrate(
            system, np.tile(self.start, (n, 1)), np.column_stack(parameters),
            np.tile([0.0, HORIZON], (n, 1)), Accuracy(settings.rtol, settings.max_step),
        )  # fmt: skip
        column = found.states[:, -1, self.column]
        return Outcome(column[:, None], found.status, found.steps)


class Pulse(Short):
    """A push of 10 ms between steps of half a second."""

    name, width = "pulse", 0.01
    rates = pushed

    def parameters(self, d):
        return 1.0 + d, self.width * (1.0 + d)

    def truth(self, d):
        c, w = self.parameters(d)
        return np.exp(-c * HORIZON) + (
            np.exp(-c * (HORIZON - 1 - w)) - np.exp(-c * (HORIZON - 1))
        ) / (c * w)


class ShortPulse(Pulse):
    """A push that nearly all trials miss."""

    name, width = "short_pulse", 1e-3
    rates = pushed


class Controller(Short):
    """A sampled controller that steps of half a second do not meet."""

    name = "controller"
    rates, start = controlled, (0.0,)

    def parameters(self, d):
        return (0.875 * (1.0 + d),)

    def truth(self, d):
        return np.zeros_like(d)


class Tooth(Short):
    """A narrow tooth in a table of the angle."""

    name = "tooth"
    rates, scale, start, column = toothed, (1.0, 1.0), (0.0, 0.0), 1

    def parameters(self, d):
        return 1.0 + d, 0.004

    def truth(self, d):
        return 1.0 / (1.0 + d)


class Brush(Short):
    """A contact of two milliseconds."""

    name = "brush"
    rates, scale, start, column = braked, (1.0, 1.0), (0.0, 1.0), 1

    def parameters(self, d):
        return 2e-3 * (1.0 + d), 150.0

    def truth(self, d):
        w, a = self.parameters(d)
        return np.sqrt(1.0 - 2.0 * a * w)


class Swing(Short):
    """A smooth model."""

    name = "swing"
    rates, scale, start = swung, (1.0, 3.0), (1.0, 0.0)

    def parameters(self, d):
        return (3.0 * (1.0 + d),)

    def truth(self, d):
        return np.cos(self.parameters(d)[0] * HORIZON)


class Jam(Model):
    """A normal response; one trial in a hundred jams, which rough settings miss."""

    name, settings, truth_beyond = "jam", Settings, 0.01
    missed = (0.9, 0.5, 0.2)  # by level: the run, its audit, a third time

    def describe(self, settings):
        parts = (
            Contributor("d", "1", shown="1"),
            Contributor("kind", "1", shown="1"),
            Contributor("u", "1", shown="1"),
        )
        return Description(parts, (Response("end", "1", shown="1"),))

    def evaluate(self, deviations, settings):
        d, kind, u = deviations.T
        level = int(np.clip(round(np.log10(1e-6 / settings.rtol) / 3), 0, 2))
        met = (u * (7919.0 + 1000.0 * level)) % 1.0 > self.missed[level]
        end = d + 6.0 * ((kind < self.truth_beyond) & met)
        return Outcome(end[:, None], steps=np.ones(len(d)))
