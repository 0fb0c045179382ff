"""The drive as linear motion, in the twists of its links, for its exact solution.

The twists are counted from where they would rest in relative equilibrium under the
loads: nothing drives them, and they jump where a load steps.
"""

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.parameters import Drive
from tolstat.machines.rolling_block.structure import LINKS
from tolstat.moving import LinearMotion

N_LINKS = len(LINKS)


def couplings(Q: Array) -> Array:
    """Return what a unit moment in a link does to each twist, 1/(kg m2), [trial, e, f].

    B Q^-1 B^T of Q[trial, mass], where B phi are the twists phi_i - phi_j.
    """
    found = np.zeros((len(Q), N_LINKS, N_LINKS))
    for e, (i, j) in enumerate(LINKS):
        for f, ends in enumerate(LINKS):
            for mass, sign in ((i, 1.0), (j, -1.0)):
                if mass in ends:
                    turn = sign if ends[0] == mass else -sign
                    found[:, e, f] += turn / Q[:, mass]
    return found


def at_rest(Q: Array, M: Array) -> Array:
    """Return the moments of the links, N m, when all masses accelerate as one.

    float64[trial, link], under moments M[mass], which drive where they are positive.
    A link carries what all masses behind it need.
    """
    total = np.cumsum(Q, axis=1)[:, -1]
    needed = Q * (M.sum() / total)[:, None] - M
    for i, j in reversed(LINKS):
        needed[:, i] += needed[:, j]
    return np.asarray(needed[:, [j for _, j in LINKS]])


def motion_of(
    drive: Drive, H: Array, marks: tuple[float, ...], loads: list[Array]
) -> LinearMotion:
    """Return drives as linear motion from rest; watched are the twists of the links.

    Parameters
    ----------
    drive : Drive
        Their numbers.
    H : float64[trial, link, link]
        The damping moment in each link per rate of each twist, N m s/rad.
    marks : tuple of float
        Ascending, s.
    loads : list of float64[mass]
        The moments behind each mark but the last, N m.
    """
    Q, C, zeta, modes = drive
    n, links = len(Q), np.arange(N_LINKS)
    A = couplings(Q)
    G = np.zeros((n, 2 * N_LINKS, 2 * N_LINKS))
    G[:, links, N_LINKS + links] = 1.0
    G[:, N_LINKS:, :N_LINKS] = -A * C[:, None, :]
    for e in links:  # one by one: the sum is the same in any block
        G[:, N_LINKS:, N_LINKS:] -= A[:, :, e, None] * H[:, None, e, :]
    # by structure, not by the numbers of this block
    joined = np.array([[bool({*e} & {*f}) for f in LINKS] for e in LINKS])
    every = np.ones_like(joined)
    entries = np.argwhere(np.block([[~every, np.eye(N_LINKS) > 0], [joined, every]]))
    rest = np.stack([at_rest(Q, M) / C for M in loads], axis=1)
    change = np.zeros((n, len(loads), 2 * N_LINKS))
    change[:, :, :N_LINKS] = -np.diff(rest, axis=1, prepend=0.0)
    return LinearMotion(
        N_LINKS, entries, G[:, entries[:, 0], entries[:, 1]],
        modes.omega[:, -1] * (zeta + np.sqrt(zeta * zeta + 1.0)),
        np.tile(marks, (n, 1)), change, np.stack([links, links], axis=1), rest,
        np.zeros((n, N_LINKS)),
    )  # fmt: skip
