"""Equations of motion of the drive, once: in NumPy, with the paper's letters.

Integrated are the twists phi_ij of the eight links, equations (2): the angles of the
masses grow without end and would drown them.

References
----------
P. V. Krot (2010), equations (1) and (2). In the first line of (2) the left side is
phi''_12 (printed: phi''_2). The paper prints no damping; here it is modal, and adds a
moment to each link that follows the rates of all twists.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array


class Moment(NamedTuple):
    """When: the time and the phase of the trial."""

    t: Array  # s
    phase: Array


class State(NamedTuple):
    """Twists of the links and their rates."""

    phi12: Array  # rad
    phi23: Array
    phi34: Array
    phi35: Array
    phi46: Array
    phi47: Array
    phi58: Array
    phi59: Array
    phi12_: Array  # rad/s
    phi23_: Array
    phi34_: Array
    phi35_: Array
    phi46_: Array
    phi47_: Array
    phi58_: Array
    phi59_: Array


class Machine(NamedTuple):
    """Numbers of one drive and its loads, SI."""

    # reciprocals of the inertias: a division costs as much as ten multiplications
    per_Q1: Array
    per_Q2: Array
    per_Q3: Array
    per_Q4: Array
    per_Q5: Array
    per_Q6: Array
    per_Q7: Array
    per_Q8: Array
    per_Q9: Array
    C12: Array
    C23: Array
    C34: Array
    C35: Array
    C46: Array
    C47: Array
    C58: Array
    C59: Array
    # loads of the stands, each from one phase until before another
    M6: Array
    M7: Array
    M8: Array
    M9: Array
    on6: Array
    on7: Array
    on8: Array
    on9: Array
    off6: Array
    off7: Array
    off8: Array
    off9: Array
    matched: Array  # 1 where the motor's moment steps with the loads, 0 where it stays


class Links(NamedTuple):
    """A moment in each link, N m."""

    M12: Array
    M23: Array
    M34: Array
    M35: Array
    M46: Array
    M47: Array
    M58: Array
    M59: Array


class Motion(NamedTuple):
    """Everything the equations say about a moment."""

    derivative: State
    elastic: Links  # M_ij = C_ij phi_ij


def motion(moment: Moment, y: State, p: Machine, viscous: Links) -> Motion:
    """Evaluate the equations of motion (2)."""
    k = moment.phase
    M6 = np.where((k >= p.on6) & (k < p.off6), p.M6, 0.0)
    M7 = np.where((k >= p.on7) & (k < p.off7), p.M7, 0.0)
    M8 = np.where((k >= p.on8) & (k < p.off8), p.M8, 0.0)
    M9 = np.where((k >= p.on9) & (k < p.off9), p.M9, 0.0)
    M1 = p.matched * (M6 + M7 + M8 + M9)

    elastic = Links(
        M12=p.C12 * y.phi12,
        M23=p.C23 * y.phi23,
        M34=p.C34 * y.phi34,
        M35=p.C35 * y.phi35,
        M46=p.C46 * y.phi46,
        M47=p.C47 * y.phi47,
        M58=p.C58 * y.phi58,
        M59=p.C59 * y.phi59,
    )
    M12 = elastic.M12 + viscous.M12
    M23 = elastic.M23 + viscous.M23
    M34 = elastic.M34 + viscous.M34
    M35 = elastic.M35 + viscous.M35
    M46 = elastic.M46 + viscous.M46
    M47 = elastic.M47 + viscous.M47
    M58 = elastic.M58 + viscous.M58
    M59 = elastic.M59 + viscous.M59

    # (1)
    phi1__ = p.per_Q1 * (M1 - M12)
    phi2__ = p.per_Q2 * (M12 - M23)
    phi3__ = p.per_Q3 * (M23 - M34 - M35)
    phi4__ = p.per_Q4 * (M34 - M46 - M47)
    phi5__ = p.per_Q5 * (M35 - M58 - M59)
    phi6__ = p.per_Q6 * (M46 - M6)
    phi7__ = p.per_Q7 * (M47 - M7)
    phi8__ = p.per_Q8 * (M58 - M8)
    phi9__ = p.per_Q9 * (M59 - M9)

    # (2)
    derivative = State(
        phi12=y.phi12_,
        phi23=y.phi23_,
        phi34=y.phi34_,
        phi35=y.phi35_,
        phi46=y.phi46_,
        phi47=y.phi47_,
        phi58=y.phi58_,
        phi59=y.phi59_,
        phi12_=phi1__ - phi2__,
        phi23_=phi2__ - phi3__,
        phi34_=phi3__ - phi4__,
        phi35_=phi3__ - phi5__,
        phi46_=phi4__ - phi6__,
        phi47_=phi4__ - phi7__,
        phi58_=phi5__ - phi8__,
        phi59_=phi5__ - phi9__,
    )
    return Motion(derivative, elastic)
