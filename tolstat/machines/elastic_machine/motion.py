"""Equations of motion of the chain, once: in NumPy, for any number of masses.

    I theta'' + B theta' + C theta = -I 1 phi0'' + M(t),  theta(0) = theta'(0) = 0

theta_s is the twist of mass s against the programmed motion phi0(t). B is not
diagonalised, so the damping may be any. M steps at given times, so C^-1 M is known
beforehand, and C theta - M = C (theta - C^-1 M): each spring is wound up from where it
would rest. Rows are of masses; called on arrays [row, lane] the equations run in NumPy,
compiled they run in registers.

This is (1) for one mass, and what (7) is made of for a chain. In (7) phi0' is a
misprint of phi0''.
"""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths


class Piece(NamedTuple):
    """A piece of the programmed motion of each trial, each float64[lanes]."""

    on: Array  # phase from which it holds
    until: Array  # phase from which no more
    begin: Array  # s
    f: Array  # phi0'' at its begin, rad/s2, and its derivatives
    f_: Array
    f__: Array
    f___: Array
    turn: Array  # rad/s: of a cosine, whose first derivative is 0; or 0


PIECE = len(Piece._fields)
# these parameters come first: the phase from which the programmed motion is over, the
# number of its pieces, the same in all trials
HEAD = 2


class Chain(NamedTuple):
    """The parts of each trial, each float64[mass, lanes]."""

    per_J: Array  # 1/(kg m2)
    c: Array  # N m/rad, of the spring before the mass
    b: Array  # N m s/rad, of the same spring


def acceleration(t: Array, phase: Array, pieces: Array) -> Array:
    """Return phi0'', rad/s2, of all pieces, float64[row, lanes].

    The phase decides, not the time: a step that lands on the end of the start-up still
    sees the acceleration before it.
    """
    total = 0.0 * t
    for first in range(0, len(pieces), PIECE):
        on, until, begin = pieces[first], pieces[first + 1], pieces[first + 2]
        f, f_, f__ = pieces[first + 3], pieces[first + 4], pieces[first + 5]
        f___, turn = pieces[first + 6], pieces[first + 7]
        x = t - begin
        powers = f + x * (f_ + x * (0.5 * f__ + x * f___ * (1.0 / 6.0)))
        half = np.sin(0.5 * turn * x) / np.where(turn > 0.0, turn, 1.0)
        f_t = np.where(turn > 0.0, f + 2.0 * f__ * half * half, powers)
        total = total + np.where((phase >= on) & (phase < until), f_t, 0.0)
    return total


def static_deflection(phase: Array, steps: Array, out: Array) -> None:
    """Fill C^-1 M(t), rad, in out[mass, lanes], of phase[lanes].

    steps[row, lanes] are, for each step of the load, the phase from which it acts, then
    what it deflects each mass by, rad.
    """
    n = len(out)
    for s in range(n):
        deflection = 0.0 * phase
        for i in range(len(steps) // (n + 1)):
            row = i * (n + 1)
            acts = phase >= steps[row]
            deflection = deflection + np.where(acts, steps[row + 1 + s], 0.0)
        out[s] = deflection


def derivative(
    phi0__: Array, theta: Array, theta_: Array, static: Array, chain: Chain, out: Array
) -> None:
    """Fill theta', rad/s, then theta'', rad/s2, in out[2 masses, lanes].

    phi0__[lanes] is the programmed acceleration, rad/s2; theta, theta_ and the static
    deflection C^-1 M, [mass, lanes], are in rad, rad/s, rad.
    """
    n = len(static)
    # outwards: the torque of the spring before each mass, and of the one behind it
    wound = theta[0] - static[0]
    before = chain.c[0] * wound + chain.b[0] * theta_[0]
    out[0] = theta_[0]
    for s in range(1, n):
        wound_here = theta[s] - static[s]
        turning = theta_[s] - theta_[s - 1]
        behind = chain.c[s] * (wound_here - wound) + chain.b[s] * turning
        out[n + s - 1] = chain.per_J[s - 1] * (behind - before) - phi0__
        out[s] = theta_[s]
        wound, before = wound_here, behind
    out[n + n - 1] = -chain.per_J[n - 1] * before - phi0__


def loads(ended: Truths, theta: Array, static: Array, chain: Chain, out: Array) -> None:
    """Fill the rows with peaks in out[3 masses, lanes].

    theta, rad; after start-up, where it is over[lanes], what is left of it beside the
    static deflection, rad; elastic torque of the spring before each mass, N m. theta
    and static[mass, lanes] are in rad; static may lie in the second third of `out`.
    """
    n = len(static)
    twist = theta[0]
    for s in range(n):
        if s > 0:
            twist = theta[s] - theta[s - 1]
        out[s] = theta[s]
        out[n + s] = np.where(ended, theta[s] - static[s], 0.0)
        out[2 * n + s] = chain.c[s] * twist
