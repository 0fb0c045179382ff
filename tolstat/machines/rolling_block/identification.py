"""Inertias and stiffnesses from a table of natural frequencies and mode shapes.

With frequencies and shapes known, (K - omega^2 M) phi = 0 is linear in the unknown
inertias and stiffnesses: a homogeneous least-squares problem, whose answer is the
smallest singular vector. From there the drive is fitted to the table itself, each
number weighted by what rounding leaves open. A number that no drive can have together
with the others, such as a misprint, is found by leaving out each in its turn.

All inertias and stiffnesses times any factor have the same table: their scale is given.

References
----------
P. V. Krot (2010), Table 1, for which this was made.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.errors import ModelError
from tolstat.machines.rolling_block.fitting import (
    CONTRADICTS,
    N_LINKS,
    N_MASSES,
    Fit,
    Flags,
    Table,
    fitted,
    linear,
    undetermined,
)

Array = NDArray[np.float64]

TABLE_1_INERTIA = 680.0  # kg m2, makes the drive of Table 1 one of round numbers
MOST_CONTRADICTING = 0.05  # of all numbers; where more do, the drive is another one
TRIED = 3  # numbers left out that are fitted without, the most promising ones


class Contradiction(NamedTuple):
    """A number of the table that the others contradict.

    Attributes
    ----------
    mode : int
        From 1.
    mass : int
        From 1; 0 is the frequency of the mode.
    given, expected : float
        What stands in the table, and what the others ask for.
    """

    mode: int
    mass: int
    given: float
    expected: float

    def __str__(self) -> str:
        """Say it in words."""
        what = f"mass {self.mass}" if self.mass else "frequency"
        return (
            f"mode {self.mode}, {what}: {self.given:g} is given, "
            f"the rest of the table asks for {self.expected:.4g}"
        )


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
        Numbers that were left out; the rest fits.
    """

    inertias: Array
    stiffnesses: Array
    inertia_sigmas: Array
    stiffness_sigmas: Array
    frequencies: Array
    mode_shapes: Array
    contradictions: tuple[Contradiction, ...]


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
        If the table has another form, does not determine the drive, or belongs to no
        drive of this structure.

    Examples
    --------
    >>> found = tolstat.identify_drive(frequencies, mode_shapes)
    >>> settings = {"inertias": found.inertias, "stiffnesses": found.stiffnesses}
    >>> tolstat.evaluate("rolling_block", None, settings)
    """
    table = _read(
        frequencies, mode_shapes, frequency_resolution, shape_resolution, total_inertia
    )
    known = np.isfinite(table.numbers)
    most = int(MOST_CONTRADICTING * known.sum())
    counts = known.copy()
    fit = fitted(table, counts)
    while _worst(fit, counts) > CONTRADICTS:
        if (known & ~counts).sum() >= most:
            raise ModelError(
                f"no drive of this structure has this table: more than {most} of its "
                f"{known.sum()} numbers contradict the others; if they are measured, "
                "give frequency_resolution and shape_resolution that say how well"
            )
        counts, fit = _without_one(table, counts, fit)
    # what was left out and fits all the same counts again
    back = known & ~counts & (np.abs(fit.off) <= CONTRADICTS)
    if back.any():
        counts |= back
        fit = fitted(table, counts, fit.logs)
    return _identified(table, counts, known, fit, total_inertia)


def _read(
    frequencies: ArrayLike,
    mode_shapes: ArrayLike,
    frequency_resolution: float,
    shape_resolution: float,
    total_inertia: float,
) -> Table:
    hz = np.atleast_1d(np.asarray(frequencies, dtype=float))
    shapes = np.asarray(mode_shapes, dtype=float)
    if hz.ndim != 1 or not 2 <= len(hz) <= N_LINKS:
        raise ModelError(
            f"frequencies: 2 to {N_LINKS} are expected, a number for each mode"
        )
    if shapes.shape != (N_MASSES, len(hz)):
        raise ModelError(
            f"mode_shapes: {N_MASSES} rows of {len(hz)} numbers are expected, one for "
            f"each mass; these are {' x '.join(map(str, shapes.shape)) or 'one'}"
        )
    if not (np.isfinite(hz).all() and (hz > 0).all()):
        raise ModelError("frequencies: numbers above 0 Hz are expected")
    if np.isinf(shapes).any() or not (np.nan_to_num(shapes) != 0).any(axis=0).all():
        raise ModelError("mode_shapes: finite numbers are expected, not all of them 0")
    for name, value in (
        ("total_inertia", total_inertia),
        ("frequency_resolution", frequency_resolution),
        ("shape_resolution", shape_resolution),
    ):
        if not 0 < value < np.inf:
            raise ModelError(f"{name} = {value:g}: a number above 0 is expected")
    half = np.full((1 + N_MASSES, len(hz)), shape_resolution / 2)
    half[0] = frequency_resolution / 2
    return Table(np.vstack([hz, shapes]), half)


def _worst(fit: Fit, counts: Flags) -> float:
    return float(np.max(np.abs(fit.off[counts])))


def _without_one(table: Table, counts: Flags, fit: Fit) -> tuple[Flags, Fit]:
    """Leave out the number without which the others agree best."""
    tried = []
    for row, mode in np.argwhere(counts):
        fewer = counts.copy()
        fewer[row, mode] = False
        tried.append((linear(table, fewer).misfit, row, mode))
    fits = []
    for _, row, mode in sorted(tried)[:TRIED]:
        fewer = counts.copy()
        fewer[row, mode] = False
        fits.append((fewer, fitted(table, fewer, fit.logs)))
    return min(fits, key=lambda each: each[1].cost)


def _identified(
    table: Table, counts: Flags, known: Flags, fit: Fit, total_inertia: float
) -> IdentifiedDrive:
    """Scale the drive, and say how sure it is."""
    unknowns = np.exp(fit.logs)
    unknowns *= total_inertia / np.sum(unknowns[:N_MASSES])
    inertias, stiffnesses = unknowns[:N_MASSES], unknowns[N_MASSES:]
    slopes = fit.slopes[counts]
    _, singular, vectors = np.linalg.svd(slopes, full_matrices=False)
    if singular[-2] < 1e-9 * singular[0]:  # the last is the scale
        raise undetermined()
    # rounding: alike likely within the half digit, variance 1/3 of its square
    spread = (vectors[:-1].T / singular[:-1]) / np.sqrt(3.0)
    # the sum of the inertias stays
    share = np.concatenate([inertias / total_inertia, np.zeros(N_LINKS)])
    spread = spread - share @ spread
    sigmas = unknowns * np.sqrt(np.sum(spread * spread, axis=1))
    contradictions = tuple(
        Contradiction(
            int(mode) + 1,
            int(row),
            float(table.numbers[row, mode]),
            float(fit.numbers[row, mode]),
        )
        for row, mode in np.argwhere(known & ~counts)
    )
    return IdentifiedDrive(
        inertias,
        stiffnesses,
        sigmas[:N_MASSES],
        sigmas[N_MASSES:],
        fit.numbers[0],
        fit.numbers[1:],
        contradictions,
    )
