"""The paper's answers in closed form, corrected where the print is wrong.

The integration is tested against them.

References
----------
Yu. A. Semenov, N. S. Semenova, Transient processes in an elastic machine (2024, in
Russian); equation numbers are the paper's. (6) prints k1^-2 where k^-2 belongs, which
is right for b = 0 alone, and lets its second integral begin at 0 instead of t0.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.machines.elastic_machine.modes import modes_of

Array = NDArray[np.float64]


def step_response(t: ArrayLike, n: float, k: float) -> Array:
    """Return S(t): x of x'' + 2 n x' + k^2 x = H(t), at rest before.

    k^-2 [1 - e^(-n t) (cos k1 t + (n/k1) sin k1 t)], k1^2 = k^2 - n^2; with hyperbolic
    functions where n > k.

    Parameters
    ----------
    t : float64[time]
        s; zero is returned before 0.
    n, k : float
        Half the damping over the mass, natural frequency, 1/s; n >= 0 < k.
    """
    t = np.maximum(np.asarray(t, np.float64), 0.0)
    if n <= k:
        k1 = np.sqrt((k - n) * (k + n))
        decay = np.exp(-n * t)
        cos, sin_over_k1 = np.cos(k1 * t), t * np.sinc(k1 * t / np.pi)
    else:
        k1 = np.sqrt((n - k) * (n + k))
        # e^(-n t) cosh k1 t by its slower part: n - k1 = k^2/(n + k1)
        decay, faster = np.exp(-k * k / (n + k1) * t), np.expm1(-2.0 * k1 * t)
        cos, sin_over_k1 = 1.0 + 0.5 * faster, -0.5 * faster / k1
    found: Array = (1.0 - decay * (cos + n * sin_over_k1)) / k**2
    return found


def one_mass(
    t: ArrayLike, J1: float, c: float, b: float, eps0: float, t0: float, M0: float
) -> Array:
    """Return theta of one mass at constant acceleration under a load, (6).

    -(eps0 + M0/J1) S(t) + eps0 S(t - t0), from rest; periodic, overdamped or between.

    Parameters
    ----------
    t : float64[time]
        s.
    J1, c, b : float
        kg m2, N m/rad, N m s/rad.
    eps0, t0 : float
        Acceleration, rad/s2, and how long it lasts, s.
    M0 : float
        Load torque from t = 0 on, N m, against the motion.
    """
    t = np.asarray(t, np.float64)
    n, k = b / (2.0 * J1), float(np.sqrt(c / J1))
    begun = (eps0 + M0 / J1) * step_response(t, n, k)
    return eps0 * step_response(t - t0, n, k) - begun


def modal_sum(
    t: ArrayLike,
    chain: tuple[ArrayLike, ArrayLike, ArrayLike],
    accelerations: Iterable[tuple[float, float]],
    torques: Iterable[tuple[float, int, float]] = (),
) -> Array:
    """Return theta of all masses of a chain from rest, (18) and (8).

    Exact where the damping is classical, h_m^T B h_r = 0 for m != r; else off by some
    per cent of the peak, because (7) leaves out what couples the modes.

    Parameters
    ----------
    t : float64[time]
        s.
    chain : three of float64[mass]
        Moments of inertia; stiffness and damping of the spring before each mass; SI.
    accelerations : (s, rad/s2)
        When phi0'' steps, and by how much.
    torques : (s, mass, N m)
        When the load torque steps, on which mass from 1, by how much, positive in the
        direction of motion.

    Returns
    -------
    float64[time, mass]
        rad.
    """
    t = np.asarray(t, np.float64)
    m = modes_of(*(np.asarray(each, np.float64) for each in chain))
    # what each step pushes each mode by: -g_m for phi0'', h_mr for M_r
    pushes = [(at, -step * m.g) for at, step in accelerations]
    pushes += [(at, step * m.h[:, mass - 1]) for at, mass, step in torques]
    theta = np.zeros((*t.shape, len(m.k)))
    for mode, k in enumerate(m.k):
        for at, push in pushes:
            z = step_response(t - at, m.zeta[mode] * k, k) * push[mode] / m.alpha[mode]
            theta = theta + z[..., None] * m.h[mode]
    return theta


def two_masses(
    t: ArrayLike, J: float, c: float, eps0: float, t0: float
) -> tuple[Array, Array]:
    """Return theta_1, theta_2 of the paper's two-mass example, undamped.

    J1 = 2 J, J2 = J, c01 = 2 c, c12 = c at constant acceleration. theta_2 is printed;
    theta_1 follows likewise from rho_1 = 4 J/3c, J/6c.

    Parameters
    ----------
    t : float64[time]
        s.
    J, c : float
        kg m2, N m/rad.
    eps0, t0 : float
        Acceleration, rad/s2, and how long it lasts, s.
    """
    t = np.asarray(t, np.float64)
    k1, k2 = np.sqrt(0.5 * c / J), np.sqrt(2.0 * c / J)
    after = np.maximum(t - t0, 0.0)
    # of each mode, while it starts and then: 1 - cos k t, cos k (t - t0) - cos k t
    first, second = (
        np.cos(k1 * after) - np.cos(k1 * t),
        np.cos(k2 * after) - np.cos(k2 * t),
    )
    unit = J * eps0 / c
    theta_1: Array = -unit * (4.0 / 3.0 * first + second / 6.0)
    theta_2: Array = -unit * (8.0 / 3.0 * first - second / 6.0)
    return theta_1, theta_2
