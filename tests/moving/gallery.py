"""Models of the gallery, and how far they are from their references."""

from __future__ import annotations

import importlib

import numpy as np

import tolstat
from tests.moving import references

NAMES = {
    "ball": "Ball", "belt": "Belt", "brake": "Brake", "cam": "Cam", "chain": "Chain",
    "clutch": "Clutch", "cylinder": "Cylinder", "flight": "Flight",
    "four_bar": "FourBar", "gear": "Gear", "motor": "Motor", "pendulum": "Pendulum",
    "pulses": "Pulses", "servo": "Servo", "shock": "Shock", "stop": "Stop",
    "thermostat": "Thermostat",
}  # fmt: skip
TRIALS = 3


def model_of(name):
    return getattr(importlib.import_module(f"runs.gallery.{name}"), NAMES[name])()


def deviations_of(model):
    """Return the nominal trial and others, each part within 5 %."""
    shares = np.random.default_rng(5).uniform(-0.05, 0.05, (TRIALS, len(model.parts)))
    shares[0] = 0.0
    return shares * np.array([part.nominal for part in model.parts.values()])


def errors(name, rtol, **settings):
    """Return the largest errors of the responses, of their largest value."""
    model = model_of(name)
    deviations = deviations_of(model)
    nominal = np.array([part.nominal for part in model.parts.values()])
    by_name = dict(zip(model.parts, deviations.T, strict=True))
    frame = tolstat.evaluate(model, by_name, {"rtol": rtol, **settings})
    assert (frame["status"] == "done").all()
    values = frame[[*model.responses]].to_numpy()
    known = [getattr(references, name)(*row) for row in nominal + deviations]
    return np.abs(values - known).max(axis=0) / np.abs(known).max(axis=0)
