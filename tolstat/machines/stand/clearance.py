"""Play in the joints of the rods: when a rod carries, and how it is stretched then.

c_i is the play of both joints of rod i, along the rod; the pins have no mass. While
|d_i| < c_i/2 the rod carries nothing. In contact, s_i = sign d_i, the force is
k_i (d_i - s_i c_i/2) + H_i d_i'. With the equalizing link both rods carry at once: the
sums of their elongations and of their play along the carriage decide.

This law is no part of the paper, which names clearances only as what permits motion.
"""

from collections import namedtuple

import numpy as np

from tolstat.arrays import Truths
from tolstat.machines.stand.motion import Joints, Rods
from tolstat.machines.stand.parameters import Parameters

# s_i: 1 where rod i pulls, -1 where it is pressed, 0 in its play; then how often its
# joints have closed in the window, and the greatest |d_i'| at that, m/s
Contacts = namedtuple("Contacts", "s_1 s_2 contacts_1 contacts_2 approach_1 approach_2")
# elongations that decide the contact, m, their rates, and half the play there
Play = namedtuple("Play", "D1 D2 D1_ D2_ w1 w2")
# by how much each rod is beyond its play, pulled and pressed, m: a contact begins or
# ends where one of them is zero
Excess = namedtuple("Excess", "pulled_1 pressed_1 pulled_2 pressed_2")
# of each crossing, `Motion.turns` last
Sides = namedtuple("Sides", "pulled_1 pressed_1 pulled_2 pressed_2 turns")


def joints_of(contacts: Contacts, p: Parameters) -> Joints:
    """Return which rods carry; those without play always do."""
    c1 = p.half_c1 + p.link * p.half_c2
    c2 = p.half_c2 + p.link * p.half_c1
    return Joints(
        np.where(c1 > 0.0, np.abs(contacts.s_1), 1.0),
        np.where(c2 > 0.0, np.abs(contacts.s_2), 1.0),
        contacts.s_1 * p.half_c1,
        contacts.s_2 * p.half_c2,
    )


def play_of(rods: Rods, p: Parameters) -> Play:
    """Return elongations, rates and half the play: of each rod, or along the link."""
    linked = p.link > 0.0
    D = rods.d1 * rods.per_cos41 + rods.d2 * rods.per_cos42
    D_ = rods.d1_ * rods.per_cos41 + rods.d2_ * rods.per_cos42
    w = p.half_c1 * rods.per_cos41 + p.half_c2 * rods.per_cos42
    return Play(
        np.where(linked, D, rods.d1), np.where(linked, D, rods.d2),
        np.where(linked, D_, rods.d1_), np.where(linked, D_, rods.d2_),
        np.where(linked, w, p.half_c1), np.where(linked, w, p.half_c2),
    )  # fmt: skip


def excess_of(play: Play) -> Excess:
    """Return by how much the rods are beyond their play; without it, a constant."""
    D1, w1 = np.where(play.w1 > 0.0, play.D1, 1.0), play.w1
    D2, w2 = np.where(play.w2 > 0.0, play.D2, 1.0), play.w2
    return Excess(D1 - w1, -D1 - w1, D2 - w2, -D2 - w2)


def met(
    contacts: Contacts, sides: Excess | Sides, play: Play, counts: Truths | bool
) -> Contacts:
    """Return the contacts behind new sides, above 0 beyond the play; count or not."""
    pressed1 = np.where(sides.pressed_1 > 0.0, -1.0, 0.0)
    pressed2 = np.where(sides.pressed_2 > 0.0, -1.0, 0.0)
    s_1 = np.where(sides.pulled_1 > 0.0, 1.0, pressed1)
    s_2 = np.where(sides.pulled_2 > 0.0, 1.0, pressed2)
    closes1 = counts & (s_1 != 0.0) & (s_1 != contacts.s_1) & (play.w1 > 0.0)
    closes2 = counts & (s_2 != 0.0) & (s_2 != contacts.s_2) & (play.w2 > 0.0)
    v1, v2 = contacts.approach_1, contacts.approach_2
    return Contacts(
        s_1, s_2,
        contacts.contacts_1 + np.where(closes1, 1.0, 0.0),
        contacts.contacts_2 + np.where(closes2, 1.0, 0.0),
        np.where(closes1, np.maximum(v1, np.abs(play.D1_)), v1),
        np.where(closes2, np.maximum(v2, np.abs(play.D2_)), v2),
    )  # fmt: skip
