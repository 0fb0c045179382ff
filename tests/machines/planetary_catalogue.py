"""Planetary gears of the catalogue."""

from __future__ import annotations

import math

EIGHT_TO_THIRTY = math.radians(8), math.radians(30)


CATALOGUE = {
    "scheme": "AI", "ratio": 7, "ratio_tolerance": 0.01, "satellites": 3,
    "z1": (17, 26), "z2": (17, 60), "z3": (17, 60), "z4": (61, 130),
    "helix": EIGHT_TO_THIRTY,
}  # fmt: skip
