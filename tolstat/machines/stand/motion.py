"""Equations of motion of the stand, once: in NumPy, with the paper's letters.

Called on arrays [lanes] they run in NumPy, compiled they run in registers.

Three departures from the print: the rods' elongations are exact distances (the
printed (4), (5) project on the undeformed rod, which does not conserve energy); the
couple and the yaw in (7) carry a modulus, without which friction would drive a
carriage that yaws to the left; run-out and tooth position enter the meshes.
"""

from collections import namedtuple
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.stand.parameters import Parameters
from tolstat.moving import Moment

two_over_pi = 2.0 / np.pi


# angles of wheels 7 and 8, rad, position of the carriage, m, its yaw, rad; their rates
State = namedtuple("State", "phi31 phi32 x alpha phi31_ phi32_ x_ alpha_")
# rates of the energies, W
Powers = namedtuple("Powers", "drive slide guide roll spin damping contact")
# named as the responses that are their peaks: elastic forces, N (tension of a rod is
# positive), moments, N m (that of the drive with dissipation), and the yaw, rad
Loads = namedtuple(
    "Loads",
    "rod_force_1 rod_force_2 shaft_9_moment shaft_12_moment "
    "mesh_force_0 mesh_force_1 mesh_force_2 drive_moment yaw",
)

# The scale of each state's error. The yaw is the sharpest: the gate
# of the guides opens within 1e-8 rad, and friction holds the carriage on that edge.
# Friction turns within some microseconds where the carriage does: a loose error of its
# speed would take that in one step.
SCALE = State(
    phi31=1e-3, phi32=1e-3, x=3e-3, alpha=5e-8,
    phi31_=0.1, phi32_=0.1, x_=1e-4, alpha_=0.15,
)  # fmt: skip


class Joints(NamedTuple):
    """How the joints of both rods touch, see `clearance`."""

    touch1: Array | float  # 1 where the rod carries, 0 in its play
    touch2: Array | float
    gap1: Array | float  # m, play that is taken up, with the sign of the elongation
    gap2: Array | float


CLOSED = Joints(1.0, 1.0, 0.0, 0.0)  # without play

# elongations of the rods, their rates, and 1/cos phi4i, without the equalizing link
Rods = namedtuple("Rods", "d1 d2 d1_ d2_ per_cos41 per_cos42")
# m: crank pins, from the axis of the wheels, and hinges of the carriage
Places = namedtuple("Places", "pin1_x pin1_y pin2_x pin2_y hinge1_x hinge2_x")


class Motion(NamedTuple):
    """All results of the equations at a moment."""

    derivative: State
    powers: Powers
    loads: Loads
    jam: tuple[Array]  # rad, yaw in excess of the guides' clearance
    turns: tuple[Array]  # changes its sign where a law turns within microseconds
    relaxation: tuple[Array]  # 1/s, at which friction and guides hold the yaw rate
    rods: Rods
    stored: Array  # J, kinetic and elastic energy without the guide contact
    places: Places


def motion(moment: Moment, y: State, p: Parameters, joints: Joints = CLOSED) -> Motion:
    """Evaluate the equations of motion (1) to (9)."""
    phi31, phi32, x, alpha, phi31_, phi32_, x_, alpha_ = y

    # drive law (1): the turn of gear 13
    s = np.minimum(moment.t * p.per_t1, 1.0)
    phi1 = p.phi1_0 + p.omega0 * (
        p.t1 * s * s * s * (2.0 - 2.0 * s + 0.6 * s * s)
        + np.maximum(moment.t - p.t1, 0.0)
    )
    phi1_ = p.omega0 * s * s * (6.0 - 8.0 * s + 3.0 * s * s)

    # run-out and tooth position: wheel 7 or 8 seems turned by g_i/r3. Sums of angles
    # are written out: E7 sin(phi31 + th7) = E7c sin phi31 + E7s cos phi31
    sin31, cos31 = np.sin(phi31), np.cos(phi31)
    sin32, cos32 = np.sin(phi32), np.cos(phi32)
    sin21, cos21 = np.sin(p.i3 * phi31), np.cos(p.i3 * phi31)
    sin22, cos22 = np.sin(p.i3 * phi32), np.cos(p.i3 * phi32)
    g1 = p.s1 + p.E7c * sin31 + p.E7s * cos31 + p.E10c * sin21 + p.E10s * cos21
    g2 = p.s2 + p.E8c * sin32 + p.E8s * cos32 + p.E11c * sin22 + p.E11s * cos22
    a1 = phi31 + g1 * p.per_r3
    a2 = phi32 + g2 * p.per_r3
    # da_i/dphi3i
    dg1 = p.E7c * cos31 - p.E7s * sin31 + p.i3 * (p.E10c * cos21 - p.E10s * sin21)
    dg2 = p.E8c * cos32 - p.E8s * sin32 + p.i3 * (p.E11c * cos22 - p.E11s * sin22)
    da1, da2 = 1.0 + dg1 * p.per_r3, 1.0 + dg2 * p.per_r3
    a1_, a2_ = da1 * phi31_, da2 * phi32_

    # second loop: deformations B q, their rates B q', forces B^T (K B q + H B q')
    e0 = p.B00 * phi1 + p.B01 * a1 + p.B02 * a2
    e1 = p.B10 * phi1 + p.B11 * a1 + p.B12 * a2
    e2 = p.B20 * phi1 + p.B21 * a1 + p.B22 * a2
    e3 = p.B30 * phi1 + p.B31 * a1 + p.B32 * a2
    e0_ = p.B00 * phi1_ + p.B01 * a1_ + p.B02 * a2_
    e1_ = p.B10 * phi1_ + p.B11 * a1_ + p.B12 * a2_
    e2_ = p.B20 * phi1_ + p.B21 * a1_ + p.B22 * a2_
    e3_ = p.B30 * phi1_ + p.B31 * a1_ + p.B32 * a2_
    mesh0, mesh1, mesh2, shaft12 = p.k30 * e0, p.k31 * e1, p.k32 * e2, p.c2 * e3
    f0, f1, f2 = mesh0 + p.Hk3 * e0_, mesh1 + p.Hk3 * e1_, mesh2 + p.Hk3 * e2_
    f3 = shaft12 + p.Hc2 * e3_
    M_drive = p.B00 * f0 + p.B10 * f1 + p.B20 * f2 + p.B30 * f3
    M_mesh1 = (p.B01 * f0 + p.B11 * f1 + p.B21 * f2 + p.B31 * f3) * da1
    M_mesh2 = (p.B02 * f0 + p.B12 * f1 + p.B22 * f2 + p.B32 * f3) * da2

    # shaft 9
    turn, turn_ = phi32 - phi31, phi32_ - phi31_
    M_shaft9 = p.c3 * turn + p.Hc3 * turn_

    # rods: from crank pin to hinge, exact distance instead of (4), (5);
    # the cranks stand at f_i = phi3i + psi_i, the hinges at x + a_1 sin alpha and
    # x - a_2 sin alpha, so at equal arms dl_s/2 of a middle that is off x
    sin_f1 = sin31 * p.cos_psi1 + cos31 * p.sin_psi1
    cos_f1 = cos31 * p.cos_psi1 - sin31 * p.sin_psi1
    sin_f2 = sin32 * p.cos_psi2 + cos32 * p.sin_psi2
    cos_f2 = cos32 * p.cos_psi2 - sin32 * p.sin_psi2
    sin_alpha, cos_alpha = np.sin(alpha), np.cos(alpha)
    middle, arm = x + p.off * sin_alpha, 0.5 * p.dl_s * sin_alpha
    X1 = middle + arm + p.r_1 * cos_f1
    X2 = middle - arm + p.r_2 * cos_f2
    Y1 = p.h_1 - p.r_1 * sin_f1
    Y2 = p.h_2 - p.r_2 * sin_f2
    L1, L2 = np.sqrt(X1 * X1 + Y1 * Y1), np.sqrt(X2 * X2 + Y2 * Y2)
    cos41, sin41 = X1 / L1, Y1 / L1
    cos42, sin42 = X2 / L2, Y2 / L2
    p1 = p.r_1 * (sin_f1 * cos41 + cos_f1 * sin41)
    p2 = p.r_2 * (sin_f2 * cos42 + cos_f2 * sin42)
    d1, d2 = L1 - p.l1, L2 - p.l2
    places = Places(
        -p.r_1 * cos_f1, p.r_1 * sin_f1, -p.r_2 * cos_f2, p.r_2 * sin_f2,
        middle + arm, middle - arm,
    )  # fmt: skip
    middle_, arm_ = x_ + p.off * cos_alpha * alpha_, 0.5 * p.dl_s * cos_alpha * alpha_
    d1_ = (middle_ + arm_) * cos41 - p1 * phi31_
    d2_ = (middle_ - arm_) * cos42 - p2 * phi32_
    rods = Rods(d1, d2, d1_, d2_, 1.0 / cos41, 1.0 / cos42)
    # play: a rod is stretched by what exceeds it
    d1, d2 = d1 - joints.gap1, d2 - joints.gap2
    # equalizing link (12) to (14): it moves the hinges by u and -u
    yielding = p.link / (p.k1 * cos41 + p.k2 * cos42)
    u = (p.k2 * d2 - p.k1 * d1) * yielding
    u_ = (p.k2 * d2_ - p.k1 * d1_) * yielding
    d1, d2 = d1 + u * cos41, d2 - u * cos42
    d1_, d2_ = d1_ + u_ * cos41, d2_ - u_ * cos42
    rod1, rod2 = joints.touch1 * p.k1 * d1, joints.touch2 * p.k2 * d2
    damped1, damped2 = joints.touch1 * p.H1 * d1_, joints.touch2 * p.H2 * d2_
    Q1, Q2 = rod1 + damped1, rod2 + damped2

    # rolling force (3)
    forward = two_over_pi * np.arctan(p.beta2 * x_)
    rolling = 1.0 + two_over_pi * np.arctan(p.beta1 * (x - p.x_roll))
    F_roll = 0.25 * p.F0 * rolling * (1.0 + forward)

    # guides (6): gate is 1 in contact, 0 free
    jam = np.abs(alpha) - p.delta
    gate = 0.5 * (1.0 + two_over_pi * np.arctan(p.beta4 * jam))
    beyond = alpha - p.delta * (two_over_pi * np.arctan(p.beta3 * alpha))
    free = 1.0 - p.link
    M_guide = free * (p.c_s * beyond + p.H_s * alpha_) * gate

    # friction (7), (9)
    pressure = p.m * p.g + Q1 * sin41 + Q2 * sin42
    # twice a_2 Q2 cos phi42 - a_1 Q1 cos phi41, over dl_s
    push = -Q1 * cos41 - Q2 * cos42
    couple = Q2 * cos42 - Q1 * cos41 + p.skew * push
    leverage = p.dl_s * cos_alpha / (p.dh * cos_alpha - p.dl_s * np.abs(sin_alpha))
    F_fr1 = p.mu * pressure * forward
    F_fr2 = free * p.mu * np.abs(couple) * leverage * gate * forward
    M_spin = free * p.mu_rot * pressure * (two_over_pi * np.arctan(p.beta5 * alpha_))

    # friction and rolling turn with the carriage, rolling begins, guides touch: steps
    # end there. A step over one of these may err 70 times as much as it estimates
    turns = x_ * (x - p.x_roll) * jam

    # (2)
    phi31__ = p.per_I1 * (M_shaft9 - M_mesh1 + Q1 * p1)
    phi32__ = p.per_I2 * (-M_shaft9 - M_mesh2 + Q2 * p2)
    x__ = p.per_m * (push - F_fr1 - F_fr2 - F_roll)
    M_couple = free * couple * (0.5 * p.dl_s) * cos_alpha
    alpha__ = (M_couple - M_guide - M_spin) * p.per_I_s
    # -d alpha__/d alpha_ of the stiff terms, (6) and (9)
    slip = p.beta5 * alpha_
    sticking = p.mu_rot * pressure * (two_over_pi * p.beta5) / (1.0 + slip * slip)
    relaxation = free * (sticking + p.H_s * gate) * p.per_I_s

    lost = (
        damped1 * d1_ + damped2 * d2_ + p.Hc3 * turn_ * turn_
        + p.Hk3 * (e0_ * e0_ + e1_ * e1_ + e2_ * e2_) + p.Hc2 * e3_ * e3_
    )  # fmt: skip
    stored = 0.5 * (
        phi31_ * phi31_ / p.per_I1 + phi32_ * phi32_ / p.per_I2
        + p.m * x_ * x_ + p.I_s * alpha_ * alpha_
        + rod1 * d1 + rod2 * d2 + p.c3 * turn * turn
        + mesh0 * e0 + mesh1 * e1 + mesh2 * e2 + shaft12 * e3
    )  # fmt: skip
    return Motion(
        derivative=State(
            phi31=phi31_, phi32=phi32_, x=x_, alpha=alpha_,
            phi31_=phi31__, phi32_=phi32__, x_=x__, alpha_=alpha__,
        ),
        powers=Powers(
            drive=M_drive * phi1_, slide=F_fr1 * x_, guide=F_fr2 * x_,
            roll=F_roll * x_, spin=M_spin * alpha_, damping=lost,
            contact=M_guide * alpha_,
        ),
        loads=Loads(
            rod_force_1=rod1, rod_force_2=rod2,
            shaft_9_moment=p.c3 * turn, shaft_12_moment=shaft12,
            mesh_force_0=mesh0, mesh_force_1=mesh1, mesh_force_2=mesh2,
            drive_moment=M_drive, yaw=alpha,
        ),
        jam=(jam,),
        turns=(turns,),
        relaxation=(relaxation,),
        rods=rods,
        stored=stored,
        places=places,
    )  # fmt: skip
