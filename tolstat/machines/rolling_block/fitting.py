"""Drives fitted to a table of modes, many at once, each to its own choice of numbers.

By the method of Levenberg and Marquardt; each number weighs by what its last digit
tells.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.machines.rolling_block.table import (
    N_MASSES,
    N_UNKNOWNS,
    Array,
    Flags,
    Indices,
    Table,
    beside,
)

# logarithms
FURTHEST_STEP = 1.0
FURTHEST = 8.0  # from the start: beyond, nothing is sought
SETTLED = 1e-8
GAINS_NOTHING = 1e-9  # of the cost
MOST_STEPS = 30  # a table that a drive has takes about five
# Damping: a share of the squares of the slopes, more where a step was too long, and
# what holds each unknown where it is if the table does not tell it.
FIRST, MORE, LESS, MOST = 1e-2, 10.0, 0.1, 1e8
HOLD = 1e-3
ROUNDING = 1.0 / 3.0  # variance of what is alike likely within half a last digit
SURE = 1e-4  # least share of an error that is left in a number and told from nothing
TINY = 1e-12


class Fit(NamedTuple):
    """Drives, each fitted to some numbers of a table."""

    counts: Flags  # [drive, 1 + mass, mode]
    logs: Array  # [drive, unknown], logarithms of Q1 ... Q9, C12 ... C59
    numbers: Array  # [drive, 1 + mass, mode], of the table, as these drives have them
    off: Array  # numbers less those given, in halves of the last digit
    slopes: Array  # [drive, 1 + mass, mode, unknown], of `off`
    scales: Array  # [drive, 1 + mass, mode], of `off`, by the scale of a column
    cost: Array  # [drive], sum of squares over what counts

    def of(self, drives: Indices | list[int]) -> Fit:
        """Return some of the drives."""
        counts, *rest = self
        return Fit(counts[drives], *(each[drives] for each in rest))

    def information(self, counts: Flags) -> Array:
        """Return what some numbers tell of the unknowns, with errors of half a digit.

        Parameters
        ----------
        counts : bool[drive or 1, 1 + mass, mode]
            These numbers.

        Returns
        -------
        float64[drive, unknown, unknown]
        """
        slopes = np.where(counts[..., None], self.slopes, 0.0)
        slopes = slopes.reshape(len(slopes), -1, N_UNKNOWNS)
        information: Array = np.matmul(np.swapaxes(slopes, 1, 2), slopes)
        return information

    def spread(self, counts: Flags) -> Array:
        """Return standard deviations of the unknowns, of themselves, by rounding.

        Parameters
        ----------
        counts : bool[drive or 1, 1 + mass, mode]
            What is known and rounded.

        Returns
        -------
        float64[drive, unknown]
            The sum of all inertias being exact; large where the numbers tell nothing.
        """
        inertias = np.exp(self.logs[:, :N_MASSES])
        share = np.zeros_like(self.logs)
        share[:, :N_MASSES] = inertias / np.sum(inertias, axis=1, keepdims=True)
        relative = np.eye(N_UNKNOWNS) - share[:, None, :]  # to the sum
        held = self.information(counts) / ROUNDING + HOLD * np.eye(N_UNKNOWNS)
        covariance = np.matmul(relative, np.linalg.inv(held))
        variance = np.sum(covariance * relative, axis=2)
        spread: Array = np.sqrt(np.maximum(variance, 0.0))
        return spread

    def left(self) -> Array:
        """Return what an error of a number leaves in it; the rest moves the drive.

        Returns
        -------
        float64[drive, 1 + mass, mode]
            A share, for what counts. Above one for what does not: the variance of what
            the others ask for, with that of the number itself, in terms of it.
        """
        held = self.information(self.counts) + HOLD * np.eye(N_UNKNOWNS)
        flat = self.slopes.reshape(len(held), -1, N_UNKNOWNS)
        drawn = np.sum(np.matmul(flat, np.linalg.inv(held)) * flat, axis=2)
        drawn = drawn.reshape(self.off.shape) + self.scales**2
        left: Array = np.where(self.counts, 1.0 - drawn, 1.0 + drawn)
        return left

    def strain(self) -> Array:
        """Return how far each number is from what the others of its drive ask for.

        Returns
        -------
        float64[drive, 1 + mass, mode]
            In halves of the last digit, so weighted that it is as large for all if
            errors are.
        """
        strain: Array = self.off / np.sqrt(np.maximum(self.left(), SURE))
        return strain

    def seen(self) -> Array:
        """Return the strain by an error of half a last digit, [drive, ..., mode]."""
        left = np.maximum(self.left(), TINY)
        seen: Array = left / np.sqrt(np.maximum(left, SURE))
        return seen


def fitted(table: Table, counts: Flags, start: Array, steps: int = MOST_STEPS) -> Fit:
    """Fit drives to what counts of the table.

    Parameters
    ----------
    table, counts : Table, bool[drive, 1 + mass, mode]
        What is given, and what counts of it for each drive.
    start : float64[drive, unknown]
        Logarithms, where to begin, from `linear`.
    steps : int
        At most; it ends earlier where all drives have settled.
    """
    fit = _there(table, counts, start)
    damping = np.full(len(start), FIRST)
    moving = np.arange(len(start))
    for _ in range(steps):
        now = fit.of(moving)
        step = _step(now, damping[moving])
        logs = np.clip(
            now.logs + step, start[moving] - FURTHEST, start[moving] + FURTHEST
        )
        new = _there(table, now.counts, logs)
        gain = now.cost - new.cost
        better = gain > 0
        for into, values in zip(fit, new, strict=True):
            into[moving[better]] = values[better]
        damping[moving] *= np.where(better, LESS, MORE)
        rests = np.max(np.abs(step), axis=1) < SETTLED
        rests |= np.abs(gain) <= GAINS_NOTHING * now.cost
        moving = moving[~rests & (damping[moving] < MOST)]
        if not len(moving):
            break
    return fit


def _step(now: Fit, damping: Array) -> Array:
    normal = now.information(now.counts)
    off = np.where(now.counts, now.off, 0.0)[..., None]
    pull = np.sum(off * now.slopes, axis=(1, 2))
    diagonal = np.einsum("nuu->nu", normal)
    held = damping[:, None] * diagonal + HOLD
    held += 1e-13 * np.max(diagonal, axis=1, keepdims=True)  # rounding of the solver
    normal = normal + held[:, None] * np.eye(N_UNKNOWNS)
    step = -np.linalg.solve(normal, pull[..., None])[..., 0]
    longest = np.max(np.abs(step), axis=1, keepdims=True)
    short: Array = step * (FURTHEST_STEP / np.maximum(longest, FURTHEST_STEP))
    return short


def _there(table: Table, counts: Flags, logs: Array) -> Fit:
    found = beside(table, counts, logs)
    cost = np.sum(np.where(counts, found.off**2, 0.0), axis=(1, 2))
    return Fit(counts.copy(), logs.copy(), *found, cost)
