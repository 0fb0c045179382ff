"""Stability of the drive under a speed regulator with a notch.

The paper says only, after Fig. 2: the first mode lies in the regulator's range; a notch
of 15 to 25 Hz that takes at least 12 dB suppresses it; the regulator is tuned to the
least inertia. All else is assumed, so the numbers illustrate this and are no facts
about the mill:

    w' = (omega_1 - w)/T_f,  T_t M1' = u - M1,  u = N(s) K_p (1 + 1/(T_i s)) (ref - w),
    N = (s^2 + 2 d z w_n s + w_n^2)/(s^2 + 2 z w_n s + w_n^2).
"""

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import Drive, nominal
from tolstat.model.view import Listing

CENTRE = 15.0, 25.0  # Hz, the range of the notch


def closed_loop(
    drive: Drive, settings: Settings, K_p: float, notch: Array | None
) -> NDArray[np.complex128]:
    """Return the poles, 1/s, [trial, 20, or 22 with the notch], slowest first.

    States: q and q' of the modes, the rigid speed, w, the integral of -w, M1, and two
    of the notch, whose centres are float64[trial], rad/s.
    """
    omega, phi, _ = drive.modes
    n, z = omega.shape[1], settings.notch_damping
    rigid, w, total, M1, x, x_ = range(2 * n, 2 * n + 6)
    A = np.zeros((len(omega), 2 * n + 6, 2 * n + 6))
    A[:, :n, n : 2 * n] = np.eye(n)
    A[:, n : 2 * n, :n] = -np.eye(n) * (omega * omega)[:, None, :]
    lost = 2.0 * drive.zeta[:, None] * omega
    A[:, n : 2 * n, n : 2 * n] = -np.eye(n) * lost[:, None, :]
    A[:, n : 2 * n, M1], A[:, rigid, M1] = phi[:, 0], 1.0 / drive.Q.sum(axis=1)
    A[:, w, n : 2 * n], A[:, w, rigid], A[:, w, w] = phi[:, 0], 1.0, -1.0
    A[:, w] /= settings.speed_lag
    A[:, total, w] = -1.0
    gains = {w: -K_p, total: K_p / settings.integral_time}
    for state, gain in gains.items():
        A[:, M1, state] = A[:, x_, state] = gain
    A[:, M1, M1] = -1.0
    if notch is None:
        A = A[:, :x, :x]
    else:
        A[:, x, x_], A[:, x_, x], A[:, x_, x_] = 1.0, -(notch**2), -2.0 * z * notch
        A[:, M1, x_] = 2.0 * (settings.notch_depth - 1.0) * z * notch
    A[:, M1] /= settings.torque_lag
    poles = np.linalg.eigvals(A).astype(complex)
    return np.take_along_axis(poles, np.argsort(-poles.real, axis=1), axis=1)


def regulator(_: Array, settings: Settings) -> Listing:
    """Return the growth of each combination, with the notch and without."""
    variants = settings.every_combination
    drives = [nominal(variant) for variant in variants]
    K_p = settings.speed_gain * min(drive.Q.sum() for drive in drives)
    first = np.array([drive.modes.omega[:1, 0] for drive in drives])
    w_n = np.clip(first, 2 * np.pi * CENTRE[0], 2 * np.pi * CENTRE[1])
    if settings.notch_frequency is not None:
        w_n[:] = 2 * np.pi * settings.notch_frequency
    bare = [closed_loop(drive, settings, K_p, None)[0, 0] for drive in drives]
    notched = zip(drives, w_n, strict=True)
    held = [closed_loop(drive, settings, K_p, w)[0, 0] for drive, w in notched]
    assumed = {
        "K_p": ("N m s", K_p),
        "T_i": ("s", settings.integral_time),
        "T_f": ("s", settings.speed_lag),
        "T_t": ("s", settings.torque_lag),
        "z": ("1", settings.notch_damping),
        "d": ("1", settings.notch_depth),
    }
    return Listing.of(
        "a combination: its greatest real part; it is unstable above 0",
        ("combination", "1", "", np.array([v.name for v in variants])),
        ("no notch", "1/s", "1/s", np.real(bare)),
        ("notch", "1/s", "1/s", np.real(held)),
        ("at", "Hz", "Hz", w_n[:, 0] / (2 * np.pi)),
        *(
            (f"assumed {name}", unit, unit, np.full(len(variants), value))
            for name, (unit, value) in assumed.items()
        ),
    )
