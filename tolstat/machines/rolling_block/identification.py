"""Inertias and stiffnesses from a table of natural frequencies and mode shapes.

A drive is fitted to the table, each number weighted by what its last digit tells; a
number that no drive has together with the others, such as a misprint, is left out.

All inertias and stiffnesses times any factor have the same table: their scale is given.

References
----------
P. V. Krot (2010), Table 1, for which this was made.
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from tolstat.errors import ModelError
from tolstat.machines.rolling_block.contradictions import (
    Contradiction,
    agreeing,
    noticed,
)
from tolstat.machines.rolling_block.table import N_LINKS, N_MASSES, Array, Table

LEAST, MOST = 1e-9, 1e9  # of any number, in its unit: beyond, squares leave the doubles
TABLE_1_INERTIA = 680.0  # kg m2, makes the drive of Table 1 one of round numbers


@dataclass(frozen=True)
class IdentifiedDrive:
    """A drive found from its modes.

    Attributes
    ----------
    inertias, stiffnesses : float64[9], float64[8]
        Q1 ... Q9, kg m2; C12, C23, C34, C35, C46, C47, C58, C59, N m/rad.
    inertia_sigmas, stiffness_sigmas : float64[9], float64[8]
        Standard deviations by rounding of the table, the sum of inertias being exact.
    frequencies : float64[mode]
        Of this drive, Hz, in the order of the table.
    mode_shapes : float64[mass, mode]
        Likewise, of the scale and the signs of the table.
    contradictions : tuple of Contradiction
        Numbers that were left out; the rest fits. Each says whether it is certain.
    noticed : float64[1 + mass, mode]
        Least error of each number of the table that would have been noticed; row 0
        holds the frequencies, Hz. A smaller one moves the drive unseen; infinite where
        no other number checks this one; NaN where it was left out or not known.
    """

    inertias: Array
    stiffnesses: Array
    inertia_sigmas: Array
    stiffness_sigmas: Array
    frequencies: Array
    mode_shapes: Array
    contradictions: tuple[Contradiction, ...]
    noticed: Array


def identify_drive(
    frequencies: ArrayLike,
    mode_shapes: ArrayLike,
    *,
    total_inertia: float = TABLE_1_INERTIA,
    frequency_resolution: float = 0.1,
    shape_resolution: float = 0.001,
) -> IdentifiedDrive:
    """Find the drive that has these natural frequencies and mode shapes.

    Parameters
    ----------
    frequencies : float[mode]
        Natural frequencies of elastic modes, Hz; two modes or more.
    mode_shapes : float[9, mode]
        A column for each mode, of any length and sign; NaN where nothing is known.
    total_inertia : float
        Sum of all inertias, kg m2, which the table does not tell.
    frequency_resolution, shape_resolution : float
        Last digit of the table, Hz and parts of a shape.

    Returns
    -------
    IdentifiedDrive
        With the uncertainty that rounding leaves, and the numbers that contradict the
        others.

    Raises
    ------
    ModelError
        If the table has another form, does not determine the drive (it says which
        unknowns), or belongs to no drive of this structure.

    Examples
    --------
    >>> found = tolstat.identify_drive(frequencies, mode_shapes)
    >>> settings = {"inertias": found.inertias, "stiffnesses": found.stiffnesses}
    >>> tolstat.evaluate("rolling_block", None, settings)
    """
    table = _read(
        frequencies, mode_shapes, frequency_resolution, shape_resolution, total_inertia
    )
    fit, contradictions = agreeing(table)
    unknowns = np.exp(fit.logs[0])
    unknowns *= total_inertia / np.sum(unknowns[:N_MASSES])
    sigmas = unknowns * fit.spread(fit.counts)[0]
    return IdentifiedDrive(
        unknowns[:N_MASSES],
        unknowns[N_MASSES:],
        sigmas[:N_MASSES],
        sigmas[N_MASSES:],
        fit.numbers[0, 0],
        fit.numbers[0, 1:],
        contradictions,
        noticed(table, fit),
    )


def _real(name: str, given: ArrayLike) -> Array:
    """Return plain numbers, and refuse what would be turned into such in silence."""
    try:
        array = np.asarray(given)
    except ValueError:
        array = np.array("of different lengths")
    if array.dtype.kind not in "fiu":
        raise ModelError(
            f"{name}: real numbers are expected, in rows of equal length; of a complex "
            "shape its real part, turned so that the largest is real"
        )
    return array.astype(float)


def _read(
    frequencies: ArrayLike,
    mode_shapes: ArrayLike,
    frequency_resolution: float,
    shape_resolution: float,
    total_inertia: float,
) -> Table:
    hz, shapes = _real("frequencies", frequencies), _real("mode_shapes", mode_shapes)
    if hz.ndim != 1 or not 2 <= len(hz) <= N_LINKS:
        raise ModelError(
            f"frequencies: 2 to {N_LINKS} are expected, a number for each mode"
        )
    if shapes.shape != (N_MASSES, len(hz)):
        raise ModelError(
            f"mode_shapes: {N_MASSES} rows of {len(hz)} numbers are expected, one for "
            f"each mass; these are {' x '.join(map(str, shapes.shape)) or 'one'}"
        )
    if not ((hz > LEAST) & (hz < MOST)).all():
        raise ModelError(
            f"frequencies: numbers from {LEAST:g} to {MOST:g} Hz are expected"
        )
    largest = np.nan_to_num(np.abs(shapes)).max(axis=0)
    if not ((largest > LEAST) & (largest < MOST)).all():
        raise ModelError(
            "mode_shapes: the largest number of each mode is expected from "
            f"{LEAST:g} to {MOST:g}; any scale will do"
        )
    for name, value in (
        ("total_inertia", total_inertia),
        ("frequency_resolution", frequency_resolution),
        ("shape_resolution", shape_resolution),
    ):
        if not isinstance(value, Real) or not LEAST <= value <= MOST:
            raise ModelError(
                f"{name} = {value!r}: a number from {LEAST:g} to {MOST:g} is expected"
            )
    half = np.full((1 + N_MASSES, len(hz)), shape_resolution / 2)
    half[0] = frequency_resolution / 2
    return Table(np.vstack([hz, shapes]), half)
