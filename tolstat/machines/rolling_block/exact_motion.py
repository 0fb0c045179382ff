"""The drive as linear motion in its modes, for its exact solution.

Each mode is counted from where it would rest under the loads: nothing drives it, and it
jumps where a load steps.
"""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.parameters import Drive
from tolstat.machines.rolling_block.structure import LINKS
from tolstat.moving import LinearMotion

N_LINKS = len(LINKS)


def at_rest(Q: Array, M: Array) -> Array:
    """Return the moments of the links, N m, when all masses accelerate as one.

    float64[trial, phase, link], under moments M[phase, mass], which drive where they
    are positive. A link carries what all masses behind it need.
    """
    total = np.cumsum(Q, axis=1)[:, -1:]
    needed = Q[:, None] * (M.sum(axis=1) / total)[:, :, None] - M
    for i, j in reversed(LINKS):
        needed[:, :, i] += needed[:, :, j]
    return np.asarray(needed[:, :, [j for _, j in LINKS]])


def motion_of(
    drive: Drive, marks: tuple[float, ...], loads: list[Array]
) -> LinearMotion:
    """Return drives as linear motion from rest; watched are the twists of the links.

    Rows are omega_r q_r and q_r' of each mode, with q_r'' + 2 zeta omega_r q_r' +
    omega_r^2 q_r = 0.

    Parameters
    ----------
    drive : Drive
        Their numbers.
    marks : tuple of float
        Ascending, s.
    loads : list of float64[mass]
        The moments behind each mark but the last, N m.
    """
    Q, C, zeta, (omega, phi, phi_ij) = drive
    n, modes = omega.shape
    r = np.arange(modes)
    entries = np.vstack(
        [
            np.stack([r, modes + r], axis=1),
            np.stack([modes + r, r, modes + r, modes + r], axis=1).reshape(-1, 2),
        ]
    )
    slow = np.stack([-omega, -2.0 * zeta[:, None] * omega], axis=2)
    change = np.zeros((n, len(loads), 2 * modes))
    for phase, steps in enumerate(np.diff(loads, axis=0, prepend=0.0)):
        for mass in np.flatnonzero(steps):  # one by one: the same in any block
            change[:, phase, :modes] -= phi[:, mass] * steps[mass]
    change[:, :, :modes] /= omega[:, None]
    return LinearMotion(
        modes, 0, entries, np.hstack([omega, slow.reshape(n, -1)]),
        np.tile(marks, (n, 1)), change, phi_ij / omega[:, None],
        at_rest(Q, np.array(loads)) / C[:, None], np.zeros((n, N_LINKS)),
    )  # fmt: skip
