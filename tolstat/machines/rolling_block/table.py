"""A table of frequencies and mode shapes, and drives beside it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.modes import mac, modes_of
from tolstat.machines.rolling_block.topology import LINKS, MASSES

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]

N_MASSES, N_LINKS = len(MASSES), len(LINKS)
N_UNKNOWNS = N_MASSES + N_LINKS
LIKE_IN_HZ = 0.1  # what an equal frequency adds to the likeness of two shapes, ...
NEAR = 0.1  # ... by half where it is so far, of itself


class Table(NamedTuple):
    """What is given, with its resolution; row 0 holds the frequencies."""

    numbers: Array  # [1 + mass, mode], Hz and shapes; NaN where nothing is known
    half: Array  # [1 + mass, mode], half of the last digit

    @property
    def known(self) -> Flags:
        """Of each number, whether it is."""
        return np.isfinite(self.numbers)


class Beside(NamedTuple):
    """The modes of drives beside a table, each column in the scale that fits best."""

    numbers: Array  # [drive, 1 + mass, mode], as these drives have them
    off: Array  # likewise, less those given, in halves of the last digit; 0 if unknown
    slopes: Array  # [drive, 1 + mass, mode, unknown], of `off`, by logarithms
    scales: Array  # [drive, 1 + mass, mode], of `off`, by the scale of the column


def beside(table: Table, counts: Flags, logs: Array) -> Beside:
    """Compare drives with a table.

    Parameters
    ----------
    table : Table
        What is given.
    counts : bool[drive, 1 + mass, mode]
        By what modes are told and shapes are scaled.
    logs : float64[drive, unknown]
        Logarithms of Q1 ... Q9, C12 ... C59.

    Returns
    -------
    Beside
        Slopes and scales are such that a column's change by its scale is taken out of
        the slopes, and the scales' squares, summed over what counts, are 1.
    """
    Q, C = np.exp(logs[:, :N_MASSES]), np.exp(logs[:, N_MASSES:])
    modes = modes_of(Q, C)
    order = _alike(table, counts, modes.omega, modes.phi)
    omega = np.take_along_axis(modes.omega, order, axis=1)
    phi = np.take_along_axis(modes.phi, order[:, None], axis=2)
    phi_ij = np.take_along_axis(modes.phi_ij, order[:, None], axis=2)

    # phi_s^T (dK - omega_r^2 dM) phi_r by ln Q and ln C, [drive, unknown, s, r]
    inertia = -(Q[:, :, None] * modes.phi)[..., None] * (
        (omega * omega)[:, None, :] * phi
    ).reshape(len(Q), N_MASSES, 1, -1)
    stiffness = (C[:, :, None] * modes.phi_ij)[..., None] * phi_ij[:, :, None, :]
    forces = np.concatenate([inertia, stiffness], axis=1)
    own = (np.arange(N_LINKS)[:, None] == order[:, None])[:, None]
    d_square = np.sum(np.where(own, forces, 0.0), axis=2)  # of omega_r^2
    gap = (omega * omega)[:, None, None, :] - (modes.omega**2)[:, None, :, None]
    apart = ~own & (gap != 0)
    share = np.where(apart, forces, 0.0) / np.where(apart, gap, 1.0)
    # the rigid mode's share: K takes nothing of it
    rigid = -(Q[:, :, None] * phi) / np.sum(Q, axis=1)[:, None, None]
    d_phi = np.matmul(modes.phi[:, None], share)  # [drive, unknown, mass, r]
    d_phi[:, :N_MASSES] += rigid[:, :, None, :]

    there = np.where(table.known, table.numbers, 0.0)
    seen = np.where(counts[:, 1:], phi / table.half[1:], 0.0)
    length = np.sqrt(np.sum(seen * seen, axis=1))
    length = np.where(length > 0, length, 1.0)
    size = np.sum(seen * (there / table.half)[1:], axis=1) / length**2
    numbers = np.concatenate(
        [(omega / (2 * np.pi))[:, None], phi * size[:, None]], axis=1
    )
    off = np.where(table.known, numbers - there, 0.0) / table.half
    d_hz = d_square / (4 * np.pi * omega[:, None])
    changes = [d_hz[:, :, None], d_phi * size[:, None, None]]
    slopes = np.moveaxis(np.concatenate(changes, axis=2) / table.half, 1, -1)
    nothing = np.zeros_like(omega)[:, None]
    scales = np.concatenate([nothing, phi / length[:, None]], axis=1) / table.half
    counted = np.where(counts, scales, 0.0)[..., None]
    along = np.sum(counted * slopes, axis=1, keepdims=True)
    return Beside(numbers, off, slopes - scales[..., None] * along, scales)


def _alike(table: Table, counts: Flags, omega: Array, phi: Array) -> Indices:
    """Say which modes of each drive are those given: [drive, mode given].

    Each is taken once. Shapes decide; frequencies do where shapes say little, for they
    may be the wrong ones.
    """
    from scipy.optimize import linear_sum_assignment

    hz = omega[:, :, None] / (2 * np.pi)
    far = np.log(hz / table.numbers[0]) / NEAR
    near = np.where(counts[:, None, 0], LIKE_IN_HZ / (1.0 + far * far), 0.0)
    given = np.where(counts[:, 1:], table.numbers[1:], np.nan)
    likeness = near + mac(phi, given)
    return np.stack([linear_sum_assignment(-each.T)[1] for each in likeness])
