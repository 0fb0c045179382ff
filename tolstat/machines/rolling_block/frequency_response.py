"""Frequency response of the moment in a link to a load: poles, zeros, cancellation.

With modal damping, and loads per 1 N m,

    G(f) = sum over r of a_r / (1 - (f/f_r)^2 + 2 i zeta f/f_r),

where a_r = C_ij phi_ij,r (phi_r^T L) / omega_r^2 is what mode r adds to the moment in
the link ij under a static load L. The rigid mode twists nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.rolling_block.modes import Modes
from tolstat.machines.rolling_block.topology import load_vector

NO_PART = 1e-9  # of all modes' contributions: a mode that has no part in a response


def contributions(modes: Modes, C: Array, loads: dict[int, float]) -> Array:
    """Return the static modal contributions a_r to the moments of all links.

    Loads are N m by place: 1 is the motor's M1, which drives; 31 to 34, which brake.

    Returns
    -------
    a : float64[trial, link, mode]
        N m.
    """
    moments = sum(size * load_vector(load) for load, size in loads.items())
    omega, phi, phi_ij = modes
    # phi^T L, mass by mass: the sum is the same in any block
    work = np.zeros_like(omega)
    for mass, moment in enumerate(np.broadcast_to(moments, phi.shape[1])):
        work = work + phi[:, mass, :] * moment
    a: Array = C[:, :, None] * phi_ij * (work / (omega * omega))[:, None, :]
    return a


def response(
    frequency: Array, modes: Modes, a: Array, zeta: Array
) -> NDArray[np.complex128]:
    """Return G over the frequency, Hz, from contributions a[trial, mode], N m.

    Returns
    -------
    complex128[trial, frequency]
        N m; its size is the amplitude, its angle the phase.
    """
    ratio = 2 * np.pi * frequency / modes.omega[:, :, None]
    below = 1.0 - ratio**2 + 2j * zeta[:, None, None] * ratio
    G: NDArray[np.complex128] = np.sum(a[:, :, None] / below, axis=1)
    return G


class PolesAndZeros(NamedTuple):
    """Of the undamped response of one drive, Hz."""

    poles: Array  # ascending
    cancelled: Array  # natural frequencies that do not reach the link
    zeros: Array  # ascending; where the link is at rest


def poles_and_zeros(omega: Array, a: Array) -> PolesAndZeros:
    """Find where an undamped response is infinite, and where it is zero.

    Parameters
    ----------
    omega : float64[mode]
        Natural frequencies of one drive, rad/s.
    a : float64[mode]
        Contributions of its modes to the moment of one link, N m.

    Returns
    -------
    PolesAndZeros
        Zeros that no real frequency meets are left out.
    """
    takes_part = np.abs(a) > NO_PART * np.sum(np.abs(a))
    # x = (f/f_ref)^2 and its poles, of the order of 1
    reference = np.exp(np.mean(np.log(omega)))
    poles, part = (omega[takes_part] / reference) ** 2, a[takes_part]
    numerator = np.zeros(1)
    for r, size in enumerate(part):
        others = np.delete(poles, r)
        numerator = np.polyadd(numerator, size * np.poly(others) / np.prod(-others))
    # A moment does not jump in a link that is links away from the load: the sums of
    # a_r x_r, a_r x_r^2, ... vanish, and with each of them the highest power of x
    moment = part
    while len(numerator) > 1:
        moment = moment * poles
        if abs(np.sum(moment)) > NO_PART * np.sum(np.abs(moment)):
            break
        numerator = numerator[1:]
    roots = np.roots(numerator)
    real = np.abs(roots.imag) < 1e-9 * np.abs(roots)
    on_the_axis = np.sort(roots.real[real & (roots.real > 0)])
    return PolesAndZeros(
        poles=omega[takes_part] / (2 * np.pi),
        cancelled=omega[~takes_part] / (2 * np.pi),
        zeros=np.sqrt(on_the_axis) * reference / (2 * np.pi),
    )
