"""The speed from which the ring alone flutters, without friction and hoop tension.

In units of sqrt nu only support angle and N decide it. Up to 2 sqrt nu the ring
is stable, because every M_j is positive; at 2 its lowest frequency is zero; beyond, it
is held by gyroscopic forces until two frequencies meet: from there on they are complex.
With p = -lambda^2 the equations are those of harmonic 1 alone, F(p, Omega) = 0 below;
where frequencies meet dF/dp = 0, too.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.machines.ring.harmonics import (
    Supported,
    harmonics,
    inverse,
    supported,
    total,
)

FREE = float(np.sqrt(20.0))  # of the free ring, and the highest there is
NOTICED = 1e-6  # of sqrt nu: the least growth that counts
APART = 1e-3  # step between speeds: near 102 deg the first flutter is so brief
AT_ONCE = 100
BISECTED = 40
ROUNDS = 12  # of Newton's
STEP = 1e-7  # of p and of Omega, for the slopes of F and dF/dp
NEAR = 1e-4  # of the speed: so far below it, it must be stable
MET = 1e-8  # as exactly F vanishes, whose terms are of size 1


def squares(Omega: Array, on: Supported) -> NDArray[np.complex128]:
    """Return p = -lambda^2 of all modes without friction, nu = 1.

    complex128[trial, 2 harmonics], at Omega[trial] in units of sqrt nu; in no order;
    real and above zero where the ring is stable. With b' for the second half of the
    coordinates the matrices are half as large: [[M, 2 Omega l], [0, M]] - p [[C_a, 0],
    [-2 Omega l, C_b]].
    """
    k = harmonics(on.s.shape[1] + 1)
    n = len(k.j)
    rows = np.arange(n)
    M = k.n * k.n - k.l * k.l * (Omega * Omega)[:, None]
    gyro = 2.0 * Omega[:, None] * k.l
    per_a, per_b = inverse(on.s, k.C), inverse(on.t, k.C)
    H = np.zeros((len(Omega), 2 * n, 2 * n))
    H[:, :n, :n] = per_a * M[:, None, :]
    H[:, :n, n:] = per_a * gyro[:, None, :]
    # per_b (gyro (the rows above) + (0, M)), harmonic by harmonic
    below = gyro[:, :, None] * H[:, :n]
    below[:, rows, n + rows] += M
    for j in range(n):
        H[:, n:] += per_b[:, :, j, None] * below[:, None, j]
    return np.linalg.eigvals(H).astype(complex)


def flutters(Omega: Array, on: Supported) -> Truths:
    """Return whether any motion grows, bool[trial]; Omega and growth of sqrt nu."""
    growth = np.sqrt(-squares(Omega, on)).real.max(axis=1)
    return np.asarray(growth > NOTICED)


def _meeting(p: Array, Omega: Array, on: Supported) -> tuple[Array, Array]:
    """Return F and dF/dp, each float64[trial].

    (1 - 2 p S)(1 - 2 p T) - 16 Omega^2 p^3 X^2 with, summed over the harmonics,
    S = s^2 m/D, T = t^2 m/D, X = s t l/D, m = M - C p, D = m^2 - 4 Omega^2 l^2 p.
    """
    k = harmonics(on.s.shape[1] + 1)
    p_, speed = p[:, None], Omega[:, None]
    m = k.n * k.n - k.l * k.l * (speed * speed) - k.C * p_
    w = 4.0 * k.l * k.l * (speed * speed)
    D = m * m - w * p_
    D_p = -2.0 * k.C * m - w
    per, per_p = m / D, (-k.C * D - m * D_p) / (D * D)
    cross, cross_p = k.l / D, -k.l * D_p / (D * D)
    ss, tt, st = on.s * on.s, on.t * on.t, on.s * on.t
    S, T, X = total(ss * per), total(tt * per), total(st * cross)
    S_p, T_p, X_p = total(ss * per_p), total(tt * per_p), total(st * cross_p)
    F_a, F_b = 1.0 - 2.0 * p * S, 1.0 - 2.0 * p * T
    F_a_p, F_b_p = -2.0 * (S + p * S_p), -2.0 * (T + p * T_p)
    both = 16.0 * Omega * Omega * p * p
    F = F_a * F_b - both * p * X * X
    F_p = F_a_p * F_b + F_a * F_b_p
    F_p = F_p - both * (3.0 * X * X + 2.0 * p * X * X_p)
    return F, F_p


def _newton(p: Array, Omega: Array, on: Supported) -> tuple[Array, Array]:
    """Return where two frequencies meet, p and Omega, near those that are given."""
    for _ in range(ROUNDS):
        F, F_p = _meeting(p, Omega, on)
        dp, dOmega = STEP * p, STEP * Omega
        F_1, F_p_1 = _meeting(p + dp, Omega, on)
        F_2, F_p_2 = _meeting(p, Omega + dOmega, on)
        a, b = (F_1 - F) / dp, (F_2 - F) / dOmega
        c, d = (F_p_1 - F_p) / dp, (F_p_2 - F_p) / dOmega
        det = a * d - b * c
        p = p - (d * F - b * F_p) / det
        Omega = Omega - (a * F_p - c * F) / det
    return p, Omega


def _bisected(on: Supported) -> tuple[Array, Array]:
    """Return p and Omega where two frequencies meet, of one ring, by bisection."""
    repeated = Supported(*(np.repeat(values, AT_ONCE, axis=0) for values in on))
    begin, unstable = 2.0, np.zeros(AT_ONCE, dtype=bool)
    while not unstable.any():
        speeds = begin + APART * np.arange(1.0, AT_ONCE + 1.0)
        unstable = flutters(speeds, repeated)
        begin = float(speeds[-1])
    upper = speeds[unstable][:1]
    lower = upper - APART
    for _ in range(BISECTED):
        middle = 0.5 * (lower + upper)
        if flutters(middle, on)[0]:
            upper = middle
        else:
            lower = middle
    met = squares(upper, on)[0]
    return np.array([met[np.argmax(np.abs(met.imag))].real]), 0.5 * (lower + upper)


@cache
def _nominal(support_angle: float, N: int) -> tuple[float, float]:
    """Return p and Omega where two frequencies meet, of the nominal supports."""
    on = supported(np.array([0.5 * support_angle]), N)
    p, Omega = _bisected(on)
    return float(p[0]), float(Omega[0])


def flutter_speed(alpha: Array, support_angle: float, N: int) -> Array:
    """Return the lowest speed of flutter over sqrt nu, float64[trial], of N harmonics.

    alpha[trial], rad, is half the angle between the supports. The search begins at
    their nominal angle, rad. A ring for which that finds no onset, because others of
    its frequencies meet first, is searched by itself.
    """
    alphas, inverse_of = np.unique(alpha, return_inverse=True)
    on = supported(alphas, N)
    p, Omega = (np.full_like(alphas, start) for start in _nominal(support_angle, N))
    with np.errstate(all="ignore"):
        p, Omega = _newton(p, Omega, on)
        F, _ = _meeting(p, Omega, on)
        met = (np.abs(F) < MET) & (p > 0.0) & (Omega > 2.0)
        met = met & (Omega < FREE * (1.0 + NEAR))
    below = np.where(met, Omega * (1.0 - NEAR), 2.0)
    met = met & ~flutters(below, on)
    for i in np.flatnonzero(~met):
        ring = Supported(on.s[i : i + 1], on.t[i : i + 1])
        Omega[i] = _bisected(ring)[1][0]
    return Omega[inverse_of]
