"""Drives with their natural frequencies, mode shapes and modal contributions.

LAPACK takes the matrices one by one: a drive's answer is the same in any block.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.machines.rolling_block import structure
from tolstat.machines.rolling_block.declarations import CONTRIBUTORS, Settings
from tolstat.machines.rolling_block.structure import MASSES, STANDS
from tolstat.model.view import Axis, Chart, Curve, Level, Listing, Picture, bands_of

AT_REST = 1e-12  # of a shape: the rounding error of a mass at rest
TIE = 1e-6  # parts of a shape that differ by less are equal
# A stand that swings less than this share of the shape's largest part stands still.
# With 0.2 the paper's gap at 62.8 Hz is lost; with 0.01 small deviations change the
# pattern.
STILL = 0.1
FAR = 1 / 3  # assumed: a mass may go whose partial frequency is so far above a mode's


class Modes(NamedTuple):
    """The eight elastic modes of each drive, ascending, without the rigid one."""

    omega: Array  # [trial, mode], rad/s
    phi: Array  # [trial, mass, mode], phi^T M phi = 1
    phi_ij: Array  # [trial, link, mode], twists of the links


def modes_of(Q: Array, C: Array) -> Modes:
    """Return the modes of each drive by its mass-scaled stiffness.

    Of Q[trial, mass], kg m2, and C[trial, link], N m/rad; signs of the shapes are as
    LAPACK finds them.
    """
    root = np.sqrt(Q)
    scaled = structure.stiffness_matrix(C) / root[:, :, None] / root[:, None, :]
    squares, vectors = np.linalg.eigh(scaled)
    phi = vectors[:, :, 1:] / root[:, :, None]  # the first is the rigid mode
    return Modes(np.sqrt(squares[:, 1:]), phi, structure.twists(phi))


def unit_shapes(phi: Array) -> Array:
    """Return shapes phi[..., mass, mode], scaled as in Table 1.

    Of length 1, the largest part positive; of equally large ones the last.
    """
    unit = phi / np.sqrt(np.sum(phi * phi, axis=-2, keepdims=True))
    size = np.abs(unit)
    tied = size >= (1.0 - TIE) * np.max(size, axis=-2, keepdims=True)
    last = phi.shape[-2] - 1 - np.argmax(tied[..., ::-1, :], axis=-2)
    largest = np.take_along_axis(unit, last[..., None, :], axis=-2)
    signed: Array = unit * np.sign(largest)
    return np.where(size < AT_REST, 0.0, signed)


def mac(phi: Array, reference: Array) -> Array:
    """Return the modal assurance criterion of shapes, [..., mass, mode].

    float64[..., mode, reference mode]: 1 where shapes are alike but for scale and sign,
    0 where they are orthogonal or zero.
    """
    product = np.einsum("...ir,...is->...rs", phi, reference)
    lengths = np.einsum("...ir,...is->...rs", phi * phi, np.ones_like(reference))
    squares = np.einsum("...is,...is->...s", reference, reference)[..., None, :]
    both = lengths * squares
    return np.asarray(product * product / np.where(both > 0, both, 1.0))


def tracked(phi: Array, reference: Array) -> tuple[NDArray[np.intp], Array]:
    """Return which mode of each drive is which of a reference, where modes veer.

    Frequencies are always reported ascending; statistics of shapes need the modes that
    are alike. Shapes phi[trial, mass, mode] are paired with reference[mass, mode] so
    that the sum of their MAC is the greatest. The order, int64[trial, mode], is the
    mode that is the reference's first, second, ...; the shapes in it have length 1 and
    the reference's signs.
    """
    from scipy.optimize import linear_sum_assignment

    likeness = mac(phi, reference)
    order = np.stack([linear_sum_assignment(-table.T)[1] for table in likeness])
    shapes = np.take_along_axis(unit_shapes(phi), order[:, None, :], axis=2)
    signs = np.sign(np.einsum("tir,ir->tr", shapes, reference))
    return order, shapes * signs[:, None, :]


def antiphase(phi: Array) -> Truths:
    """Return the gaps whose stands swing in antiphase: there tension swings.

    bool[trial, mode, gap] of phi[trial, mass, mode]; gaps 31-32, 32-33, 33-34. The
    paper, Table 1 and the text before it: at 22.7 and 62.8 Hz stands 32-33, at 25.2 Hz
    33-34, at 31.8 Hz 31-32, at the others none.
    """
    size = np.abs(phi)
    moving = size > STILL * np.max(size, axis=1, keepdims=True)
    gaps = [
        (phi[:, i] * phi[:, j] < 0) & moving[:, i] & moving[:, j]
        for i, j in pairwise(STANDS.values())
    ]
    return np.stack(gaps, axis=-1)


def contributions(modes: Modes, C: Array, loads: dict[int, float]) -> Array:
    """Return the static modal contributions a_r to the moments of all links.

    N m, float64[trial, link, mode]. Loads are N m by place: 1 is the motor's M1, which
    drives; 31 to 34, which brake.
    """
    omega, phi, phi_ij = modes
    # phi^T L, mass by mass: the sum is the same in any block
    L = structure.load_vector(loads)
    work = np.cumsum(phi * L[:, None], axis=1)[:, -1]
    return C[:, :, None] * phi_ij * (work / (omega * omega))[:, None, :]


def step(time: Array, omega: Array, zeta: Array) -> Array:
    """Return the response of a mode to a unit step of its load at time 0, from rest.

    s(t) = 1 - exp(-zeta omega t) (cos omega_d t + zeta omega/omega_d sin omega_d t),
    with omega_d = omega sqrt(1 - zeta^2); written by its two roots, so that damping may
    be critical or more. float64[trial, mode, time] of time[time], s, before 0 nothing
    moves; omega[trial, mode], rad/s; damping ratio zeta[trial].
    """
    z = zeta[:, None, None]
    w = omega[:, :, None]
    t = np.maximum(time, 0.0)
    j_omega_d = w * np.sqrt(z * z - 1.0 + 0j)
    slow = j_omega_d - z * w  # of two roots that are real
    # (exp(slow t) - exp(fast t))/(slow - fast), which is t exp(slow t) where they meet
    distance = np.where(j_omega_d == 0.0, 1.0, 2.0 * j_omega_d)
    parted = np.where(j_omega_d == 0.0, t, -np.expm1(-2.0 * j_omega_d * t) / distance)
    return np.asarray((1.0 - np.exp(slow * t) * (1.0 - slow * parted)).real)


def moments(
    time: Array, omega: Array, zeta: Array, steps: list[tuple[float, Array]]
) -> Array:
    """Return the elastic moments of all links after steps of the loads, from rest.

    M_ij = C_ij (phi_i - phi_j), N m, float64[trial, link, time], of time[time], s;
    omega[trial, mode], rad/s; damping ratio zeta[trial]. Each step: when, s; and the
    static modal contributions of what steps then, N m, float64[trial, link, mode].
    """
    total = np.zeros((*steps[0][1].shape[:2], len(time)))
    for begin, a in steps:
        total += a @ step(time - begin, omega, zeta)
    return total


class Drive(NamedTuple):
    """Numbers of each drive, reduced to the motor shaft."""

    Q: Array  # [trial, mass], kg m2
    C: Array  # [trial, link], N m/rad
    zeta: Array  # [trial], damping ratio of every elastic mode
    modes: Modes


def exist(deviations: Array) -> Truths:
    """Return which drives can be built."""
    factors = 1.0 + deviations
    return np.asarray(np.all(factors[:, :-1] > 0, axis=1) & (factors[:, -1] >= 0))


def drives(deviations: Array, settings: Settings) -> Drive:
    """Return drives from relative deviations: Q1 ... Q9, C12 ... C59, damping ratio."""
    inertias, stiffnesses = structure.reduction(settings.combination, settings.gearbox)
    factors, n = 1.0 + deviations, len(MASSES)
    Q = np.array(settings.inertias) * settings.scale * inertias * factors[:, :n]
    C = np.array(settings.stiffnesses) * settings.scale * stiffnesses * factors[:, n:-1]
    return Drive(Q, C, settings.damping_ratio * factors[:, -1], modes_of(Q, C))


def nominal(settings: Settings) -> Drive:
    """Return the one drive without deviations."""
    return drives(np.zeros((1, len(CONTRIBUTORS))), settings)


def shapes(deviations: Array, settings: Settings) -> Chart:
    """Return the shapes over the mass number, as points: the drive branches."""
    omega, phi, _ = drives(deviations, settings).modes
    first, others = unit_shapes(phi[0]), phi[1:]
    if len(others):
        _, others = tracked(others, first)
    pictures = []
    for r, hz in enumerate(omega[0] / (2 * np.pi)):
        name, words = f"mode {r + 1}", f"{hz:.3f} Hz"
        curve = Curve(name, "1", f"phi{r + 1}", words, first[:, r], points=True)
        opened = bands_of(name, "1", others[:, :, r])
        zero = (Level(0.0, ""),)
        pictures.append(Picture(f"{hz:.2f} Hz", curve, *opened, levels=zero))
    number = np.arange(1.0, len(first) + 1)
    return Chart.of(Axis("mass", "1", "1"), number, *pictures)


def without(goes: Truths, drive: Drive) -> Array:
    """Return the elastic frequencies, Hz, of the first drive without some inertias."""
    K, root = structure.stiffness_matrix(drive.C)[0], np.sqrt(drive.Q[0, ~goes])
    coupled = K[np.ix_(goes, ~goes)]
    taken = coupled.T @ np.linalg.solve(K[np.ix_(goes, goes)], coupled)
    K = K[np.ix_(~goes, ~goes)] - taken
    squares: Array = np.linalg.eigvalsh(K / root / root[:, None])[1:]
    return np.sqrt(squares) / (2 * np.pi)


def masses(deviations: Array, settings: Settings) -> Listing:
    """Return each mass, whether it may go, and the error of each mode without them.

    A mass may go where the highest frequency wanted is far below its partial frequency
    sqrt(K_ii/Q_i)/(2 pi), which it has with all others held. The paper, "Model of the
    block": condition number and partial frequencies.
    """
    drive = drives(deviations[:1], settings)
    frequency = drive.modes.omega[0] / (2 * np.pi)
    n, K = settings.kept_modes, np.diag(structure.stiffness_matrix(drive.C)[0])
    partial = np.sqrt(K / drive.Q[0]) / (2 * np.pi)
    ratio = frequency[n - 1] / partial
    goes = ratio < FAR
    error = np.full(len(MASSES), np.nan)
    lowest = without(goes, drive) / frequency[: np.sum(~goes) - 1]
    error[:n] = lowest[:n].round(12) - 1.0
    return Listing.of(
        f"a mass; it may go where modes 1 to {n} are wanted. In row r: error of mode r "
        "without the masses that go",
        ("mass", "1", "", np.array(MASSES)),
        ("Q", "kg m^2", "kg m^2", drive.Q[0]),
        ("partial frequency", "Hz", "Hz", partial),
        (f"f{n} over it", "1", "1", ratio),
        ("may go", "1", "", np.where(goes, "yes", "no")),
        ("error of mode", "1", "%", error),
    )
