"""A second ring: all 2 N coordinates on the null space of the two supports.

Nothing here is the machine's: no harmonic is eliminated, matrices are full.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigvals, null_space

from tolstat.machines.ring.machine import Ring, simulated
from tolstat.machines.ring.parameters import nominal
from tolstat.model.settings import make

DEG = np.pi / 180.0
CASES = {
    "A": {"radius": 3.025, "thickness": 0.05, "tool_stiffness": 1e5},
    "B": {"radius": 3.05, "thickness": 0.1, "tool_stiffness": 5e5},
    "C": {"radius": 3.25, "thickness": 0.5, "tool_stiffness": 1e6},
    "F": {
        "radius": 3.0, "thickness": 0.06, "support_angle": 60 * DEG,
        "tool_angle": 120 * DEG, "tool_stiffness": 3e5, "tool_mass": 150.0,
        "tool_damping": 50.0, "speed": 0.8, "duration": 4.0,
    },
}  # fmt: skip


class Full(NamedTuple):
    """Equations M q'' + D q' + K q = f on the null space; U = u q, V = v q."""

    M: np.ndarray
    D: np.ndarray
    K: np.ndarray
    u: np.ndarray
    v: np.ndarray
    pi_chi: float
    Z: np.ndarray
    free: tuple[np.ndarray, ...]  # M, D, K, u, v of all coordinates, the constraints


def full(s, Omega=None):
    """Build them for settings of the ring, alone."""
    Omega = s.speed if Omega is None else Omega
    r, h, w, N = s.middle_radius, s.thickness, s.width, s.harmonics
    F, J = w * h, w * h**3 / 12
    nu, pi_chi = (
        s.youngs_modulus * J / (s.density * F * r**4),
        np.pi * r * s.density * F,
    )
    j = np.arange(1, N + 1)
    n2, l = (j**2 - 1) ** 2, j - 1 / j
    M_j = nu * n2 - (0.0 if s.hoop else 1.0) * l**2 * Omega**2
    g, d, C = (
        nu * s.ring_damping * j * n2 * Omega,
        nu * s.ring_damping * n2,
        1 + 1 / j**2,
    )
    zero = np.zeros((N, N))
    M = np.block([[np.diag(C), zero], [zero, np.diag(C)]])
    gyro = np.diag(2 * Omega * l)
    D = np.block([[np.diag(d), gyro], [-gyro, np.diag(d)]])
    K = np.block([[np.diag(M_j), np.diag(g)], [-np.diag(g), np.diag(M_j)]])
    alpha = s.support_angle / 2
    held = np.array(
        [np.concatenate([np.cos(j * x), np.sin(j * x)]) for x in (np.pi - alpha, np.pi + alpha)]
    )  # fmt: skip
    Z = null_space(held)
    th = s.tool_angle
    u = np.concatenate([np.cos(j * th), np.sin(j * th)])
    v = np.concatenate([-np.sin(j * th) / j, np.cos(j * th) / j])
    free = (M, D, K, u, v, held)
    return Full(Z.T @ M @ Z, Z.T @ D @ Z, Z.T @ K @ Z, u @ Z, v @ Z, pi_chi, Z, free)


def pulls(s, q, q_, t_R):
    """Multipliers of both constraints, N: all coordinates with two unknown forces."""
    f = full(s)
    M, D, K, u, v, held = f.free
    P_R, P_T = forces(s, t_R)
    rest = -(P_R * u + P_T * v) / f.pi_chi - D @ q_ - K @ q
    both = np.block([[M, -held.T], [held, np.zeros((2, 2))]])
    return np.linalg.solve(both, np.append(rest, [0.0, 0.0]))[-2:] * f.pi_chi


def eigenvalues(f):
    """All eigenvalues of M x^2 + D x + K."""
    n = len(f.M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-f.K, -f.D]])
    B = np.block([[np.eye(n), np.zeros((n, n))], [np.zeros((n, n)), f.M]])
    return eigvals(A, B)


def forces(s, t):
    """P_R, P_T at a depth t, m."""
    if t <= 0:
        return 0.0, 0.0
    V = 60 * s.speed * (s.middle_radius + s.thickness / 2)
    mm = 1e3 * t
    P_R = s.radial_coefficient * mm**s.force_exponent
    P_T = s.tangential_coefficient * mm**s.tangential_depth_exponent
    P_R *= s.feed**s.radial_feed_exponent * V**s.radial_speed_exponent
    P_T *= s.feed**s.tangential_feed_exponent * V**s.tangential_speed_exponent
    return 10 * s.cutting_force * P_R, 10 * s.cutting_force * P_T


def blank(s, t):
    """What the blank is out of round at the tool."""
    total = 0.0 * t
    for k in range(1, 13):
        e = getattr(s, f"out_of_roundness_{k}")
        psi = getattr(s, f"out_of_roundness_{k}_phase")
        total = total + e * np.cos(k * (s.tool_angle - s.speed * t) + psi)
    return total


def cut(s, times):
    """Integrate from rest; t_R, U, X at the times, and t_R at all steps' fine points."""
    f = full(s)
    n = len(f.M)
    inverse = np.linalg.inv(f.M)

    def rates(t, y):
        q, q_, X, X_ = y[:n], y[n : 2 * n], y[2 * n], y[2 * n + 1]
        P_R, P_T = forces(s, s.depth + f.u @ q + X + blank(s, t))
        q__ = inverse @ (-(P_R * f.u + P_T * f.v) / f.pi_chi - f.D @ q_ - f.K @ q)
        X__ = -(s.tool_damping * X_ + s.tool_stiffness * X + P_R) / s.tool_mass
        return np.concatenate([q_, q__, [X_, X__]])

    found = solve_ivp(
        rates, (0, s.duration), np.zeros(2 * n + 2), method="DOP853", rtol=1e-10,
        atol=1e-15, dense_output=True,
    )  # fmt: skip

    def seen(times):
        y = found.sol(times)
        U, X = f.u @ y[:n], y[2 * n]
        return s.depth + U + X + blank(s, times), U, X

    return seen(np.asarray(times, float)), seen(np.linspace(0, s.duration, 40001))[0]


def settings_of(**given):
    return make(Ring(), given)


def states_of(settings, times):
    """States at the times, and the rings, of the nominal machine."""
    rings = nominal(settings)
    return simulated(rings, settings, np.asarray(times, float)).history[0], rings
