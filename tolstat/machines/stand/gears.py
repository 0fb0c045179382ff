"""The second loop, from gear 13 to wheels 7 and 8, without its massless pinions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.stand.nominal import NOMINAL

Array = NDArray[np.float64]


def gear_deformations(
    k30: Array, k31: Array, k32: Array, c2: Array, balanced: bool
) -> Array:
    """Condense the massless pinions 10, 11 out of the second loop.

    phi21, phi22 minimise the elastic energy of meshes 0, 1, 2 and shaft 12 for given
    (phi1, a_1, a_2).

    Parameters
    ----------
    k30, k31, k32, c2 : float64[n]
        Stiffness of the meshes, N/m, and of shaft 12, N m/rad.
    balanced : bool
        Whether a differential splits the torque of gear 13 between the pinions.

    Returns
    -------
    float64[n, 4, 3]
        B: deformations of meshes 0, 1, 2 (m) and of shaft 12 (rad) for
        (phi1, a_1, a_2), rad.
    """
    r1, r2, r3 = NOMINAL.r1, NOMINAL.r2, NOMINAL.r3
    # mesh 0 feels pinion 10, or with the differential the mean of both pinions
    on_10, on_11 = (r2 / 2, r2 / 2) if balanced else (r2, 0.0)
    driven = np.array([[r1, 0, 0], [0, r3, 0], [0, 0, r3], [0, 0, 0]])
    pinions = np.array([[on_10, on_11], [r2, 0], [0, r2], [-1, 1]])
    K = np.stack(np.broadcast_arrays(k30, k31, k32, c2), axis=-1)[:, :, None]
    T = -np.linalg.solve(pinions.T @ (K * pinions), pinions.T @ (K * driven))
    B: Array = driven + pinions @ T
    return B
