"""The linear ring: its matrices, natural frequencies and growth, alone and cutting.

LAPACK takes the matrices one by one: a trial's answer is the same in any block.
"""

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.ring.harmonics import harmonics, inverse, total
from tolstat.machines.ring.motion import cutting_forces
from tolstat.machines.ring.parameters import Rings, terms_of

DOUBLED = 10  # times the set depth is doubled, if forces pull the tool in
HALVED = 60  # times the bracket of the static depth is halved: to its last digit


def compliances(rings: Rings, hoop: bool) -> tuple[Array, Array]:
    """Return c_R = u K^-1 u/(pi chi) and c_T = u K^-1 v/(pi chi), m/N.

    They are the displacements of the ring at the tool by P_R and P_T, float64[trial]. K
    has blocks [[M_j, g_j], [-g_j, M_j]].
    """
    x, tool = terms_of(rings, rings.Omega, hoop), rings.tool_place
    det = (x.M * x.M + x.g * x.g) * rings.pi_chi[:, None]
    c_R = total(x.M * (tool.u_a * tool.u_a + tool.u_b * tool.u_b) / det)
    along = x.M * (tool.u_a * tool.v_a + tool.u_b * tool.v_b)
    across = x.g * (tool.u_b * tool.v_a - tool.u_a * tool.v_b)
    return c_R, total((along + across) / det)


def static_depth(rings: Rings, hoop: bool) -> Array:
    """Return the static depth of cut, m, float64[trial]; ring and tool rest at it.

    t = t_R0 - P_R(t) (c_R + 1/K_C) - P_T(t) c_T, without out-of-roundness; t_R0 if that
    is not above zero. NaN if there is none: without hoop tension the ring does not rest
    at Omega >= 2 sqrt nu, and forces may pull the tool in without end.
    """
    c_R, c_T = compliances(rings, hoop)
    both = c_R + 1.0 / rings.K_C

    def excess(t: Array) -> Array:
        P_R, P_T = cutting_forces(t, rings)
        return t - rings.t_R0 + P_R * both + P_T * c_T

    # the first sign change above zero: doubled until it is passed, then halved
    lower, upper = np.zeros_like(rings.t_R0), np.maximum(rings.t_R0, 0.0)
    for _ in range(DOUBLED):
        short = excess(upper) < 0.0
        lower = np.where(short, upper, lower)
        upper = np.where(short, 2.0 * upper, upper)
    passed = excess(upper) >= 0.0
    for _ in range(HALVED):
        middle = 0.5 * (lower + upper)
        short = excess(middle) < 0.0
        lower, upper = np.where(short, middle, lower), np.where(short, upper, middle)
    rests = passed if hoop else passed & (rings.Omega < 2.0 * np.sqrt(rings.nu))
    depth = np.where(rings.t_R0 > 0.0, upper, rings.t_R0)
    return np.where(rests, depth, np.nan)


def ring_matrix(rings: Rings, Omega: Array, hoop: bool) -> Array:
    """Return A, y' = A y with y = (a, b, a', b'), of the ring alone at Omega, rad/s.

    float64[trial, 4 harmonics, 4 harmonics]: harmonics 2 to N.
    """
    x = terms_of(rings, Omega, hoop)
    C = harmonics(rings.on.s.shape[1] + 1).C
    n = len(C)
    a, b, a_, b_ = (slice(i * n, (i + 1) * n) for i in range(4))
    per_a, per_b = inverse(rings.on.s, C), inverse(rings.on.t, C)
    A = np.zeros((len(rings.nu), 4 * n, 4 * n))
    rows = np.arange(2 * n)
    A[:, rows, 2 * n + rows] = 1.0
    d, gyro, M, g = (term[:, None, :] for term in x)
    A[:, a_, a], A[:, a_, b] = -per_a * M, -per_a * g
    A[:, b_, a], A[:, b_, b] = per_b * g, -per_b * M
    A[:, a_, a_], A[:, a_, b_] = -per_a * d, -per_a * gyro
    A[:, b_, a_], A[:, b_, b_] = per_b * gyro, -per_b * d
    return A


def cutting_matrix(rings: Rings, depth: Array, hoop: bool) -> Array:
    """Return A of ring and tool about a depth of cut, y = (a, b, a', b', X, X').

    At a depth below zero, m, they are not coupled.
    """
    C, tool = harmonics(rings.on.s.shape[1] + 1).C, rings.tool_place
    n = len(C)
    A = np.zeros((len(rings.nu), 4 * n + 2, 4 * n + 2))
    A[:, : 4 * n, : 4 * n] = ring_matrix(rings, rings.Omega, hoop)
    # dP/dt = x P/t
    t = np.where(depth > 0.0, depth, 1.0)
    P_R, P_T = cutting_forces(t, rings)
    k_R = np.where(depth > 0.0, rings.x_R * P_R / t, 0.0)
    k_T = np.where(depth > 0.0, rings.x_T * P_T / t, 0.0)
    R, T = (k_R / rings.pi_chi)[:, None], (k_T / rings.pi_chi)[:, None]
    f_a, f_b = R * tool.u_a + T * tool.v_a, R * tool.u_b + T * tool.v_b
    a__ = (inverse(rings.on.s, C) @ f_a[:, :, None])[:, :, 0]
    b__ = (inverse(rings.on.t, C) @ f_b[:, :, None])[:, :, 0]
    push = np.concatenate([a__, b__], axis=1)
    sees = np.concatenate([tool.u_a, tool.u_b, np.ones((len(t), 1))], axis=1)
    deepens = [*range(2 * n), 4 * n]  # a, b, X
    A[:, 2 * n : 4 * n, deepens] -= push[:, :, None] * sees[:, None, :]
    A[:, 4 * n, 4 * n + 1] = 1.0
    A[:, 4 * n + 1, deepens] -= (k_R / rings.m_c)[:, None] * sees
    A[:, 4 * n + 1, 4 * n] -= rings.K_C / rings.m_c
    A[:, 4 * n + 1, 4 * n + 1] = -rings.c_c / rings.m_c
    return A


def growth_rate(rings: Rings, depth: Array, hoop: bool) -> Array:
    """Return the largest real part of the eigenvalues of ring and tool, 1/s.

    A static depth, m, that is NaN gives NaN.
    """
    finite = np.isfinite(depth)
    A = cutting_matrix(rings, np.where(finite, depth, 0.0), hoop)
    growth = np.linalg.eigvals(A).real.max(axis=1)
    return np.where(finite, growth, np.nan)


def ring_eigenvalues(rings: Rings, Omega: Array, hoop: bool) -> NDArray[np.complex128]:
    """Return those of the ring alone, [trial, 4 harmonics], 1/s, by |Im|, then Re."""
    eigenvalues = np.linalg.eigvals(ring_matrix(rings, Omega, hoop)).astype(complex)
    order = np.lexsort((eigenvalues.real, np.abs(eigenvalues.imag)), axis=1)
    return np.take_along_axis(eigenvalues, order, axis=1)
