"""Frequency functions of the drive: each input to each output, under any damping.

With elastic twists gamma = B phi - e, where e is the error of a gear mesh in its link,
and gamma = Theta q by the twists of the modes, the paper's equations (1) are

    (s^2 + Theta^T K(s) Theta) q = Phi^T L - s^2 Theta^-1 e,    s = i omega,

with the loads L on the masses. Damping is modal, as in the rest of the model, or by
link, K = C (1 + s tau + i eta): times tau_ij of viscous, factors eta_ij of constant
loss. The rigid mode adds to angles alone.

The paper, "Dynamic analysis": frequency functions at any place, by tension, rolling
force, defects of gears and unbalance. It prints no damping.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.rolling_block import structure
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.parameters import Drive
from tolstat.machines.rolling_block.resonance import rolling_speeds

Complex = NDArray[np.complex128]
_MASSES, _LINKS = np.eye(len(structure.MASSES)), np.eye(len(structure.LINKS))


class Input(NamedTuple):
    """What excites the drive, per unit."""

    unit: str
    moments: Array  # on the masses, float64[mass], N m
    errors: Array  # of the meshes, in the links, float64[link], rad


class Output(NamedTuple):
    """What answers: a sum of angles, of their rates, or of elastic moments."""

    unit: str
    angles: Array  # weights, float64[mass]
    moments: Array  # weights, float64[link]
    rates: bool = False


def stretch(gap: str, settings: Settings) -> Array:
    """Return how the strip in a gap stretches per angle of the masses, m.

    rho_b phi_b - rho_a phi_a with rho_s = d_s/(2 i_s), float64[mass]. A tension of 1 N
    loads the stands by the opposite: it drives a and brakes b.
    """
    rho = dict(zip(structure.STANDS, rolling_speeds(settings), strict=True))
    a, b = map(int, gap.split("-"))
    weights: Array = rho[b] * _MASSES[structure.STANDS[b]]
    weights -= rho[a] * _MASSES[structure.STANDS[a]]
    return weights


def loads(*places: int) -> Input:
    """Return a moment of 1 N m on each place; the motor drives, the rolls brake.

    An unbalanced or eccentric roll is a moment on it that turns with it.
    """
    moments = structure.load_vector(dict.fromkeys(places, 1.0))
    return Input("N m", moments, 0.0 * _LINKS[0])


def input_of(name: str, settings: Settings) -> Input:
    """Return an input by its name: `mesh 23`, `tension 31-32`."""
    kind, _, where = name.partition(" ")
    if kind == "mesh":
        error = _LINKS[structure.LINK_NAMES.index(where)]
        return Input("rad", 0.0 * _MASSES[0], error)
    return Input("N", -stretch(where, settings), 0.0 * _LINKS[0])


def output_of(name: str, settings: Settings) -> Output:
    """Return an output by its name: `12`, a link; `31-32`; `angle 6`, `speed 6`."""
    none = 0.0 * _LINKS[0]
    if name in structure.LINK_NAMES:
        moment = _LINKS[structure.LINK_NAMES.index(name)]
        return Output("N m", 0.0 * _MASSES[0], moment)
    if name in structure.GAPS:
        return Output("m", stretch(name, settings), none)
    kind, _, mass = name.partition(" ")
    rates = kind == "speed"
    return Output("rad/s" if rates else "rad", _MASSES[int(mass) - 1], none, rates)


def transfer(
    frequency: Array, drive: Drive, settings: Settings, source: Input, *seen: Output
) -> Complex:
    """Return outputs per unit of an input, complex128[trial, output, frequency].

    Over the frequency, Hz; an angle of a drive that is not held is infinite at 0 Hz.
    """
    s = 2j * np.pi * frequency
    omega, phi, theta = drive.modes
    # Theta^-1 = diag(1/omega^2) Theta^T C
    still = np.einsum("tlr,tl->tr", theta, drive.C * source.errors) / omega**2
    force = source.moments @ phi
    driven = force[:, :, None] - still[:, :, None] * s**2
    tau, eta = settings.dampings
    if tau is None or eta is None:
        w, zeta = omega[:, :, None], drive.zeta[:, None, None]
        q = driven / (s**2 + 2.0 * zeta * w * s + w * w)
    else:
        lost = s[:, None] * tau + 1j * eta  # [frequency, link]
        q = np.empty(driven.shape, complex)
        for trial, (twist, stiff) in enumerate(zip(theta, drive.C, strict=True)):
            Z = twist.T @ (((1.0 + lost) * stiff)[:, :, None] * twist)
            Z += s[:, None, None] ** 2 * np.eye(len(stiff))
            q[trial] = np.linalg.solve(Z, driven[trial].T[:, :, None])[:, :, 0].T
    outputs = np.empty((len(q), len(seen), len(s)), complex)
    for i, output in enumerate(seen):
        by_angle = output.angles @ phi  # [trial, mode]
        twisted = by_angle + np.einsum("tl,tlr->tr", output.moments * drive.C, theta)
        moved = np.sum(twisted[:, :, None] * q, axis=1)
        moved += np.sum(by_angle * still, axis=1)[:, None]
        rigid = output.angles.sum() * source.moments.sum() / drive.Q.sum(axis=1)
        if rigid.any():
            moved += rigid[:, None] / s**2
        outputs[:, i] = moved * s if output.rates else moved
    return outputs


def poles_of(drive: Drive, settings: Settings) -> tuple[Array, Array]:
    """Return frequency |lambda|/(2 pi), Hz, and damping ratio of each mode, ascending.

    float64[trial, mode]. Times tau_ij of the links count, not factors of loss: these
    have no free vibration. A mode that does not swing has a ratio of 1, and the slower
    of its two roots.
    """
    omega, _, theta = drive.modes
    tau, _ = settings.dampings
    if tau is None:
        return omega / (2 * np.pi), np.broadcast_to(drive.zeta[:, None], omega.shape)
    n = omega.shape[1]
    A = np.zeros((len(omega), 2 * n, 2 * n))
    A[:, :n, n:] = np.eye(n)
    A[:, n:, :n] = -np.eye(n) * (omega * omega)[:, None, :]
    A[:, n:, n:] = -theta.transpose(0, 2, 1) @ ((drive.C * tau)[:, :, None] * theta)
    roots = np.linalg.eigvals(A).astype(complex)
    roots = np.take_along_axis(roots, np.argsort(np.abs(roots), axis=1), axis=1)
    real = roots.imag == 0.0
    slower = np.cumsum(real, axis=1) <= real.sum(axis=1, keepdims=True) / 2
    pole = roots[(roots.imag > 0.0) | (real & slower)].reshape(len(roots), n)
    return np.abs(pole) / (2 * np.pi), -pole.real / np.abs(pole)
