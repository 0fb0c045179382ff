"""The responses of a block of drives, from their modes and what was integrated."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.antiphase import antiphase
from tolstat.machines.rolling_block.drive import Drive, nominal
from tolstat.machines.rolling_block.frequency_response import NO_PART, contributions
from tolstat.machines.rolling_block.modes import Modes, modes_of
from tolstat.machines.rolling_block.settings import Settings
from tolstat.machines.rolling_block.speeds import free_speeds, speed_margin
from tolstat.machines.rolling_block.topology import LINK_NAMES, STATIC_SHARES

Array = NDArray[np.float64]


def modal_answers(drive: Drive, modes: Modes, settings: Settings) -> dict[str, Array]:
    """Return what follows from frequencies and shapes, by name.

    Parameters
    ----------
    drive, modes : Drive, Modes
        Of each trial.
    settings : Settings
        Speeds, orders, and the nominal drive, whose antiphase pattern is the measure.
    """
    a = contributions(modes, drive.C, {32: 1.0, 33: 1.0})[:, 0]
    main = np.abs(a[:, 0])
    local = np.maximum(np.abs(a[:, 2]), np.abs(a[:, 3]))
    typical = nominal(settings)
    pattern = antiphase(modes_of(typical.Q, typical.C).phi)
    total, widest = free_speeds(modes.omega, settings)
    frequencies = modes.omega.T / (2 * np.pi)
    return {
        **{f"frequency_{r}": f for r, f in enumerate(frequencies, start=1)},
        "cancellation": np.abs(a[:, 1]) / main,
        "leakage": np.where(local > NO_PART * main, local, 0.0) / main,
        "antiphase_pattern": np.where(
            np.all(antiphase(modes.phi) == pattern, axis=(1, 2)), 1.0, 0.0
        ),
        "free_speed_range": total,
        "widest_free_range": widest,
        "speed_margin": speed_margin(modes.omega, settings),
    }


def moment_answers(
    loaded: Array, pulsed: Array, settings: Settings
) -> dict[str, Array]:
    """Return amplifications and peak moments, by name.

    Parameters
    ----------
    loaded, pulsed : float64[trial, link]
        Peak moments per 1 N m, loads stepping and under the pulse.
    settings : Settings
        How large load and pulse are.
    """
    found = {}
    for link, ij in enumerate(LINK_NAMES):
        peak = loaded[:, link]
        found[f"amplification_{ij}"] = peak / STATIC_SHARES[link]
        found[f"moment_peak_{ij}"] = peak * settings.total_load
        found[f"pulse_peak_{ij}"] = pulsed[:, link] * settings.pulse_moment
    return found
