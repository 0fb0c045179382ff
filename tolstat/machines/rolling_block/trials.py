"""Trials: drives followed under both loadings, and their responses.

The equations are linear, so loads are those of 1 N m: in all if the stands step one
after the other, on its stand for a pulse.
"""

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.declarations import RESPONSES, Settings
from tolstat.machines.rolling_block.frequency_response import NO_PART
from tolstat.machines.rolling_block.modes import antiphase, contributions
from tolstat.machines.rolling_block.motion import (
    Loading,
    equations,
    linear_motion,
)
from tolstat.machines.rolling_block.parameters import Drive, nominal
from tolstat.machines.rolling_block.resonance import free_speeds, speed_margin
from tolstat.machines.rolling_block.structure import (
    LINK_NAMES,
    STANDS,
    STATIC_SHARES,
    load_vector,
)
from tolstat.model.contract import Outcome
from tolstat.moving import Accuracy, Solution, System, integrate, solve
from tolstat.status import Status

# At least so many steps in each period of the highest mode: otherwise the tolerance
# could permit steps over its swings.
STEPS_A_PERIOD = 4


def load_steps(settings: Settings) -> Loading:
    """Return the steps of the stands, one after the other, 1 N m in all."""
    times = sorted(set(settings.entries))
    moments = []
    for time in times:
        entries = zip(STANDS, settings.entries, strict=True)
        loads = {stand: 1.0 / len(STANDS) for stand, entry in entries if entry <= time}
        if settings.motor == "matched":
            loads[1] = sum(loads.values())
        moments.append(load_vector(loads))
    return Loading((*times, settings.horizon), np.array(moments))


def pulse(settings: Settings) -> Loading:
    """Return the rectangular pulse of 1 N m on one stand; the motor's moment stays."""
    length, horizon = settings.pulse_length, settings.horizon
    ends = () if length >= horizon else (length,)
    moments = [load_vector({settings.pulse_stand: size}) for size in (1.0, 0.0)]
    return Loading((0.0, *ends, horizon), np.array(moments[: 1 + len(ends)]))


def followed(
    drive: Drive,
    loading: Loading,
    settings: Settings,
    samples: Array | None = None,
) -> Solution:
    """Follow drives under a loading, from rest: exactly, or by Runge-Kutta in audits.

    Peaks are those of the elastic moments; histories those of the twists first.
    """
    if settings.runge_kutta:
        solution = integrated(drive, loading, settings, samples)
    else:
        solution = solve(linear_motion(drive, loading), samples)
    for extreme in (solution.greatest, solution.least):
        extreme *= drive.C
    return solution


def integrated(
    drive: Drive, loading: Loading, settings: Settings, samples: Array | None
) -> Solution:
    """Follow the twists of drives by Runge-Kutta."""
    # only an integration needs these equations compiled
    from tolstat.machines.rolling_block.compiled import rates, watch

    stiffness, damping, load = equations(drive, loading)
    load_changes = np.diff(load, axis=1, prepend=0.0)
    n, n_links = drive.C.shape
    matrices = np.concatenate([stiffness, damping, load_changes], axis=1)
    # errors are measured by the twists of the nominal drive
    typical = nominal(settings)
    omega = typical.modes.omega[0]
    twist = 1.0 / typical.C[0]  # of 1 N m
    scale = np.concatenate([twist, omega[0] * twist])
    return integrate(
        System(rates, scale, watch, n_extremes=n_links),
        np.zeros((n, 2 * n_links)),
        matrices.reshape(n, -1),
        np.tile(loading.marks, (n, 1)),
        Accuracy(settings.rtol, 2 * np.pi / omega[-1] / STEPS_A_PERIOD),
        samples=samples,
    )


def modal_answers(drive: Drive, settings: Settings) -> dict[str, Array]:
    """Return what follows from frequencies and shapes, by name."""
    modes = drive.modes
    a = contributions(modes, drive.C, {32: 1.0, 33: 1.0})[:, 0]
    main = np.abs(a[:, 0])
    local = np.maximum(np.abs(a[:, 2]), np.abs(a[:, 3]))
    pattern = antiphase(nominal(settings).modes.phi)
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


def outcome_of(
    drive: Drive, loaded: Solution, pulsed: Solution, settings: Settings
) -> Outcome:
    """Return the responses in the order of `describe`.

    Of drives followed while the loads of the stands step, and after a pulse.
    """
    answers = modal_answers(drive, settings)
    for ij, share, peak, after in zip(
        LINK_NAMES, STATIC_SHARES, loaded.peak.T, pulsed.peak.T, strict=True
    ):
        answers[f"amplification_{ij}"] = peak / share
        answers[f"moment_peak_{ij}"] = peak * settings.total_load
        answers[f"pulse_peak_{ij}"] = after * settings.pulse_moment
    table = np.stack([answers[response.name] for response in RESPONSES], axis=1)
    status = np.where(loaded.status == Status.DONE, pulsed.status, loaded.status)
    return Outcome(table, status, loaded.steps + pulsed.steps)
