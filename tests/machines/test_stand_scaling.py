"""The scaling laws of the stand: other sizes, times and forces, the same motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import tolstat
from tests.machines.reference import CASES
from tolstat.machines.stand import compiled
from tolstat.machines.stand.declarations import RESPONSES, Settings
from tolstat.machines.stand.motion import SCALE

DEVIATIONS = CASES["F"][0]  # all of them lengths, m
NOMINAL = Settings()
# lengths times a, times b, forces c: the factor of each setting
FACTORS = {
    "m I_s I": lambda a, b, c: (c * b**2 / a, c * a * b**2, c * a * b**2),
    "k k3": lambda a, b, c: (c / a,) * 2,
    "H Hk3": lambda a, b, c: (c * b / a,) * 2,
    "c2 c3 c_s": lambda a, b, c: (c * a,) * 3,
    "Hc2 Hc3 H_s": lambda a, b, c: (c * a * b,) * 3,
    "dl_s dh dL foot l r r1 r2 r3 h x_roll": lambda a, b, c: (a,) * 11,
    "F0 beta1 beta2 beta5 g": lambda a, b, c: (c, 1 / a, b / a, b, a / b**2),
    "crank_speed start_up max_step": lambda a, b, c: (1 / b, b, b),
}


def scaled(a, b, c):
    """Return the responses of case F and of its image, the image's by their units."""
    settings = {}
    for names, factors in FACTORS.items():
        for name, factor in zip(names.split(), factors(a, b, c), strict=True):
            settings[name] = getattr(NOMINAL, name) * factor
    sizes = {"N": c, "N m": a * c, "J": a * c, "m/s": a / b, "1": 1, "rad": 1}
    lengths = {name: a * value for name, value in DEVIATIONS.items()}
    image = tolstat.evaluate("stand", lengths, settings).iloc[0]
    return image["steps"], {e.name: image[e.name] / sizes[e.unit] for e in RESPONSES}


def original():
    found = tolstat.evaluate("stand", DEVIATIONS).iloc[0]
    return found["steps"], {each.name: found[each.name] for each in RESPONSES}


def test_forces_twice_as_large_change_no_bit():
    assert scaled(1.0, 1.0, 2.0) == original()


def test_a_larger_slower_stand_is_the_same_to_the_last_bit(monkeypatch):
    a, b = 4.0, 2.0
    lengths = {"x": a, "x_": a / b}
    rates = {f"{name}_": 1 / b for name in ("phi31", "phi32", "alpha")}
    sizes = [
        value * {**lengths, **rates}.get(name, 1.0)
        for name, value in SCALE._asdict().items()
    ]
    known = original()
    system = replace(compiled.SYSTEM, scale=np.array(sizes))
    monkeypatch.setattr(compiled, "SYSTEM", system)
    assert scaled(a, b, 1.0) == known
