"""Stands with play in registers: contacts change at located crossings alone."""

import numpy as np

from tolstat.machines.stand import clearance
from tolstat.machines.stand.clearance import Contacts, Excess, Sides
from tolstat.machines.stand.compiled import motion
from tolstat.machines.stand.declarations import WINDOW
from tolstat.machines.stand.motion import SCALE, Loads, Powers, State
from tolstat.machines.stand.parameters import Parameters
from tolstat.moving import (
    SIDES,
    Moment,
    System,
    compiled,
    named,
    rates_signature,
    write,
)

joints_of = compiled(within=True)(clearance.joints_of)
play_of = compiled(within=True)(clearance.play_of)
excess_of = compiled(within=True)(clearance.excess_of)
met = compiled(within=True)(clearance.met)
N, N_LOADS, N_EXCESS = len(State._fields), len(Loads._fields), len(Excess._fields)


@compiled(rates_signature)
def rates(moment, y, p, out):
    """Fill the rows of `compiled.rates`, the excess beyond play, and what is free."""
    p = named(Parameters, p)
    contacts = named(Contacts, y[N:])
    joints = joints_of(contacts, p)
    m = motion(named(Moment, moment), named(State, y), p, joints)
    still = 0.0 * contacts.s_1
    held = (still, still, still, still, still, still)
    excess = excess_of(play_of(m.rods, p))
    free = (0.5 - joints.touch1, 0.5 - joints.touch2)
    write(out, 0, (
        m.derivative, held, m.powers, m.loads, excess, m.jam, free, m.turns,
        m.relaxation,
    ))  # fmt: skip


@compiled(rates_signature)
def jump(moment, y, p, out):
    """Fill the states with the contacts behind a crossing, and the sides."""
    p = named(Parameters, p)
    contacts = named(Contacts, y[N:])
    state, instant = named(State, y), named(Moment, moment)
    m = motion(instant, state, p, joints_of(contacts, p))
    sides = named(Sides, moment[SIDES:])
    after = met(contacts, sides, play_of(m.rods, p), instant.phase >= WINDOW)
    write(out, 0, (state, after, sides))


SYSTEM = System(
    rates,
    np.array([*SCALE, *(1.0 for _ in Contacts._fields)]),
    n_quadratures=len(Powers._fields),
    n_extremes=N_LOADS + N_EXCESS,
    n_above=4,
    damped=(State._fields.index("alpha_"),),
    crossings=(*(N_LOADS + i for i in range(N_EXCESS)), N_LOADS + N_EXCESS + 3),
    jump=jump,
)
