"""The stand's equations in registers."""

import numpy as np

from tolstat.machines.stand import motion as equations
from tolstat.machines.stand.motion import CLOSED, SCALE, Loads, Powers, State
from tolstat.machines.stand.parameters import Parameters
from tolstat.moving import Moment, System, compiled, named, rates_signature, write

motion = compiled(within=True)(equations.motion)


@compiled(rates_signature)
def rates(moment, y, p, out):
    """Fill derivatives, powers, loads, and the yaw's relaxation."""
    m = motion(named(Moment, moment), named(State, y), named(Parameters, p), CLOSED)
    write(out, 0, (m.derivative, m.powers, m.loads, m.jam, m.turns, m.relaxation))


@compiled(rates_signature)
def watch(moment, y, p, out):
    """Fill the loads alone; the compiler drops the rest of the equations."""
    m = motion(named(Moment, moment), named(State, y), named(Parameters, p), CLOSED)
    write(out, 0, (m.loads, m.jam, m.turns))


SYSTEM = System(
    rates,
    np.array(SCALE),
    watch,
    n_quadratures=len(Powers._fields),
    n_extremes=len(Loads._fields),
    n_above=2,
    damped=(State._fields.index("alpha_"),),
    crossings=(len(Loads._fields) + 1,),
)
