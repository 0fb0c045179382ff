"""Equations of motion of ring and tool, once: in NumPy, for any number of harmonics.

    C_j a_j'' + 2 s_j a_1'' + d_j a_j' + 2 Omega l_j b_j' + M_j a_j + g_j b_j = f_aj
    C_j b_j'' + 2 t_j b_1'' + d_j b_j' - 2 Omega l_j a_j' + M_j b_j - g_j a_j = f_bj
    m_c X'' + c_c X' + K_C X + P_R = 0,     j = 2 ... N

with d_j = nu K_T n_j^2, g_j = j Omega d_j, M_j = nu n_j^2 - l_j^2 Omega^2; the second
term of M_j is cancelled where the tension of the spinning ring is counted. These are
the paper's equations, with harmonic 1 eliminated instead of N: a_1 = sum s_j a_j, b_1 =
sum t_j b_j. Cutting forces act while the depth of cut t_R is above zero. Rows are of
harmonics; called on arrays [row, lane] the equations run in NumPy, compiled they run in
registers.

In (5) the second square is (U' - Omega V)^2; the tool's damping, printed K_T, is c_c
here.
"""

from collections import namedtuple
from typing import Any

import numpy as np

from tolstat.arrays import Array

# tool, force and speed of each trial, float64[lanes], SI; c_R, c_T in N at 1 mm;
# per_a is 1/(1 + sum 2 s_j^2/C_j), per_b 1/(1 + sum 2 t_j^2/C_j); cos_R, sin_R are of
# theta_R, per_cos and per_sin 1/cos alpha and 1/sin alpha
Tool = namedtuple(
    "Tool",
    "per_m_c c_c K_C t_R0 c_R x_R c_T x_T Omega per_pi_chi per_a per_b "
    "pi_chi cos_R sin_R per_cos per_sin",
)
# the ring, float64[harmonic, lanes], SI: d = nu K_T n^2, gyro = 2 Omega l; at the tool
# U = u_a a + u_b b, V = v_a a + v_b b
Ring = namedtuple("Ring", "per_C d gyro M g s t u_a u_b v_a v_b")
# the parameters of the tool come first, those of the ring follow
HEAD, RING = len(Tool._fields), len(Ring._fields)


def depth_of_cut(t: Array, y: Array, e: Any, tool: Tool, ring: Ring) -> Array:
    """Return t_R = t_R0 + U(theta_R) + X and the out-of-roundness of the blank, m.

    At t[lanes], s; y[state, lanes] are a, b, a', b' of harmonics 2 to N, m, m/s, then
    X, X'; e[3 lobes, lanes], or its rows, are, of each harmonic k of out-of-roundness,
    k, e_k cos(k theta_R + psi_k) and e_k sin(k theta_R + psi_k), m.
    """
    n = len(ring.s)
    t_R: Array = tool.t_R0 + y[4 * n]
    for j in range(n):
        t_R = t_R + (ring.u_a[j] * y[j] + ring.u_b[j] * y[n + j])
    for i in range(len(e) // 3):
        turn = e[3 * i] * tool.Omega * t
        t_R = t_R + (e[3 * i + 1] * np.cos(turn) + e[3 * i + 2] * np.sin(turn))
    return t_R


def cutting_forces(t_R: Array, tool: Any) -> tuple[Array, Array]:
    """Return P_R and P_T, N, (10), of `c_R, x_R, c_T, x_T`; zero out of the cut."""
    mm = np.maximum(1e3 * t_R, 0.0)
    cuts = t_R > 0.0
    P_R = np.where(cuts, tool.c_R * mm**tool.x_R, 0.0)
    # the tangential force is mostly proportional to the depth: this saves a power
    proportional = tool.x_T == 1.0
    powered = mm
    if not np.all(proportional):
        powered = np.where(proportional, mm, mm**tool.x_T)
    P_T = np.where(cuts, tool.c_T * powered, 0.0)
    return P_R, P_T


def derivative(
    y: Array, P_R: Array, P_T: Array, tool: Tool, ring: Ring, out: Array
) -> tuple[Array, Array]:
    """Fill a', b', a'', b'', X', X'' in out[state, lanes]; return a_1'' and b_1''.

    y[state, lanes] as in `depth_of_cut`; cutting forces P_R, P_T, N, [lanes].
    """
    n = len(ring.s)
    p_R, p_T = P_R * tool.per_pi_chi, P_T * tool.per_pi_chi
    a_1, b_1 = 0.0 * P_R, 0.0 * P_R
    for j in range(n):
        a, b, a_, b_ = y[j], y[n + j], y[2 * n + j], y[3 * n + j]
        f_a = -(p_R * ring.u_a[j] + p_T * ring.v_a[j])
        f_b = -(p_R * ring.u_b[j] + p_T * ring.v_b[j])
        d, gyro, M, g = ring.d[j], ring.gyro[j], ring.M[j], ring.g[j]
        r_a = (f_a - d * a_ - gyro * b_ - M * a - g * b) * ring.per_C[j]
        r_b = (f_b - d * b_ + gyro * a_ - M * b + g * a) * ring.per_C[j]
        a_1 = a_1 + ring.s[j] * r_a
        b_1 = b_1 + ring.t[j] * r_b
        out[j], out[n + j] = a_, b_
        out[2 * n + j], out[3 * n + j] = r_a, r_b
    # the mass matrix is diag C + 2 s s^T: Sherman and Morrison
    a_1__, b_1__ = a_1 * tool.per_a, b_1 * tool.per_b
    for j in range(n):
        twice = 2.0 * ring.per_C[j]
        out[2 * n + j] = out[2 * n + j] - twice * ring.s[j] * a_1__
        out[3 * n + j] = out[3 * n + j] - twice * ring.t[j] * b_1__
    X, X_ = y[4 * n], y[4 * n + 1]
    out[4 * n] = X_
    out[4 * n + 1] = -(tool.c_c * X_ + tool.K_C * X + P_R) * tool.per_m_c
    return a_1__, b_1__


def reactions(
    a_1__: Array, b_1__: Array, P_R: Array, P_T: Array, tool: Tool
) -> tuple[Array, Array]:
    """Return the forces of the rollers at pi - alpha and pi + alpha on the ring, N.

    Outwards, without gravity: the multipliers of (3) and (4), from the equations of
    harmonic 1, 2 pi chi a_1'' = Q_a1 - (l_1 + l_2) cos alpha and
    2 pi chi b_1'' = Q_b1 + (l_1 - l_2) sin alpha, with Q of (8), (9).
    """
    Q_a = P_T * tool.sin_R - P_R * tool.cos_R
    Q_b = -P_R * tool.sin_R - P_T * tool.cos_R
    mean = (0.5 * Q_a - tool.pi_chi * a_1__) * tool.per_cos
    difference = (tool.pi_chi * b_1__ - 0.5 * Q_b) * tool.per_sin
    return mean + difference, mean - difference
