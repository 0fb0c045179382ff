"""Rolling blocks that several tests solve."""

from __future__ import annotations

import numpy as np

from tests.machines import rolling_block_reference as known
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import drives, exist, nominal

RPM = np.pi / 30


B = np.zeros((8, 9))  # twists of the links from the angles, by the paper's numbers
for row, (i, j) in enumerate(known.LINKS):
    B[row, int(i) - 1], B[row, int(j) - 1] = 1.0, -1.0


def solved(settings=None):
    drive = nominal(settings or Settings())
    return drive, drive.modes


def scattered(trials, seed=3, settings=None):
    """Drives with stiffnesses 5 %, inertias 2 % off (one standard deviation)."""
    spread = np.array([0.02] * 9 + [0.05] * 8 + [0.1])
    deviations = spread * np.random.default_rng(seed).standard_normal((trials, 18))
    drive = drives(deviations, settings or Settings())
    assert exist(deviations).all()
    return drive, drive.modes


FREE = [
    (
        {},
        [(850, 1147.599852), (1268.399836, 1295.701258), (1432.090864, 1434.382545),
         (1585.370181, 1700)],
        441.822773,
    ),
    (
        {"rolls": True},
        [(850, 964.129792), (1132.371873, 1147.599852), (1268.399836, 1295.701258)],
        156.659192,
    ),
]  # fmt: skip
