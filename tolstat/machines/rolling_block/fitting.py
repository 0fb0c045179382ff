"""A drive fitted to a table of its modes, or to some numbers of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import ModelError
from tolstat.machines.rolling_block.modes import mac, modes_of
from tolstat.machines.rolling_block.topology import LINK_NAMES, LINKS, MASSES

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

N_MASSES, N_LINKS = len(MASSES), len(LINKS)
# A number contradicts the others where it is farther from them than so many halves of
# its last digit: rounding alone makes one, "0.001" for nothing makes two.
CONTRADICTS = 3.0
LEAST = 1e-3  # of the greatest of its kind: where a start is not positive
MOST_EVALUATIONS = 60  # a table that a drive has takes about ten
FAR = 5.0  # from the start, logarithms: beyond, nothing is sought
STEP = 1e-6  # of the logarithms, for slopes


class Table(NamedTuple):
    """What is given, with its resolution; row 0 holds the frequencies."""

    numbers: Array  # [1 + mass, mode], Hz and shapes
    half: Array  # [1 + mass, mode], half of the last digit

    @property
    def frequencies(self) -> Array:
        """Hz, by mode."""
        hz: Array = self.numbers[0]
        return hz

    @property
    def shapes(self) -> Array:
        """By mass and mode."""
        phi: Array = self.numbers[1:]
        return phi


class Fit(NamedTuple):
    """A drive that fits some numbers of a table."""

    logs: Array  # logarithms of Q1 ... Q9, C12 ... C59
    numbers: Array  # of the table, as this drive has them
    off: Array  # numbers less those given, in halves of the last digit
    slopes: Array  # [1 + mass, mode, unknown], of `off`
    cost: float  # sum of squares over what counts


class Linear(NamedTuple):
    """The answer of the linear problem."""

    misfit: (
        float  # root of the mean square; infinite where some unknown is not positive
    )
    logs: Array  # logarithms of the unknowns, of their size where not positive


def linear(table: Table, counts: Flags) -> Linear:
    """Solve (K - omega^2 M) phi = 0 for the unknowns, by what counts of the table.

    Parameters
    ----------
    table, counts : Table, bool[1 + mass, mode]
        What is given, and what counts of it.

    Raises
    ------
    ModelError
        If too little counts.
    """
    phi = np.where(counts[1:], table.shapes, 0.0)
    square = (2 * np.pi * table.frequencies) ** 2
    equations = np.zeros((len(square), N_MASSES, N_MASSES + N_LINKS))
    holds = counts[1:].T & counts[0][:, None]  # [mode, mass]: all that enters is known
    for mass in range(N_MASSES):
        equations[:, mass, mass] = -square * phi[mass]
    for link, (i, j) in enumerate(LINKS):
        twist = phi[i] - phi[j]
        equations[:, i, N_MASSES + link] = twist
        equations[:, j, N_MASSES + link] = -twist
        holds[:, i] &= counts[1 + j]
        holds[:, j] &= counts[1 + i]
    # all modes alike, each by its own size
    equations /= (square * np.sqrt(np.sum(phi * phi, axis=0)))[:, None, None]
    chosen = equations[holds]
    size = np.sqrt(np.sum(chosen * chosen, axis=0))
    if len(chosen) < chosen.shape[1] - 1 or not size.all():
        raise undetermined()
    _, singular, vectors = np.linalg.svd(chosen / size)
    unknowns = vectors[-1] / size
    unknowns = unknowns * np.sign(np.sum(vectors[-1]))
    least = singular[-1] if len(singular) == len(size) else 0.0
    misfit = least / np.sqrt(len(chosen)) if (unknowns > 0).all() else np.inf
    kinds = np.split(np.abs(unknowns), [N_MASSES])
    sizes = [np.maximum(kind, LEAST * np.max(kind)) for kind in kinds]
    return Linear(float(misfit), np.log(np.concatenate(sizes)))


def fitted(table: Table, counts: Flags, last: Array | None = None) -> Fit:
    """Fit the drive to what counts of the table.

    It begins where the linear problem says, or with the last drive if there some
    inertia or stiffness is not positive.

    Parameters
    ----------
    table, counts : Table, bool[1 + mass, mode]
        What is given, and what counts of it.
    last : float64[unknown], optional
        Logarithms of the unknowns of the last drive.
    """
    from scipy.optimize import least_squares

    begin = linear(table, counts)
    start = begin.logs if last is None or np.isfinite(begin.misfit) else last

    # the scale is free: one more residual keeps it where it begins
    scale = np.ones((1, len(start))) / len(start)

    def off(logs: Array) -> Array:
        found = _compared(table, counts, logs[None])[1][0][counts]
        return np.concatenate([found, scale @ (logs - start)])

    def slopes(logs: Array) -> Array:
        return np.concatenate([_slopes(table, counts, logs)[counts], scale])

    result = least_squares(
        off,
        start,
        slopes,
        bounds=(start - FAR, start + FAR),
        loss="soft_l1",  # gross errors pull less than their square
        f_scale=CONTRADICTS,
        x_scale="jac",
        max_nfev=MOST_EVALUATIONS,
    )
    logs: Array = result.x
    numbers, every = _compared(table, counts, logs[None])
    return Fit(logs, numbers[0], every[0], _slopes(table, counts, logs), result.cost)


def _slopes(table: Table, counts: Flags, logs: Array) -> Array:
    around = STEP * np.eye(len(logs))
    both = np.concatenate([logs + around, logs - around])
    off = _compared(table, counts, both)[1]
    difference: Array = (off[: len(logs)] - off[len(logs) :]) / (2 * STEP)
    return np.moveaxis(difference, 0, -1)


def _compared(table: Table, counts: Flags, logs: Array) -> tuple[Array, Array]:
    """Compare the tables of some drives with the one given.

    Parameters
    ----------
    table, counts : Table, bool[1 + mass, mode]
        What is given, and what counts of it.
    logs : float64[drive, unknown]
        The drives.

    Returns
    -------
    numbers : float64[drive, 1 + mass, mode]
        Their modes that are most like those given, in scale and sign as these.
    off : float64[drive, 1 + mass, mode]
        Less what is given, in halves of the last digit; NaN where nothing is.
    """
    unknowns = np.exp(logs - np.mean(logs[:, :N_MASSES], axis=1, keepdims=True))
    modes = modes_of(unknowns[:, :N_MASSES], unknowns[:, N_MASSES:])
    given = np.where(counts[1:], table.shapes, np.nan)
    alike = np.argmax(mac(modes.phi, given), axis=1)  # [drive, mode given]
    hz = np.take_along_axis(modes.omega, alike, axis=1) / (2 * np.pi)
    phi = np.take_along_axis(modes.phi, alike[:, None, :], axis=2)
    seen = np.where(counts[1:], phi, np.nan)
    size = np.nansum(seen * given, axis=1) / np.nansum(seen * seen, axis=1)
    numbers = np.concatenate([hz[:, None], phi * size[:, None]], axis=1)
    return numbers, (numbers - table.numbers) / table.half


def undetermined() -> ModelError:
    """Return what is raised where a table leaves some unknown open."""
    return ModelError(
        f"the table does not determine the {N_MASSES} inertias and the stiffnesses "
        f"{', '.join(LINK_NAMES)}: give more modes, or more of their shapes"
    )
