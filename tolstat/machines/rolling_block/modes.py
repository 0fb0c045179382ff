"""Natural frequencies and mode shapes of a whole block of drives at once.

LAPACK takes the matrices one by one: a drive's answer is the same in any block.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.topology import stiffness_matrix, twists

Array = NDArray[np.float64]

AT_REST = 1e-12  # of a shape: what rounding leaves of a mass that does not move
TIE = 1e-6  # parts of a shape that are as large as the largest, but for rounding


class Modes(NamedTuple):
    """The eight elastic modes of each drive, ascending, without the rigid one."""

    omega: Array  # [trial, mode], rad/s
    phi: Array  # [trial, mass, mode], phi^T M phi = 1
    phi_ij: Array  # [trial, link, mode], twists of the links


def modes_of(Q: Array, C: Array) -> Modes:
    """Solve (K - omega^2 M) phi = 0 for each drive, by its mass-scaled stiffness.

    Parameters
    ----------
    Q : float64[trial, mass]
        Moments of inertia, kg m2, positive.
    C : float64[trial, link]
        Stiffnesses, N m/rad, positive.

    Returns
    -------
    Modes
        Signs of the shapes as LAPACK finds them.
    """
    root = np.sqrt(Q)
    scaled = stiffness_matrix(C) / root[:, :, None] / root[:, None, :]
    squares, vectors = np.linalg.eigh(scaled)
    phi = vectors[:, :, 1:] / root[:, :, None]  # the first is the rigid mode
    return Modes(np.sqrt(squares[:, 1:]), phi, twists(phi))


def unit_shapes(phi: Array) -> Array:
    """Scale shapes as Table 1 has them: length 1, the largest part positive.

    Parameters
    ----------
    phi : float64[..., mass, mode]
        Shapes of any scale.

    Returns
    -------
    float64[..., mass, mode]
        Of equally large parts the last one is positive.
    """
    unit = phi / np.sqrt(np.sum(phi * phi, axis=-2, keepdims=True))
    size = np.abs(unit)
    tied = size >= (1.0 - TIE) * np.max(size, axis=-2, keepdims=True)
    last = phi.shape[-2] - 1 - np.argmax(tied[..., ::-1, :], axis=-2)
    largest = np.take_along_axis(unit, last[..., None, :], axis=-2)
    signed: Array = unit * np.sign(largest)
    return np.where(size < AT_REST, 0.0, signed)


def mac(phi: Array, reference: Array) -> Array:
    """Compare shapes by the modal assurance criterion.

    Parameters
    ----------
    phi : float64[..., mass, mode]
        Shapes.
    reference : float64[mass, mode] or float64[..., mass, mode]
        Shapes, too; NaN where nothing is known: the other masses are compared.

    Returns
    -------
    float64[..., mode, reference mode]
        1 where shapes are alike but for scale and sign, 0 where they are orthogonal,
        or where nothing of them but zeros is known.
    """
    known = np.isfinite(reference)
    there = np.where(known, reference, 0.0)
    product = np.einsum("...ir,...is->...rs", phi, there)
    lengths = np.einsum("...ir,...is->...rs", phi * phi, known.astype(float))
    squares = np.einsum("...is,...is->...s", there, there)[..., None, :]
    both = lengths * squares
    criterion: Array = product * product / np.where(both > 0, both, 1.0)
    return criterion


def tracked(phi: Array, reference: Array) -> tuple[NDArray[np.intp], Array]:
    """Say which mode of each drive is which of a reference, where modes veer.

    Frequencies are always reported ascending; statistics of shapes need the modes that
    are alike. They are paired so that the sum of their MAC is the greatest.

    Parameters
    ----------
    phi : float64[trial, mass, mode]
        Shapes.
    reference : float64[mass, mode]
        Those of the drive they are compared with.

    Returns
    -------
    order : int64[trial, mode]
        The mode of each trial that is the reference's first, second, ...
    shapes : float64[trial, mass, mode]
        In that order, of length 1, with the reference's signs.
    """
    from scipy.optimize import linear_sum_assignment

    likeness = mac(phi, reference)
    order = np.stack([linear_sum_assignment(-each.T)[1] for each in likeness])
    shapes = np.take_along_axis(unit_shapes(phi), order[:, None, :], axis=2)
    signs = np.sign(np.einsum("tir,ir->tr", shapes, reference))
    return order, shapes * signs[:, None, :]
