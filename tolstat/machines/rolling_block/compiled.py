"""The drive's equations in registers."""

import numpy as np

from tolstat.machines.rolling_block import motion as equations
from tolstat.machines.rolling_block.motion import Links, Machine, State
from tolstat.moving import (
    Moment,
    System,
    compiled,
    named,
    rates_signature,
    rows,
    write,
)

motion = compiled(within=True)(equations.motion)

N_LINKS = len(Links._fields)
DAMPING = len(Machine._fields)  # the parameters behind: the damping matrix, by rows


@compiled(within=True)
def viscous_moment(link, y, p):
    """Return the damping moment in one link: its row times all rates."""
    first = DAMPING + N_LINKS * link
    total = p[first] * y[N_LINKS]
    for other in range(1, N_LINKS):
        total = total + p[first + other] * y[N_LINKS + other]
    return total


@compiled(within=True)
def moved(moment, y, p):
    """Evaluate the equations with their damping."""
    states, numbers = rows(y), rows(p)
    viscous = Links(
        viscous_moment(0, states, numbers), viscous_moment(1, states, numbers),
        viscous_moment(2, states, numbers), viscous_moment(3, states, numbers),
        viscous_moment(4, states, numbers), viscous_moment(5, states, numbers),
        viscous_moment(6, states, numbers), viscous_moment(7, states, numbers),
    )  # fmt: skip
    return motion(named(Moment, moment), named(State, y), named(Machine, p), viscous)


@compiled(rates_signature)
def rates(moment, y, p, out):
    """Fill derivatives and the elastic moments."""
    at = moved(moment, y, p)
    write(out, 0, (at.derivative, at.elastic))


@compiled(rates_signature)
def watch(moment, y, p, out):
    """Fill the elastic moments alone; the compiler drops the rest of the equations."""
    write(out, 0, moved(moment, y, p).elastic)


# each block gives the scale of the errors of its states
SYSTEM = System(rates, np.ones(len(State._fields)), watch, n_extremes=N_LINKS)
