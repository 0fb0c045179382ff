"""Trials: drives integrated under both loadings, and what they answer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.declarations import RESPONSES, Settings
from tolstat.machines.rolling_block.frequency_response import NO_PART, contributions
from tolstat.machines.rolling_block.loading import followed, load_steps, pulse
from tolstat.machines.rolling_block.modes import Modes, antiphase, modes_of
from tolstat.machines.rolling_block.parameters import Drive, nominal
from tolstat.machines.rolling_block.resonance import free_speeds, speed_margin
from tolstat.machines.rolling_block.topology import LINK_NAMES, STATIC_SHARES
from tolstat.model.contract import Outcome
from tolstat.moving import Solution
from tolstat.status import Status


def modal_answers(drive: Drive, modes: Modes, settings: Settings) -> dict[str, Array]:
    """Return what follows from frequencies and shapes, by name."""
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


class Moved(NamedTuple):
    """What was integrated."""

    loaded: Solution  # the loads of the stands stepping
    pulsed: Solution  # a pulse on one stand


def both_moved(
    drive: Drive, modes: Modes, settings: Settings, samples: Array | None = None
) -> Moved:
    """Integrate drives under both loadings, with their twists at the sample times."""
    return Moved(
        followed(drive, modes, load_steps(settings), settings, samples),
        followed(drive, modes, pulse(settings), settings, samples),
    )


def outcome_of(drive: Drive, modes: Modes, moved: Moved, settings: Settings) -> Outcome:
    """Arrange the responses as `describe` lists them."""
    found = {
        **modal_answers(drive, modes, settings),
        **moment_answers(moved.loaded.peak, moved.pulsed.peak, settings),
    }
    table = np.stack([found[response.name] for response in RESPONSES], axis=1)
    status = np.where(
        moved.loaded.status == Status.DONE, moved.pulsed.status, moved.loaded.status
    )
    return Outcome(table, status, moved.loaded.steps + moved.pulsed.steps)
