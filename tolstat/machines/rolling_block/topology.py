"""What is joined to what: masses, links, stands of the drive, by the paper's numbers.

References
----------
P. V. Krot, Dynamic model of the gear drive of variable structure of a high-speed
wire-rod rolling block (2010, in Russian); Fig. 3 and the equations (1) are the paper's.
"""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array

MASSES = (
    "motor",
    "stage A",
    "stage B",
    "stage C",
    "stage D",
    "rolls 31",
    "rolls 32",
    "rolls 33",
    "rolls 34",
)
# which masses each link joins, numbered from 0; motor side first
LINKS = ((0, 1), (1, 2), (2, 3), (2, 4), (3, 5), (3, 6), (4, 7), (4, 8))
LINK_NAMES = tuple(f"{i + 1}{j + 1}" for i, j in LINKS)
MOTOR = 0
STANDS = {31: 5, 32: 6, 33: 7, 34: 8}  # mass of each stand
LOADS = {1: MOTOR, **STANDS}  # where a moment acts: the motor's M1, and the stands


def _beyond(link: int) -> set[int]:
    """Return the masses on the far side of a link, seen from the motor."""
    found = {LINKS[link][1]}
    for near, far in LINKS:
        if near in found:
            found.add(far)
    return found


# M_ij,static of one newton metre in all, a quarter on each stand: 1, 1, 1/2, 1/2, 1/4
STATIC_SHARES = tuple(
    len(_beyond(link) & set(STANDS.values())) / len(STANDS)
    for link in range(len(LINKS))
)


def stiffness_matrix(C: Array) -> Array:
    """Assemble the stiffness matrix of equations (1).

    Parameters
    ----------
    C : float64[..., link]
        Stiffnesses, N m/rad.

    Returns
    -------
    K : float64[..., mass, mass]
        N m/rad; K phi is what the links take from each mass.
    """
    K = np.zeros((*C.shape[:-1], len(MASSES), len(MASSES)))
    for link, (i, j) in enumerate(LINKS):
        K[..., i, i] += C[..., link]
        K[..., j, j] += C[..., link]
        K[..., i, j] -= C[..., link]
        K[..., j, i] -= C[..., link]
    return K


def twists(phi: Array) -> Array:
    """Return phi_ij = phi_i - phi_j of each link.

    Parameters
    ----------
    phi : float64[..., mass, mode]
        Angles, rad, or mode shapes.

    Returns
    -------
    float64[..., link, mode]
    """
    near, far = ([link[end] for link in LINKS] for end in (0, 1))
    difference: Array = phi[..., near, :] - phi[..., far, :]
    return difference


def load_vector(load: int) -> Array:
    """Return the moments on the masses where one load of 1 N m acts.

    Parameters
    ----------
    load : int
        1: the motor's M1, which drives; 31 to 34: a stand, which brakes.

    Returns
    -------
    float64[mass]
        N m, positive in the direction of motion.
    """
    moments = np.zeros(len(MASSES))
    moments[LOADS[load]] = 1.0 if LOADS[load] == MOTOR else -1.0
    return moments
