"""Where the carriage stands at first, and how far out it rubs.

References
----------
E. Ya. Antonyuk, A. G. Zabuga, On the dynamic loading of machines with parallel
statically indeterminate kinematic chains (2012); equation numbers are the paper's.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.stand.nominal import NOMINAL

Array = NDArray[np.float64]


def initial_position(
    l1: Array, l2: Array, r_1: Array, r_2: Array
) -> tuple[Array, Array, Array]:
    """Place the carriage in its leftmost position, (10), (11).

    Parameters
    ----------
    l1, l2, r_1, r_2 : float64[n]
        Rods and cranks, m.

    Returns
    -------
    tuple of float64[n]
        phi31 = phi32 (rad), x (m), sin alpha; NaN where the parts cannot be mounted.
    """
    h, dl_s = NOMINAL.h, NOMINAL.dl_s
    with np.errstate(invalid="ignore", divide="ignore"):
        phi = -(np.arcsin(h / (l1 - r_1)) + np.arcsin(h / (l2 - r_2))) / 2
        xa = np.sqrt((l1 - r_1) ** 2 - h**2)
        xb = np.sqrt((l2 - r_2) ** 2 - h**2)
    return phi, (xa + xb) / 2, (xa - xb) / dl_s


def friction_arm() -> float:
    """Return mu_rot/mu of (8), m: mean distance of the feet from the yaw axis.

    The integral of hypot over a rectangle from the origin in closed form.
    """
    dh, dl_s, foot = float(NOMINAL.dh), float(NOMINAL.dl_s), float(NOMINAL.foot)

    def integral(a: float, b: float) -> float:
        return (
            2 * a * b * math.hypot(a, b)
            + a**3 * math.asinh(b / a)
            + b**3 * math.asinh(a / b)
        ) / 6

    S = 2 * dh * foot
    quarter = integral(dh / 2, dl_s / 2) - integral(dh / 2, dl_s / 2 - foot)
    return 4 * quarter / S
