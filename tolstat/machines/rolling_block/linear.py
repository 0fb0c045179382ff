"""Drives from the modes they have, by linear equations: where a fit begins.

With frequencies and shapes known, (K - omega^2 M) phi = 0 is linear in the unknown
inertias and stiffnesses, and homogeneous: it says nothing of their scale.
"""

from __future__ import annotations

import numpy as np

from tolstat.machines.rolling_block.table import (
    N_MASSES,
    N_UNKNOWNS,
    Array,
    Flags,
    Table,
)
from tolstat.machines.rolling_block.topology import LINKS

ALIKE = 3e-3  # of the equations' size: what draws to the size that all have alike
LEAST = 1e-2  # of the mean of its kind: where an unknown is not positive


def linear(table: Table, counts: Flags) -> Array:
    """Solve (K - omega^2 M) phi = 0 for the unknowns, by what counts of the table.

    Parameters
    ----------
    table, counts : Table, bool[drive, 1 + mass, mode]
        What is given, and what counts of it.

    Returns
    -------
    logs : float64[drive, unknown]
        Of the unknowns, where to begin. Where the equations leave something open, all
        take as large a part in them; what is not positive is small.
    """
    phi = np.where(counts[:, 1:], table.numbers[1:], 0.0)
    square = (2 * np.pi * table.numbers[0]) ** 2
    unit = float(np.mean(square))  # of stiffnesses
    equations = np.zeros((len(counts), len(square), N_MASSES, N_UNKNOWNS))
    # an equation holds where all that enters is known
    holds = np.swapaxes(counts[:, 1:] & counts[:, :1], 1, 2)
    near = counts[:, 1:]
    for mass in range(N_MASSES):
        equations[:, :, mass, mass] = -square * phi[:, mass]
    for link, (i, j) in enumerate(LINKS):
        twist = unit * (phi[:, i] - phi[:, j])
        equations[:, :, i, N_MASSES + link] = twist
        equations[:, :, j, N_MASSES + link] = -twist
        holds[:, :, i] &= near[:, j]
        holds[:, :, j] &= near[:, i]
    # all modes alike, each by its own size
    length = np.sqrt(np.sum(phi * phi, axis=1))
    equations /= (square * np.where(length > 0, length, 1.0))[:, :, None, None]
    chosen = equations.reshape(len(counts), -1, N_UNKNOWNS)
    chosen = np.where(holds.reshape(len(counts), -1, 1), chosen, 0.0)
    size = np.sqrt(np.sum(chosen * chosen, axis=1))
    size = np.where(size > 0, size, 1.0)
    chosen = chosen / size[:, None]
    normal = np.matmul(np.swapaxes(chosen, 1, 2), chosen)
    # a homogeneous problem: least squares of it and of the distance from all alike
    normal += ALIKE**2 * np.eye(N_UNKNOWNS)
    alike = np.full((len(counts), N_UNKNOWNS, 1), ALIKE**2)
    unknowns = np.linalg.solve(normal, alike)[..., 0] / size
    kinds = np.split(unknowns, [N_MASSES], axis=1)
    least = [LEAST * np.mean(np.abs(kind), axis=1, keepdims=True) for kind in kinds]
    kinds = [np.maximum(kind, low) for kind, low in zip(kinds, least, strict=True)]
    logs = np.log(np.concatenate([kinds[0], unit * kinds[1]], axis=1))
    start: Array = logs - np.mean(logs[:, :N_MASSES], axis=1, keepdims=True)
    return start
