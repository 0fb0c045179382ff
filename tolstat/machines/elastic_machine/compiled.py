"""The chain's equations in registers, for any number of masses and steps of the load.

Rows of the parameters: what `motion.StartUp` names; 1/J, c, b of each mass; of each
step of the load the phase from which it acts and what it deflects each mass by.
"""

from __future__ import annotations

import numpy as np

from tolstat.machines.elastic_machine import motion, start_up
from tolstat.machines.elastic_machine.motion import HEAD, Chain, StartUp
from tolstat.moving import Moment, compiled, named, rates_signature, rows

static_deflection = compiled(within=True)(motion.static_deflection)
acceleration = compiled(within=True)(motion.acceleration)
derivative = compiled(within=True)(motion.derivative)
loads = compiled(within=True)(motion.loads)
constant = compiled(within=True)(start_up.constant)
polynomial = compiled(within=True)(start_up.polynomial)
trapezoidal = compiled(within=True)(start_up.trapezoidal)
cycloid = compiled(within=True)(start_up.cycloid)


@compiled(within=True)
def shape(law, s):
    """Return f of the start-up law: one for all lanes, so no other is evaluated."""
    if law == 0.0:
        return constant(s)
    if law == 1.0:
        return polynomial(s)
    if law == 2.0:
        return trapezoidal(s)
    if law == 3.0:
        return cycloid(s)
    return np.nan * s  # a law without a number here gives no motion


@compiled(within=True)
def chain_of(p, n):
    """Read the parts of the chain."""
    per_J, c, b = p[HEAD:], p[HEAD + n :], p[HEAD + 2 * n :]
    return Chain(rows(per_J), rows(c), rows(b))


@compiled(rates_signature)
def rates(moment, y, p, out):
    """Fill theta', theta'', then the rows with peaks."""
    n = len(y) // 2
    at, start, chain = named(Moment, moment), named(StartUp, p), chain_of(p, n)
    # kept where `loads` takes it from, row by row
    static = rows(out[3 * n : 4 * n])
    static_deflection(at.phase, rows(p[HEAD + 3 * n :]), static)
    f = shape(p[0, 0], at.t * start.per_t0)
    phi0__ = acceleration(f, at.phase, start)
    derivative(phi0__, rows(y), rows(y[n:]), static, chain, rows(out))
    loads(at.phase >= start.ended, rows(y), static, chain, rows(out[2 * n :]))


@compiled(rates_signature)
def watch(moment, y, p, out):
    """Fill the rows with peaks alone."""
    n = len(y) // 2
    at, start, chain = named(Moment, moment), named(StartUp, p), chain_of(p, n)
    static = rows(out[n : 2 * n])
    static_deflection(at.phase, rows(p[HEAD + 3 * n :]), static)
    loads(at.phase >= start.ended, rows(y), static, chain, rows(out))
