"""The 128 combinations of the gearbox as tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.gearbox import COMBINATIONS, ratios
from tolstat.machines.rolling_block.modes import modes_of
from tolstat.machines.rolling_block.parameters import nominal
from tolstat.machines.rolling_block.resonance import free_speeds
from tolstat.machines.rolling_block.seen import Seen
from tolstat.machines.rolling_block.topology import LINK_NAMES, MASSES
from tolstat.model.view import Axis, Listing

HEADS = (
    Axis("combination", "1"),
    Axis("i31", "1", "1"),
    Axis("i34", "1", "1"),
)


def _named() -> tuple[NDArray[np.generic], ...]:
    """Name each combination, with its ratios of motor to roll."""
    every = [ratios(each) for each in COMBINATIONS]
    names = [" ".join(map(str, each)) for each in COMBINATIONS]
    return (
        np.array(names),
        np.array([each.i31 for each in every]),
        np.array([each.i34 for each in every]),
    )


def frequencies(seen: Seen) -> Listing:
    """List natural frequencies and free speeds of the nominal drives."""
    each = [replace(seen.settings, combination=those) for those in COMBINATIONS]
    omega = np.stack([modes_of(*nominal(one)[:2]).omega[0] for one in each])
    free = [free_speeds(w[None], one) for w, one in zip(omega, each, strict=True)]
    total, widest = np.array(free)[:, :, 0].T
    return Listing(
        (
            *HEADS,
            *(Axis(f"f{r + 1}", "Hz", "Hz") for r in range(omega.shape[1])),
            Axis("free speeds", "rad/s", "rpm"),
            Axis("widest", "rad/s", "rpm"),
        ),
        (*_named(), *(omega.T / (2 * np.pi)), total, widest),
        "positions of the stages A, B, C, D; motor speed over roll speed",
    )


def reduced(seen: Seen) -> Listing:
    """List ratios, and inertias and stiffnesses of the nominal drives."""
    each = [
        nominal(replace(seen.settings, combination=those)) for those in COMBINATIONS
    ]
    Q, C = (np.concatenate([one[i] for one in each]) for i in range(2))
    return Listing(
        (
            *HEADS,
            Axis("sum of Q", "kg m^2", "kg m^2"),
            *(Axis(f"Q{i + 1}", "kg m^2", "kg m^2") for i in range(len(MASSES))),
            *(Axis(f"C{ij}", "N m/rad", "kN m/rad") for ij in LINK_NAMES),
        ),
        (*_named(), Q.sum(axis=1), *Q.T, *C.T),
        "positions of the stages A, B, C, D; all reduced to the motor shaft",
    )
