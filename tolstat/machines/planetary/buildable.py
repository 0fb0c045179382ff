"""Which gears can be built at all: teeth that are left, and that mesh."""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.planetary.design import Design
from tolstat.machines.planetary.settings import Settings

NO_TOOTH = "no tooth left"
NO_MESH = "does not mesh"
DEPTH = 2.0  # modules, of a tooth
FAILURES = {
    NO_TOOTH: "the thickness of a tooth deviates by less than half a pitch",
    NO_MESH: "helix angles are below 90 deg, the centre distance deviates by less than "
    "the depth of a tooth, the position of a satellite by less than half a pitch",
}


def faults(
    db: tuple[Array, Array],
    e: Array,
    da: Array,
    E: tuple[Array, ...],
    design: Design,
    settings: Settings,
) -> dict[str, Truths]:
    """Tell which gears cannot be built, by the words of `FAILURES`."""
    of = design
    steep = np.maximum(np.abs(of.b2 + db[0]), np.abs(of.b3 + db[1]))
    diameters = of.dw1, of.dw2, of.dw3, of.dw4
    half_pitch = [
        np.pi * d / z / 2 for d, z in zip(diameters, settings.teeth, strict=True)
    ]
    thin = [np.abs(each) / h for each, h in zip(E, half_pitch, strict=True)]
    depth = DEPTH * settings.module / max(1.0, settings.module_ratio)
    return {
        NO_TOOTH: ~(np.maximum.reduce(thin) < 1),
        NO_MESH: ~(
            (steep < np.pi / 2)
            & (np.abs(da) < depth)
            & (np.abs(e).max(axis=1) < half_pitch[0])
        ),
    }
