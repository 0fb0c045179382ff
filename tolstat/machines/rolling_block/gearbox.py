"""The gearbox of variable structure: 128 combinations of its clutches.

The paper prints the ranges of the ratios and the number of combinations, no tooth
numbers and no stage ratios. What is assumed here: stage A has two positions a, stages
B, C and D have four each, b, c, d; ratios grow geometrically. That is the least that
meets both printed ranges and the number 128.

References
----------
P. V. Krot (2010), "Modal analysis": motor to roll 0.1572 to 1.2173 (stands 31, 32)
and 0.0778 to 0.5330 (stands 33, 34).
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array

Combination = tuple[int, int, int, int]

ENTRY = (0.1572, 1.2173)  # motor speed over roll speed, stands 31 and 32
EXIT = (0.0778, 0.5330)  # stands 33 and 34
q = (ENTRY[1] / ENTRY[0]) ** (1 / 31)
p = (EXIT[1] / EXIT[0] / q**28) ** (1 / 3)

POSITIONS = (2, 4, 4, 4)
COMBINATIONS: tuple[Combination, ...] = tuple(
    product(*(range(positions) for positions in POSITIONS))  # type: ignore[arg-type]
)
TABLE_1: Combination = (0, 3, 1, 1)  # at which the paper's numbers are taken to hold


class Ratios(NamedTuple):
    """Motor speed over the speed of shafts; those of A and AB but for a factor."""

    A: float
    AB: float
    i31: float  # and stand 32
    i34: float  # and stand 33


def ratios(combination: Combination) -> Ratios:
    """Return the ratios of a combination (a, b, c, d)."""
    a, b, c, d = combination
    return Ratios(
        A=q ** (16 * a),
        AB=q ** (16 * a + 4 * b),
        i31=ENTRY[0] * q ** (16 * a + 4 * b + c),
        i34=EXIT[0] * q ** (16 * a + 4 * b) * p**d,
    )


def reduction(combination: Combination) -> tuple[Array, Array]:
    """Reduce to the motor shaft: factors on what holds at the combination of Table 1.

    Q_red = Q/i^2, C_red = C/i^2, so a ratio that differs from the one of Table 1 gives
    a factor (i_Table1/i)^2.

    Returns
    -------
    inertias : float64[mass]
        Factors of Q1 ... Q9.
    stiffnesses : float64[link]
        Factors of C12 ... C59.
    """
    now, then = ratios(combination), ratios(TABLE_1)
    A, AB, i31, i34 = ((t / n) ** 2 for n, t in zip(now, then, strict=True))
    return (
        np.array([1.0, A, AB, i31, i34, i31, i31, i34, i34]),
        np.array([1.0, A, AB, AB, i31, i31, i34, i34]),
    )


def excitation_orders(combination: Combination) -> dict[str, float]:
    """Return turns per turn of the motor: of the motor, of the rolls."""
    now = ratios(combination)
    return {"motor": 1.0, "rolls_31": 1.0 / now.i31, "rolls_34": 1.0 / now.i34}
