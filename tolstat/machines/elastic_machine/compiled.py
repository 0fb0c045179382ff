"""The chain's equations in registers, for any number of masses and steps of the load.

Rows of the parameters: when the programmed motion is over, and in how many pieces; 1/J,
c, b of each mass; what `motion.Piece` names, of each; of each step of the load the
phase from which it acts and what it deflects each mass by.
"""

from tolstat.machines.elastic_machine import motion
from tolstat.machines.elastic_machine.motion import HEAD, PIECE, Chain
from tolstat.moving import Moment, compiled, named, rates_signature, rows

static_deflection = compiled(within=True)(motion.static_deflection)
acceleration = compiled(within=True)(motion.acceleration)
derivative = compiled(within=True)(motion.derivative)
loads = compiled(within=True)(motion.loads)


@compiled(within=True)
def chain_of(p, n):
    """Read the parts of the chain."""
    per_J, c, b = p[HEAD:], p[HEAD + n :], p[HEAD + 2 * n :]
    return Chain(rows(per_J), rows(c), rows(b))


@compiled(rates_signature)
def rates(moment, y, p, out):
    """Fill theta', theta'', then the rows with peaks."""
    n = len(y) // 2
    instant, chain = named(Moment, moment), chain_of(p, n)
    first = HEAD + 3 * n
    steps = first + PIECE * int(p[1, 0])
    # kept where `loads` takes it from, row by row
    static = rows(out[3 * n : 4 * n])
    static_deflection(instant.phase, rows(p[steps:]), static)
    phi0__ = acceleration(instant.t, instant.phase, rows(p[first:steps]))
    derivative(phi0__, rows(y), rows(y[n:]), static, chain, rows(out))
    loads(instant.phase >= rows(p)[0], rows(y), static, chain, rows(out[2 * n :]))


@compiled(rates_signature)
def watch(moment, y, p, out):
    """Fill the rows with peaks alone."""
    n = len(y) // 2
    instant, chain = named(Moment, moment), chain_of(p, n)
    steps = HEAD + 3 * n + PIECE * int(p[1, 0])
    static = rows(out[n : 2 * n])
    static_deflection(instant.phase, rows(p[steps:]), static)
    loads(instant.phase >= rows(p)[0], rows(y), static, chain, rows(out))
