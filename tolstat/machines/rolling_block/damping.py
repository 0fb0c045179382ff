"""Modal damping as moments between the masses, for equations in physical coordinates.

The paper prints no damping: every elastic mode has the damping ratio zeta, the rigid
one none. With phi^T M phi = 1 that is

    D = M Phi diag(2 zeta omega) Phi^T M,

and since M phi_r = K phi_r / omega_r^2, D = B^T H B with the twists B phi and

    H_ef = 2 zeta sum over r of M_er M_fr / omega_r^3,   M_er = C_e phi_e,r.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.modes import Modes

Array = NDArray[np.float64]


def damping_matrix(modes: Modes, C: Array, zeta: Array) -> Array:
    """Return what the rate of each twist adds to the moment in each link.

    Parameters
    ----------
    modes : Modes
        Of the drives.
    C : float64[trial, link]
        Stiffnesses, N m/rad.
    zeta : float64[trial]
        Damping ratio of every elastic mode.

    Returns
    -------
    H : float64[trial, link, link]
        N m s/rad.
    """
    omega, _, phi_ij = modes
    moments = C[:, :, None] * phi_ij
    H = np.zeros((len(C), C.shape[1], C.shape[1]))
    for r in range(omega.shape[1]):  # one by one: the sum is the same in any block
        w, M = omega[:, r, None, None], moments[:, :, r]
        H = H + M[:, :, None] * M[:, None, :] / (w * w * w)
    damping: Array = 2.0 * zeta[:, None, None] * H
    return damping
