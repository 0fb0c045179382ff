"""Harmonics of the ring on two supports, with the first one eliminated.

U = sum a_j cos j theta + b_j sin j theta outwards, V = sum (b_j cos j theta - a_j sin j
theta)/j, theta in space; the supports stand at pi -+ alpha. There U = 0, so that

    a_1 = sum s_j a_j,  b_1 = sum t_j b_j,   j = 2 ... N,

whatever alpha between 0 and 90 deg. The paper eliminates harmonic N instead, which is
singular where sin 2 N alpha = 0.
"""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array


class Harmonics(NamedTuple):
    """The paper's constants of harmonics 2 to N, each float64[harmonic]."""

    j: Array
    C: Array  # 1 + 1/j^2
    l: Array  # j - 1/j
    n: Array  # j^2 - 1


class Supported(NamedTuple):
    """Coefficients of two supports, each float64[trial, harmonic]."""

    s: Array  # a_1 = sum s_j a_j; Q_j = 2 s_j of the paper
    t: Array  # b_1 = sum t_j b_j; X_j = 2 t_j of the paper


class Place(NamedTuple):
    """U = u_a a + u_b b and V = v_a a + v_b b at a place, [trial, harmonic]."""

    u_a: Array
    u_b: Array
    v_a: Array
    v_b: Array


def harmonics(N: int) -> Harmonics:
    """Return the constants of harmonics 2 to N."""
    j = np.arange(2.0, N + 1.0)
    return Harmonics(j, 1.0 + 1.0 / (j * j), j - 1.0 / j, j * j - 1.0)


def supported(alpha: Array, N: int) -> Supported:
    """Return the coefficients that eliminate the first of N harmonics, (3), (4).

    alpha[trial] is half the angle between the supports, rad, between 0 and pi/2.
    """
    j = np.arange(2, N + 1)
    sign = np.where(j % 2 == 0, 1.0, -1.0)
    angle = alpha[:, None] * j
    return Supported(
        sign * np.cos(angle) / np.cos(alpha)[:, None],
        sign * np.sin(angle) / np.sin(alpha)[:, None],
    )


def displacements(theta: Array, on: Supported) -> Place:
    """Return the displacements at theta[trial], an angle in space, (1), (2)."""
    j = np.arange(2, on.s.shape[1] + 2)
    angle = theta[:, None] * j
    cos, sin = np.cos(theta)[:, None], np.sin(theta)[:, None]
    return Place(
        np.cos(angle) + on.s * cos,
        np.sin(angle) + on.t * sin,
        -np.sin(angle) / j - on.s * sin,
        np.cos(angle) / j + on.t * cos,
    )


def nu_of(E: Array, rho: Array, w: Array, h: Array, r: Array) -> Array:
    """Return nu = E J/(rho F r^4), 1/s2, of rings of section w x h."""
    F = w * h
    J = w * h * h * h / 12.0
    return E * J / (rho * F * (r * r) * (r * r))


def total(terms: Array) -> Array:
    """Return the sum of terms[trial, harmonic], the same in any block."""
    return np.cumsum(terms, axis=1)[:, -1]


def shared(s: Array, C: Array) -> Array:
    """Return 1/(1 + 2 s C^-1 s), float64[trial], by which (diag C + 2 s s^T) is solved.

    Sherman and Morrison.
    """
    return 1.0 / (1.0 + total(2.0 * s * s / C))


def inverse(s: Array, C: Array) -> Array:
    """Return (diag C + 2 s s^T)^-1, of masses, float64[trial, harmonic, harmonic]."""
    per, scaled = shared(s, C), s / C
    matrix = -2.0 * per[:, None, None] * scaled[:, :, None] * scaled[:, None, :]
    diagonal = np.arange(len(C))
    matrix[:, diagonal, diagonal] += 1.0 / C
    return matrix
