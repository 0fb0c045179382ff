"""Moments after loads have stepped, in closed form, mode by mode.

The machine's answers are integrated (`motion`); these are what they are held against,
and what the view of pulses draws.
"""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.modes import Modes


def step(time: Array, omega: Array, zeta: Array) -> Array:
    """Return how a mode follows a unit step of its load at time 0, from rest.

    s(t) = 1 - exp(-zeta omega t) (cos omega_d t + zeta omega/omega_d sin omega_d t),
    with omega_d = omega sqrt(1 - zeta^2); written by its two roots, so that damping may
    be critical or more.

    Parameters
    ----------
    time : float64[time]
        s; before 0 nothing moves.
    omega : float64[trial, mode]
        Natural frequencies, rad/s.
    zeta : float64[trial]
        Damping ratio.

    Returns
    -------
    float64[trial, mode, time]
    """
    z = zeta[:, None, None]
    w = omega[:, :, None]
    t = np.maximum(time, 0.0)
    j_omega_d = w * np.sqrt(z * z - 1.0 + 0j)
    slow = j_omega_d - z * w  # of two roots that are real
    # (exp(slow t) - exp(fast t))/(slow - fast), which is t exp(slow t) where they meet
    apart = np.where(j_omega_d == 0.0, 1.0, 2.0 * j_omega_d)
    parted = np.where(j_omega_d == 0.0, t, -np.expm1(-2.0 * j_omega_d * t) / apart)
    followed: Array = (1.0 - np.exp(slow * t) * (1.0 - slow * parted)).real
    return followed


def moments(
    time: Array, modes: Modes, zeta: Array, steps: list[tuple[float, Array]]
) -> Array:
    """Return the elastic moments of all links after steps of the loads, from rest.

    Parameters
    ----------
    time : float64[time]
        s.
    modes : Modes
        Of the drives.
    zeta : float64[trial]
        Damping ratio.
    steps : list of (float, float64[trial, link, mode])
        When, s; and the static modal contributions of what steps then, N m.

    Returns
    -------
    float64[trial, link, time]
        M_ij = C_ij (phi_i - phi_j), N m.
    """
    total = np.zeros((len(zeta), modes.phi_ij.shape[1], len(time)))
    for begin, a in steps:
        total += a @ step(time - begin, modes.omega, zeta)
    return total
