"""Natural frequencies and shapes of the chain, and the residual vibration of each.

In alpha, beta, gamma the paper prints h_s for h_m.
"""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.elastic_machine.motion import acceleration
from tolstat.machines.elastic_machine.start_up import Law


class Modes(NamedTuple):
    """The modes of each trial, k_m ascending, float64[..., mode] but for two."""

    k: Array  # natural frequency without damping, rad/s
    h: Array  # [..., mode, mass], shape; 1 at the first mass
    alpha: Array  # modal mass, damping, stiffness: h^T I h, h^T B h, h^T C h
    beta: Array
    gamma: Array
    g: Array  # h^T I 1, kg m2
    rho: Array  # [..., mode, mass], g_m h_ms/gamma_m, s2: what mode m adds to the
    # static error of mass s at 1 rad/s2, (10)
    zeta: Array  # damping ratio beta_m k_m/(2 gamma_m)


def of_springs(values: Array) -> Array:
    """Return the matrix of springs in a row, [..., mass, mass], C of c or B of b.

    They are before each mass; the first is fixed to the programmed shaft.
    """
    n = values.shape[-1]
    matrix = np.zeros((*values.shape, n))
    masses, inner = np.arange(n), np.arange(n - 1)
    matrix[..., masses, masses] = values
    matrix[..., inner, inner] += values[..., 1:]
    matrix[..., inner, inner + 1] = matrix[..., inner + 1, inner] = -values[..., 1:]
    return matrix


def natural_frequencies(J: Array, c: Array) -> Array:
    """Return k_m, [..., mode], of J, c, [..., mass], undamped, ascending, rad/s.

    Each trial is solved alone: its bits are the same in any block.
    """
    descending = np.linalg.svd(_root(J, c), compute_uv=False)
    return np.asarray(descending[..., ::-1], np.float64)


def _root(J: Array, c: Array) -> Array:
    """Return R, R R^T = I^-1/2 C I^-1/2: its singular values are the k_m.

    It has two diagonals: sqrt(c_s/J_s), and -sqrt(c_s/J_(s-1)) above. Nothing is
    squared, so slow modes beside fast ones keep their digits.
    """
    n = J.shape[-1]
    masses, inner = np.arange(n), np.arange(n - 1)
    root = np.zeros((*J.shape, n))
    root[..., masses, masses] = np.sqrt(c / J)
    root[..., inner, inner + 1] = -np.sqrt(c[..., 1:] / J[..., :-1])
    return root


def modes_of(J: Array, c: Array, b: Array) -> Modes:
    """Return the modes of chains, of float64[..., mass] J, c, b each, SI."""
    vectors, descending, _ = np.linalg.svd(_root(J, c))
    k = descending[..., ::-1]
    h = np.swapaxes(vectors, -1, -2)[..., ::-1, :] / np.sqrt(J)[..., None, :]
    h = h / h[..., :1]  # never zero: a still first mass would hold all of them
    alpha = (h * h * J[..., None, :]).sum(axis=-1)
    gamma = k * k * alpha
    beta = np.einsum("...ms,...sr,...mr->...m", h, of_springs(b), h)
    g = (h * J[..., None, :]).sum(axis=-1)
    rho = (g / gamma)[..., None] * h
    return Modes(k, h, alpha, beta, gamma, g, rho, beta * k / (2.0 * gamma))


def left_by_start_up(modes: Modes, law: Law, omega0: float, t0: Array) -> Array:
    """Return the residual amplitude of each mode of one undamped chain, rad.

    float64[time, mode, mass], started to omega0, rad/s, in times t0[time], s:
    |rho_s^(m)| k_m times |integral of phi0'' e^(-j k_m t)| = |omega0| lambda, for the
    constant acceleration 2 eps0 |rho_s^(m)| |sin(k_m t0/2)|. The sum over the modes is
    an upper bound of their total.
    """
    periods = np.multiply.outer(t0, modes.k) / (2.0 * np.pi)
    share = abs(omega0) * law.spectrum(periods) * modes.k
    return share[:, :, None] * np.abs(modes.rho)


def left_by(modes: Modes, pieces: Array) -> Array:
    """Return the amplitude of each mode when a programmed motion ends, damped, (18).

    float64[mode, mass], rad, of one chain: |rho_s^(m)| k/sqrt(1 - zeta^2) times
    |integral of phi0'' e^(zeta k (t - t_e)) e^(-j k_d t)| to its end t_e; NaN for a
    mode that does not swing. `pieces` of the motion, float64[piece, 7], hold begin and
    end, s; phi0'' at the begin, rad/s2; its three derivatives; and its turn, rad/s.
    """
    x, weight = np.polynomial.legendre.leggauss(16)
    root = np.sqrt(np.where(modes.zeta < 1.0, 1.0 - modes.zeta**2, np.nan))
    pole = modes.k * (modes.zeta - 1j * root)
    t_e, total = pieces[:, 1].max(), 0.0 * pole
    for begin, end, *f, turn in pieces:
        panels = 1 + int(max(modes.k.max(), turn) * (end - begin) / 2.0)
        edge = np.linspace(begin, end, panels + 1)
        half = 0.5 * (edge[1] - edge[0])
        t = (edge[:-1, None] + half * (1.0 + x)).ravel()
        piece = np.array([0.0, np.inf, begin, *f, turn])
        eps = acceleration(t, 0.0 * t, piece) * half * np.tile(weight, panels)
        total = total + np.exp(np.multiply.outer(pole, t - t_e)) @ eps
    share: Array = np.abs(total) * modes.k / root
    return share[:, None] * np.abs(modes.rho)
