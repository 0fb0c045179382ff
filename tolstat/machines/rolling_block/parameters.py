"""Inertias and stiffnesses of the drive, from nominal values and deviations."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.rolling_block.declarations import CONTRIBUTORS, Settings
from tolstat.machines.rolling_block.modes import Modes, modes_of
from tolstat.machines.rolling_block.structure import MASSES, reduction


class Drive(NamedTuple):
    """Numbers of each drive, reduced to the motor shaft."""

    Q: Array  # [trial, mass], kg m2
    C: Array  # [trial, link], N m/rad
    zeta: Array  # [trial], damping ratio of every elastic mode
    modes: Modes


def exist(deviations: Array) -> Truths:
    """Return which drives can be built."""
    factors = 1.0 + deviations
    return np.asarray(np.all(factors[:, :-1] > 0, axis=1) & (factors[:, -1] >= 0))


def drives(deviations: Array, settings: Settings) -> Drive:
    """Return drives from relative deviations: Q1 ... Q9, C12 ... C59, damping ratio."""
    inertias, stiffnesses = reduction(settings.combination, settings.gearbox)
    factors, n = 1.0 + deviations, len(MASSES)
    Q = np.array(settings.inertias) * settings.scale * inertias * factors[:, :n]
    C = np.array(settings.stiffnesses) * settings.scale * stiffnesses * factors[:, n:-1]
    return Drive(Q, C, settings.damping_ratio * factors[:, -1], modes_of(Q, C))


def nominal(settings: Settings) -> Drive:
    """Return the one drive without deviations."""
    return drives(np.zeros((1, len(CONTRIBUTORS))), settings)
