"""Two systems whose rates have kinks: a ball, and rates of one side alone."""

from __future__ import annotations

import numpy as np

from tolstat.integrator.problem import System
from tolstat.integrator.signatures import rates_signature
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows, write


@compiled(rates_signature)
def bouncing(moment, y, p, out):
    """A ball falls on a spring without mass, k = p0, whose top is at p1."""
    Y, P = rows(y), rows(p)
    x = Y[0] - P[1]
    push = np.where(x < 0.0, -P[0] * x, 0.0)
    write(out, 0, (Y[1], push - 1.0, x, x))


@compiled(rates_signature)
def bouncing_watch(moment, y, p, out):
    x = rows(y)[0] - rows(p)[1]
    write(out, 0, (x, x))


@compiled(rates_signature)
def switched(moment, y, p, out):
    """Rates that act on one side alone: while (t - p0)^2 < p1, and after p2."""
    t, P = rows(moment)[0], rows(p)
    u = t - P[0]
    near, late = u * u - P[1], t - P[2]
    visit, ramp = P[3] * np.maximum(-near, 0.0), np.maximum(late, 0.0)
    write(out, 0, (visit, ramp, near, late))


@compiled(rates_signature)
def switched_watch(moment, y, p, out):
    t, P = rows(moment)[0], rows(p)
    u = t - P[0]
    write(out, 0, (u * u - P[1], t - P[2]))


BALL = System(
    bouncing, np.ones(2), bouncing_watch, n_extremes=1, n_above=1, crossings=(1,)
)
SWITCH = System(switched, np.ones(2), switched_watch, n_above=2, crossings=(0, 1))
