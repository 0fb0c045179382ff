"""The stand's equations in registers."""

from __future__ import annotations

import numpy as np

from tolstat.machines.stand import motion as equations
from tolstat.machines.stand.motion import SCALE, Loads, Moment, Powers, State
from tolstat.machines.stand.parameters import Parameters
from tolstat.moving import System, compiled, named, rates_signature, write

motion = compiled(within=True)(equations.motion)

N_STATES, N_POWERS, N_LOADS = (
    len(State._fields),
    len(Powers._fields),
    len(Loads._fields),
)


@compiled(rates_signature)
def rates(moment, y, p, out):
    """Fill derivatives, powers, loads, and the yaw's relaxation."""
    at = motion(named(Moment, moment), named(State, y), named(Parameters, p))
    write(out, 0, at.derivative)
    write(out, N_STATES, at.powers)
    write(out, N_STATES + N_POWERS, at.loads)
    write(out, N_STATES + N_POWERS + N_LOADS, at.jam)
    write(out, N_STATES + N_POWERS + N_LOADS + 1, at.relaxation)


@compiled(rates_signature)
def watch(moment, y, p, out):
    """Fill the loads alone; the compiler drops the rest of the equations."""
    at = motion(named(Moment, moment), named(State, y), named(Parameters, p))
    write(out, 0, at.loads)
    write(out, N_LOADS, at.jam)


SYSTEM = System(
    rates,
    watch,
    scale=np.array(SCALE),
    n_quadratures=N_POWERS,
    n_extremes=N_LOADS,
    n_above=1,
    damped=(State._fields.index("alpha_"),),
)
