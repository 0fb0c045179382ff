"""The drive as built: inertias and stiffnesses from nominal values and deviations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import Modes
from tolstat.machines.rolling_block.structure import LINKS, MASSES, reduction

CANNOT_EXIST = "cannot exist"
FAILURES = {
    CANNOT_EXIST: "each inertia and stiffness is above 0, the damping not below; their "
    "deviations are above -100 %"
}


class Drive(NamedTuple):
    """Numbers of each drive, reduced to the motor shaft."""

    Q: Array  # [trial, mass], kg m2
    C: Array  # [trial, link], N m/rad
    zeta: Array  # [trial], damping ratio of every elastic mode


class Seen(NamedTuple):
    """What views are made of: drives, of which the first is shown."""

    drive: Drive
    modes: Modes
    others: NDArray[np.intp]  # for bands
    settings: Settings


def nominal(settings: Settings) -> Drive:
    """Return the one drive without deviations."""
    inertias, stiffnesses = reduction(settings.combination)
    Q = np.array(settings.inertias) * settings.scale * inertias
    C = np.array(settings.stiffnesses) * settings.scale * stiffnesses
    return Drive(Q[None], C[None], np.array([settings.damping_ratio]))


def drives(deviations: Array, settings: Settings) -> tuple[Drive, Truths]:
    """Build drives from relative deviations: Q1 ... Q9, C12 ... C59, damping ratio.

    Returns
    -------
    built : Drive
        Where one cannot exist, the nominal one stands in its place.
    exist : bool[trial]
        Whether all inertias and stiffnesses are positive, and the damping not negative.
    """
    of = nominal(settings)
    n, m = len(MASSES), len(LINKS)
    factors = 1.0 + deviations
    positive: Truths = np.all(factors[:, : n + m] > 0, axis=1)
    exist = positive & (factors[:, n + m] >= 0)
    factors = np.where(exist[:, None], factors, 1.0)
    return Drive(
        of.Q * factors[:, :n], of.C * factors[:, n : n + m], of.zeta * factors[:, n + m]
    ), exist
