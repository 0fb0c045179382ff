"""Equations of motion of the drive, once: in NumPy, with the paper's letters.

Integrated are the twists phi_ij of the eight links, equations (2): the angles of the
masses grow without end and would drown them.

In the first line of (2) the left side is
phi''_12 (printed: phi''_2). The paper prints no damping; here it is modal, and adds a
moment to each link that follows the rates of all twists.
"""

from collections import namedtuple
from typing import NamedTuple

import numpy as np

from tolstat.moving import Moment

# twists of the links, rad, and their rates, rad/s
State = namedtuple(
    "State",
    "phi12 phi23 phi34 phi35 phi46 phi47 phi58 phi59 "
    "phi12_ phi23_ phi34_ phi35_ phi46_ phi47_ phi58_ phi59_",
)
# numbers of one drive and its loads, SI: reciprocals of the inertias, for a division
# costs as much as ten multiplications; stiffnesses; loads of the stands, each from one
# phase until before another; 1 where the motor's moment steps with them, else 0
Machine = namedtuple(
    "Machine",
    "per_Q1 per_Q2 per_Q3 per_Q4 per_Q5 per_Q6 per_Q7 per_Q8 per_Q9 "
    "C12 C23 C34 C35 C46 C47 C58 C59 "
    "M6 M7 M8 M9 on6 on7 on8 on9 off6 off7 off8 off9 matched",
)
# a moment in each link, N m
Links = namedtuple("Links", "M12 M23 M34 M35 M46 M47 M58 M59")


class Motion(NamedTuple):
    """All results of the equations at a moment."""

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
        M12=p.C12 * y.phi12, M23=p.C23 * y.phi23, M34=p.C34 * y.phi34,
        M35=p.C35 * y.phi35, M46=p.C46 * y.phi46, M47=p.C47 * y.phi47,
        M58=p.C58 * y.phi58, M59=p.C59 * y.phi59,
    )  # fmt: skip
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
        phi12=y.phi12_, phi23=y.phi23_, phi34=y.phi34_, phi35=y.phi35_,
        phi46=y.phi46_, phi47=y.phi47_, phi58=y.phi58_, phi59=y.phi59_,
        phi12_=phi1__ - phi2__, phi23_=phi2__ - phi3__, phi34_=phi3__ - phi4__,
        phi35_=phi3__ - phi5__, phi46_=phi4__ - phi6__, phi47_=phi4__ - phi7__,
        phi58_=phi5__ - phi8__, phi59_=phi5__ - phi9__,
    )  # fmt: skip
    return Motion(derivative, elastic)
