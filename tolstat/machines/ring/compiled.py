"""The ring's equations in registers, for any number of harmonics and lobes.

Rows of the parameters: what `motion.Tool` names; what `motion.Ring` names, each of all
harmonics; then of each lobe of the blank its two parts.
"""

from tolstat.machines.ring import motion
from tolstat.machines.ring.motion import HEAD, RING, Ring, Tool
from tolstat.moving import compiled, named, rates_signature, rows, write

cutting_forces = compiled(within=True)(motion.cutting_forces)
depth_of_cut = compiled(within=True)(motion.depth_of_cut)
derivative = compiled(within=True)(motion.derivative)
reactions = compiled(within=True)(motion.reactions)


@compiled(within=True)
def ring_of(P, n):
    """Read the ring, n rows a field."""
    return Ring(
        P[:n], P[n : 2 * n], P[2 * n : 3 * n], P[3 * n : 4 * n], P[4 * n : 5 * n],
        P[5 * n : 6 * n], P[6 * n : 7 * n], P[7 * n : 8 * n], P[8 * n : 9 * n],
        P[9 * n : 10 * n], P[10 * n : 11 * n],
    )  # fmt: skip


@compiled(rates_signature)
def rates(moment, y, p, out):
    """Fill derivatives; rows with peaks: t_R, X, rollers; timed above zero: -t_R."""
    n = len(y) // 4
    Y, P, filled = rows(y), rows(p), rows(out)
    tool, ring = named(Tool, p), ring_of(P[HEAD:], n)
    t_R = depth_of_cut(rows(moment)[0], Y, P[HEAD + RING * n :], tool, ring)
    P_R, P_T = cutting_forces(t_R, tool)
    a_1__, b_1__ = derivative(Y, P_R, P_T, tool, ring, filled)
    l_1, l_2 = reactions(a_1__, b_1__, P_R, P_T, tool)
    write(out, 4 * n + 2, (t_R, Y[4 * n], l_1, l_2, -t_R))
