"""The linear ring: its matrices, natural frequencies and growth, alone and cutting.

LAPACK takes the matrices one by one: a trial's answer is the same in any block.
"""

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.ring.harmonics import total
from tolstat.machines.ring.motion import cutting_forces, depth_of_cut, derivative
from tolstat.machines.ring.parameters import Rings, parts_of

DOUBLED = 10  # times the set depth is doubled, if forces pull the tool in
HALVED = 60  # times the bracket of the static depth is halved: to its last digit


def compliances(rings: Rings, hoop: bool) -> tuple[Array, Array]:
    """Return c_R = u K^-1 u/(pi chi) and c_T = u K^-1 v/(pi chi), m/N.

    They are the displacements of the ring at the tool by P_R and P_T, float64[trial]. K
    has blocks [[M_j, g_j], [-g_j, M_j]].
    """
    _, x, _ = parts_of(rings, hoop)
    det = (x.M * x.M + x.g * x.g) * rings.pi_chi
    c_R = x.M * (x.u_a * x.u_a + x.u_b * x.u_b) / det
    along = x.M * (x.u_a * x.v_a + x.u_b * x.v_b)
    across = x.g * (x.u_b * x.v_a - x.u_a * x.v_b)
    return total(c_R.T), total(((along + across) / det).T)


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


def matrix(rings: Rings, hoop: bool, k_R: Array | float, k_T: Array | float) -> Array:
    """Return A, y' = A y with y = (a, b, a', b', X, X'), of ring and tool.

    float64[trial, state, state]. Forces are k_R and k_T, N/m, times the change of the
    depth of cut. Equations are linear then: their slopes are those of single states.
    """
    tool, ring, _ = parts_of(rings, hoop)
    size = 4 * len(ring.s) + 2
    y = np.eye(size)[:, :, None]
    t_R = depth_of_cut(np.zeros(1), y, (), tool._replace(t_R0=0.0), ring)
    out = np.empty((size, size, len(rings.nu)))
    derivative(y, k_R * t_R, k_T * t_R, tool, ring, out)
    return out.transpose(2, 0, 1)


def ring_matrix(rings: Rings, Omega: Array, hoop: bool) -> Array:
    """Return A, y' = A y with y = (a, b, a', b'), of the ring alone at Omega, rad/s."""
    return matrix(rings._replace(Omega=Omega), hoop, 0.0, 0.0)[:, :-2, :-2]


def cutting_matrix(rings: Rings, depth: Array, hoop: bool) -> Array:
    """Return A of ring and tool about a depth of cut.

    At a depth below zero, m, they are not coupled.
    """
    # dP/dt = x P/t
    t = np.where(depth > 0.0, depth, np.inf)
    P_R, P_T = cutting_forces(np.where(depth > 0.0, depth, 1.0), rings)
    return matrix(rings, hoop, rings.x_R * P_R / t, rings.x_T * P_T / t)


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
