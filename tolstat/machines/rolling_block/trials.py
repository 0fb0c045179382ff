"""Trials: drives followed under both loadings, and their responses.

The equations are linear, so loads are those of 1 N m: in all if the stands step one
after the other, on its stand for a pulse.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.declarations import RESPONSES, Settings
from tolstat.machines.rolling_block.exact_motion import motion_of
from tolstat.machines.rolling_block.frequency_response import NO_PART
from tolstat.machines.rolling_block.modes import (
    Modes,
    antiphase,
    contributions,
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
from tolstat.moving import Accuracy, Solution, integrate, solve
from tolstat.status import Status

# At least so many steps in each period of the highest mode: otherwise the tolerance
# could permit steps over its swings.
STEPS_A_PERIOD = 4
NEVER = 99  # no phase has this number


class Loading(NamedTuple):
    """Loads of the stands, switched at marks."""

    marks: tuple[float, ...]  # s, ascending: start, every switch, end
    moments: tuple[float, ...]  # of each stand, N m
    on: tuple[int, ...]  # the mark at which each begins
    off: tuple[int, ...]  # and ends
    matched: bool  # whether the motor's moment steps with them

    @property
    def on_masses(self) -> list[Array]:
        """The moments on the masses behind each mark but the last, N m."""
        found = []
        for phase in range(len(self.marks) - 1):
            loads = {
                stand: moment
                for stand, moment, on, off in zip(
                    STANDS, self.moments, self.on, self.off, strict=True
                )
                if on <= phase < off
            }
            motor = {1: sum(loads.values())} if self.matched else {}
            found.append(load_vector({**loads, **motor}))
        return found


def load_steps(settings: Settings) -> Loading:
    """Return the steps of the stands, one after the other, 1 N m in all."""
    times = sorted(set(settings.entries))
    share = 1.0 / len(STANDS)
    return Loading(
        marks=(*times, settings.horizon),
        moments=(share,) * len(STANDS),
        on=tuple(times.index(entry) for entry in settings.entries),
        off=(NEVER,) * len(STANDS),
        matched=settings.motor == "matched",
    )


def pulse(settings: Settings) -> Loading:
    """Return the rectangular pulse of 1 N m on one stand; the motor's moment stays."""
    outlasts = settings.pulse_length >= settings.horizon
    ends = () if outlasts else (settings.pulse_length,)
    on_stand = (float(stand == settings.pulse_stand) for stand in STANDS)
    return Loading(
        marks=(0.0, *ends, settings.horizon),
        moments=tuple(on_stand),
        on=(0,) * len(STANDS),
        off=(1,) * len(STANDS) if ends else (NEVER,) * len(STANDS),
        matched=False,
    )


def damping_matrix(modes: Modes, C: Array, zeta: Array) -> Array:
    """Return the damping moment in each link per rate of each twist, N m s/rad.

    The paper prints no damping: every elastic mode has the damping ratio zeta, the
    rigid one none. With phi^T M phi = 1 that is

        D = M Phi diag(2 zeta omega) Phi^T M,

    and since M phi_r = K phi_r / omega_r^2, D = B^T H B with the twists B phi and

        H_ef = 2 zeta sum over r of M_er M_fr / omega_r^3,   M_er = C_e phi_e,r.

    Returns
    -------
    H : float64[trial, link, link]
        For stiffnesses C, N m/rad, [trial, link], and zeta, [trial].
    """
    omega, _, phi_ij = modes
    moments = C[:, :, None] * phi_ij
    H = np.zeros((len(C), C.shape[1], C.shape[1]))
    for r in range(omega.shape[1]):  # one by one: the sum is the same in any block
        w, M = omega[:, r, None, None], moments[:, :, r]
        H = H + M[:, :, None] * M[:, None, :] / (w * w * w)
    return 2.0 * zeta[:, None, None] * H


def followed(
    drive: Drive,
    loading: Loading,
    settings: Settings,
    samples: Array | None = None,
) -> Solution:
    """Follow drives under a loading, from rest: exactly, or by Runge-Kutta in audits.

    Returns
    -------
    Solution
        Peaks are those of the elastic moments; histories those of the twists first.
    """
    if not settings.runge_kutta:
        found = solve(motion_of(drive, loading.marks, loading.on_masses), samples)
        for extreme in (found.greatest, found.least):
            extreme *= drive.C
        return found
    # only an integration needs these equations compiled
    from tolstat.machines.rolling_block.compiled import SYSTEM

    H = damping_matrix(drive.modes, drive.C, drive.zeta)
    n = len(drive.zeta)
    one = np.ones(n)
    machine = (  # in the order of `motion.Machine`
        *(1.0 / drive.Q.T),
        *drive.C.T,
        *(one * each for each in (*loading.moments, *loading.on, *loading.off)),
        one * loading.matched,
    )
    # errors are measured by the twists of the nominal drive
    typical = nominal(settings)
    omega = typical.modes.omega[0]
    twist = 1.0 / typical.C[0]  # of 1 N m
    return integrate(
        replace(SYSTEM, scale=np.concatenate([twist, omega[0] * twist])),
        np.zeros((n, 2 * len(twist))),
        np.concatenate([np.stack(machine, axis=1), H.reshape(n, -1)], axis=1),
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
    found = modal_answers(drive, settings)
    for ij, share, peak, after in zip(
        LINK_NAMES, STATIC_SHARES, loaded.peak.T, pulsed.peak.T, strict=True
    ):
        found[f"amplification_{ij}"] = peak / share
        found[f"moment_peak_{ij}"] = peak * settings.total_load
        found[f"pulse_peak_{ij}"] = after * settings.pulse_moment
    table = np.stack([found[response.name] for response in RESPONSES], axis=1)
    status = np.where(loaded.status == Status.DONE, pulsed.status, loaded.status)
    return Outcome(table, status, loaded.steps + pulsed.steps)
