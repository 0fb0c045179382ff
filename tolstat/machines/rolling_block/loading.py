"""What the drive is loaded with, and what moves: blocks for the integrator.

All is linear, so loads are those of 1 N m: in all where the stands step one after the
other, on its stand for a pulse.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.damping import damping_matrix
from tolstat.machines.rolling_block.drive import Drive, nominal
from tolstat.machines.rolling_block.modes import Modes, modes_of
from tolstat.machines.rolling_block.motion import Machine
from tolstat.machines.rolling_block.settings import Settings
from tolstat.machines.rolling_block.topology import STANDS
from tolstat.moving import Accuracy, Solution, integrate

Array = NDArray[np.float64]

# In each period of the highest mode at least so many steps: its swings are not missed
# where the tolerance would permit to step over them.
STEPS_A_PERIOD = 4
NEVER = 99  # no phase has this number


class Loading(NamedTuple):
    """Loads of the stands, switched at marks."""

    marks: tuple[float, ...]  # s, ascending: start, every switch, end
    moments: tuple[float, ...]  # of each stand, N m
    on: tuple[int, ...]  # the mark at which each begins
    off: tuple[int, ...]  # and ends
    matched: bool  # whether the motor's moment steps with them


def load_steps(settings: Settings) -> Loading:
    """Return the steps of the stands, one after the other, 1 N m in all.

    Parameters
    ----------
    settings : Settings
        Delays, horizon, motor.
    """
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
    """Return the rectangular pulse of 1 N m on one stand; the motor's moment stays.

    Parameters
    ----------
    settings : Settings
        Stand, length, horizon.
    """
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


def followed(
    drive: Drive,
    modes: Modes,
    loading: Loading,
    settings: Settings,
    samples: Array | None = None,
) -> Solution:
    """Integrate drives under a loading, from rest.

    Parameters
    ----------
    drive, modes : Drive, Modes
        The drives.
    loading : Loading
        Of all of them.
    settings : Settings
        Tolerance, and the nominal drive, whose static twists errors are measured by.
    samples : float64[sample], optional
        Times at which the twists are stored, s.

    Returns
    -------
    Solution
        Peaks are those of the elastic moments.
    """
    from tolstat.machines.rolling_block.compiled import SYSTEM

    n = len(drive.zeta)
    one = np.ones(n)
    machine = Machine._make(
        [
            *(1.0 / drive.Q.T),
            *drive.C.T,
            *(one * moment for moment in loading.moments),
            *(one * mark for mark in loading.on),
            *(one * mark for mark in loading.off),
            one * loading.matched,
        ]
    )
    H = damping_matrix(modes, drive.C, drive.zeta).reshape(n, -1)
    typical = nominal(settings)
    omega = modes_of(typical.Q, typical.C).omega[0]
    twist = 1.0 / typical.C[0]  # of 1 N m
    return integrate(
        replace(SYSTEM, scale=np.concatenate([twist, omega[0] * twist])),
        np.zeros((n, 2 * len(twist))),
        np.concatenate([np.stack(machine, axis=1), H], axis=1),
        np.tile(loading.marks, (n, 1)),
        Accuracy(settings.rtol, 2 * np.pi / omega[-1] / STEPS_A_PERIOD),
        samples=samples,
    )
