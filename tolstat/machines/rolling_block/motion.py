"""Motion of the drive: equations as matrices, for two methods that solve them.

In the angles of the masses, (1) is Q phi'' + K phi = M, with K of `structure`. The
paper takes the difference of two lines for each link, (2): the angles grow without end
and would drown the twists phi_ij = B phi. With elastic moments C phi_ij, and damping
moments H phi_ij' of a modal damping that the paper does not print,

    phi_ij'' = -A (C phi_ij + H phi_ij') + B Q^-1 M,    A = B Q^-1 B^T.

In the first line of (2) the left side is phi''_12 (printed: phi''_2). The equations are
linear, so loads are those of 1 N m: in all if the stands step one after the other, on
its stand for a pulse.
"""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block import structure
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import Drive, Modes, nominal
from tolstat.machines.rolling_block.structure import LINKS, MASSES, STANDS, twists
from tolstat.moving import Accuracy, LinearMotion, Solution, System, integrate, solve

# At least so many steps in each period of the highest mode: otherwise the tolerance
# could permit steps over its swings.
STEPS_A_PERIOD = 4


class Loading(NamedTuple):
    """Moments on the masses, switched at marks."""

    marks: tuple[float, ...]  # s, ascending: start, every switch, end
    moments: Array  # [phase, mass], behind each mark but the last, N m; they drive


def damping_matrix(modes: Modes, C: Array, zeta: Array) -> Array:
    """Return the damping moment in each link per rate of each twist, N m s/rad.

    The paper prints no damping: every elastic mode has the damping ratio zeta, the
    rigid one none. With phi^T M phi = 1 that is

        D = M Phi diag(2 zeta omega) Phi^T M,

    and since M phi_r = K phi_r / omega_r^2, D = B^T H B with the twists B phi and

        H_ef = 2 zeta sum over r of M_er M_fr / omega_r^3,   M_er = C_e phi_e,r.

    H[trial, link, link] of stiffnesses C, N m/rad, [trial, link], and zeta, [trial].
    """
    omega, _, phi_ij = modes
    moments = C[:, :, None] * phi_ij
    H = np.zeros((len(C), C.shape[1], C.shape[1]))
    for r in range(omega.shape[1]):  # one by one: the sum is the same in any block
        w, M = omega[:, r, None, None], moments[:, :, r]
        H = H + M[:, :, None] * M[:, None, :] / (w * w * w)
    return 2.0 * zeta[:, None, None] * H


def equations(drive: Drive, loading: Loading) -> tuple[Array, Array, Array]:
    """Return A C, A H, [trial, link, link], and B Q^-1 M, [trial, phase, link].

    Of (2), for Runge-Kutta.
    """
    per_Q = 1.0 / drive.Q[:, :, None]
    B = twists(np.eye(len(MASSES)))
    A = twists(per_Q * B.T)
    H = damping_matrix(drive.modes, drive.C, drive.zeta)
    load = twists(per_Q * loading.moments.T).swapaxes(1, 2)
    return A * drive.C[:, None], A @ H, load


def at_rest(Q: Array, M: Array) -> Array:
    """Return the moments of the links, N m, when all masses accelerate as one.

    float64[trial, phase, link], under moments M[phase, mass], which drive where they
    are positive. A link carries what all masses behind it need.
    """
    total = np.cumsum(Q, axis=1)[:, -1:]
    needed = Q[:, None] * (M.sum(axis=1) / total)[:, :, None] - M
    for i, j in reversed(LINKS):
        needed[:, :, i] += needed[:, :, j]
    return np.asarray(needed[:, :, [j for _, j in LINKS]])


def linear_motion(drive: Drive, loading: Loading) -> LinearMotion:
    """Return drives as linear motion from rest; watched are the twists of the links.

    For the exact solution: rows are omega_r q_r and q_r' of each mode, with q_r'' +
    2 zeta omega_r q_r' + omega_r^2 q_r = 0. Each mode is counted from where it would
    rest under the loads: nothing drives it, and it jumps where a load steps.
    """
    Q, C, zeta, (omega, phi, phi_ij) = drive
    (n, modes), loads = omega.shape, loading.moments
    r = np.arange(modes)
    entries = np.vstack(
        [
            np.stack([r, modes + r], axis=1),
            np.stack([modes + r, r, modes + r, modes + r], axis=1).reshape(-1, 2),
        ]
    )
    slow = np.stack([-omega, -2.0 * zeta[:, None] * omega], axis=2)
    change = np.zeros((n, len(loads), 2 * modes))
    for phase, steps in enumerate(np.diff(loads, axis=0, prepend=0.0)):
        for mass in np.flatnonzero(steps):  # one by one: the same in any block
            change[:, phase, :modes] -= phi[:, mass] * steps[mass]
    change[:, :, :modes] /= omega[:, None]
    return LinearMotion(
        modes, 0, entries, np.hstack([omega, slow.reshape(n, -1)]),
        np.tile(loading.marks, (n, 1)), change, phi_ij / omega[:, None],
        at_rest(Q, loads) / C[:, None], np.zeros((n, len(LINKS))),
    )  # fmt: skip


def load_steps(settings: Settings) -> Loading:
    """Return the steps of the stands, one after the other, 1 N m in all."""
    times = sorted(set(settings.entries))
    moments = []
    for time in times:
        entries = zip(STANDS, settings.entries, strict=True)
        loads = {stand: 1.0 / len(STANDS) for stand, entry in entries if entry <= time}
        if settings.motor == "matched":
            loads[1] = sum(loads.values())
        moments.append(structure.load_vector(loads))
    return Loading((*times, settings.horizon), np.array(moments))


def pulse(settings: Settings) -> Loading:
    """Return the rectangular pulse of 1 N m on one stand; the motor's moment stays."""
    length, horizon = settings.pulse_length, settings.horizon
    ends = () if length >= horizon else (length,)
    stand = settings.pulse_stand
    moments = [structure.load_vector({stand: size}) for size in (1.0, 0.0)]
    return Loading((0.0, *ends, horizon), np.array(moments[: 1 + len(ends)]))


def followed(
    drive: Drive, loading: Loading, settings: Settings, samples: Array | None = None
) -> Solution:
    """Follow drives under a loading, from rest: exactly, or by Runge-Kutta in audits.

    Peaks are those of the elastic moments; histories those of the twists first.
    """
    if settings.runge_kutta:
        solution = integrated(drive, loading, settings, samples)
    else:
        solution = solve(linear_motion(drive, loading), samples)
    for extreme in (solution.greatest, solution.least):
        extreme *= drive.C
    return solution


def both(
    drive: Drive, settings: Settings, samples: Array | None = None
) -> tuple[Solution, Solution]:
    """Follow drives while the loads of the stands step, and after the pulse."""
    loaded = followed(drive, load_steps(settings), settings, samples)
    return loaded, followed(drive, pulse(settings), settings, samples)


def integrated(
    drive: Drive, loading: Loading, settings: Settings, samples: Array | None
) -> Solution:
    """Follow the twists of drives by Runge-Kutta."""
    # only an integration needs these equations compiled
    from tolstat.machines.rolling_block.compiled import rates, watch

    stiffness, damping, load = equations(drive, loading)
    load_changes = np.diff(load, axis=1, prepend=0.0)
    n, n_links = drive.C.shape
    matrices = np.concatenate([stiffness, damping, load_changes], axis=1)
    # errors are measured by the twists of the nominal drive
    typical = nominal(settings)
    omega = typical.modes.omega[0]
    twist = 1.0 / typical.C[0]  # of 1 N m
    scale = np.concatenate([twist, omega[0] * twist])
    return integrate(
        System(rates, scale, watch, n_extremes=n_links),
        np.zeros((n, 2 * n_links)),
        matrices.reshape(n, -1),
        np.tile(loading.marks, (n, 1)),
        Accuracy(settings.rtol, 2 * np.pi / omega[-1] / STEPS_A_PERIOD),
        samples=samples,
    )
