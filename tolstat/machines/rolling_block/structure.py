"""The structure of the drive, by the paper's numbers: masses, links, gearbox.

The paper prints the ranges of the gearbox's ratios and the number of its combinations,
no tooth numbers and no stage ratios. Assumed here: stage A has two positions a, stages
B, C and D have four each, b, c, d; ratios grow geometrically. That is the smallest
gearbox with both printed ranges and the number 128.

Fig. 3 and the equations (1) are the paper's. "Modal analysis": motor to roll 0.1572 to
1.2173 (stands 31, 32) and 0.0778 to 0.5330 (stands 33, 34).
"""

from collections.abc import Mapping
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array

MASSES = (
    "motor", "stage A", "stage B", "stage C", "stage D",
    "rolls 31", "rolls 32", "rolls 33", "rolls 34",
)  # fmt: skip
# which masses each link joins, numbered from 0; motor side first
LINKS = ((0, 1), (1, 2), (2, 3), (2, 4), (3, 5), (3, 6), (4, 7), (4, 8))
LINK_NAMES = tuple(f"{i + 1}{j + 1}" for i, j in LINKS)
MOTOR = 0
STANDS = {31: 5, 32: 6, 33: 7, 34: 8}  # mass of each stand
MESHES = ("23", "34", "35")  # links that are gears
GAPS = tuple(f"{a}-{b}" for a, b in pairwise(STANDS))  # between stands
LOADS = {1: MOTOR, **STANDS}  # where a moment acts: the motor's M1, and the stands


# M_ij,static of one newton metre in all, a quarter on each stand
STATIC_SHARES = (1.0, 1.0, 0.5, 0.5, 0.25, 0.25, 0.25, 0.25)


def stiffness_matrix(C: Array) -> Array:
    """Assemble K[..., mass, mass], N m/rad, of equations (1) from C[..., link].

    K phi is what the links take from each mass.
    """
    K = np.zeros((*C.shape[:-1], len(MASSES), len(MASSES)))
    for link, (i, j) in enumerate(LINKS):
        K[..., i, i] += C[..., link]
        K[..., j, j] += C[..., link]
        K[..., i, j] -= C[..., link]
        K[..., j, i] -= C[..., link]
    return K


def twists(phi: Array) -> Array:
    """Return phi_ij = phi_i - phi_j, [..., link, mode], of phi[..., mass, mode]."""
    motor_side, roll_side = ([link[end] for link in LINKS] for end in (0, 1))
    return phi[..., motor_side, :] - phi[..., roll_side, :]


def load_vector(loads: Mapping[int, float]) -> Array:
    """Return the moments on the masses under loads, N m, by place.

    1 is the motor's M1, which drives; 31 to 34 are stands, which brake.
    """
    moments = np.zeros(len(MASSES))
    for load, size in loads.items():
        moments[LOADS[load]] = size if LOADS[load] == MOTOR else -size
    return moments


Combination = tuple[int, int, int, int]


class Ratios(NamedTuple):
    """Motor speed over the speed of shafts; those of A and AB but for a factor."""

    A: float
    AB: float
    i31: float  # and stand 32
    i34: float  # and stand 33


class Gearbox(NamedTuple):
    """Ranges of ratios and positions of the stages A, B, C, D; the paper's by default.

    Ratios of all combinations of A, B and C are a geometric series, each position of
    stage A a range of B, each of B a range of C; D spreads what is left for the exit.
    """

    entry: tuple[float, float] = (0.1572, 1.2173)  # motor over roll speed, 31 and 32
    exit: tuple[float, float] = (0.0778, 0.5330)  # stands 33 and 34
    positions: Combination = (2, 4, 4, 4)
    reference: Combination = (0, 3, 1, 1)  # at which inertias and stiffnesses hold

    @property
    def combinations(self) -> tuple[Combination, ...]:
        """All positions (a, b, c, d)."""
        return tuple(product(*map(range, self.positions)))  # type: ignore[arg-type]


PAPER = Gearbox()
TABLE_1 = PAPER.reference


def ratios(combination: Combination, gearbox: Gearbox = PAPER) -> Ratios:
    """Return the ratios of a combination (a, b, c, d)."""
    (a, b, c, d), (nA, nB, nC, nD) = combination, gearbox.positions
    (first, last), (first_34, last_34) = gearbox.entry, gearbox.exit
    q = (last / first) ** (1 / max(nA * nB * nC - 1, 1))
    p = (last_34 / first_34 / q ** (nC * (nA * nB - 1))) ** (1 / max(nD - 1, 1))
    AB = nC * (nB * a + b)
    i31, i34 = first * q ** (AB + c), first_34 * q**AB * p**d
    return Ratios(q ** (nC * nB * a), q**AB, i31, i34)


def reduction(
    combination: Combination, gearbox: Gearbox = PAPER
) -> tuple[Array, Array]:
    """Reduce to the motor shaft: factors on what holds at the reference combination.

    Q_red = Q/i^2, C_red = C/i^2, so a ratio that differs from the reference's gives a
    factor (i_reference/i)^2: of Q1 ... Q9, float64[mass], and of C12 ... C59,
    float64[link].
    """
    pairs = zip(
        ratios(combination, gearbox), ratios(gearbox.reference, gearbox), strict=True
    )
    A, AB, i31, i34 = ((reference / i) ** 2 for i, reference in pairs)
    return (
        np.array([1.0, A, AB, i31, i34, i31, i31, i34, i34]),
        np.array([1.0, A, AB, AB, i31, i31, i34, i34]),
    )
