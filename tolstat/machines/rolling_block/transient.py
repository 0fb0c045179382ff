"""Moments after loads have stepped, in closed form, mode by mode.

The machine's answers are integrated (`motion`); these are what they are held against,
and what the view of pulses draws.
"""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.frequency_response import contributions
from tolstat.machines.rolling_block.modes import Modes
from tolstat.machines.rolling_block.parameters import Seen
from tolstat.machines.rolling_block.structure import LINK_NAMES
from tolstat.model.view import Axis, Chart, Curve, Panel, Span, bands_of

POINTS = 2001
PERIODS = 6  # of the lowest mode are drawn, where the horizon is not shorter
LENGTHS = (1e-3, 5e-3, 10e-3)  # s, the paper's range; and a step, which never ends


def step(time: Array, omega: Array, zeta: Array) -> Array:
    """Return how a mode follows a unit step of its load at time 0, from rest.

    s(t) = 1 - exp(-zeta omega t) (cos omega_d t + zeta omega/omega_d sin omega_d t),
    with omega_d = omega sqrt(1 - zeta^2); written by its two roots, so that damping may
    be critical or more.

    Returns
    -------
    float64[trial, mode, time]
        Of time[time], s, before 0 nothing moves; omega[trial, mode], rad/s; damping
        ratio zeta[trial].
    """
    z = zeta[:, None, None]
    w = omega[:, :, None]
    t = np.maximum(time, 0.0)
    j_omega_d = w * np.sqrt(z * z - 1.0 + 0j)
    slow = j_omega_d - z * w  # of two roots that are real
    # (exp(slow t) - exp(fast t))/(slow - fast), which is t exp(slow t) where they meet
    apart = np.where(j_omega_d == 0.0, 1.0, 2.0 * j_omega_d)
    parted = np.where(j_omega_d == 0.0, t, -np.expm1(-2.0 * j_omega_d * t) / apart)
    followed: Array = (1.0 - np.exp(slow * t) * (1.0 - slow * parted)).real
    return followed


def moments(
    time: Array, modes: Modes, zeta: Array, steps: list[tuple[float, Array]]
) -> Array:
    """Return the elastic moments of all links after steps of the loads, from rest.

    Parameters
    ----------
    time, zeta : float64[time], float64[trial]
        s; damping ratio.
    steps : list of (float, float64[trial, link, mode])
        When, s; and the static modal contributions of what steps then, N m.

    Returns
    -------
    float64[trial, link, time]
        M_ij = C_ij (phi_i - phi_j), N m.
    """
    total = np.zeros((len(zeta), modes.phi_ij.shape[1], len(time)))
    for begin, a in steps:
        total += a @ step(time - begin, modes.omega, zeta)
    return total


def pulses(seen: Seen) -> Chart:
    """Chart the moments of all links after the pulse, and of one link after others."""
    settings, drive = seen.settings, seen.drive
    shown, length = settings.response_link, settings.pulse_length
    end = min(settings.horizon, PERIODS * 2 * np.pi / float(seen.modes.omega[0, 0]))
    time = np.linspace(0.0, end, POINTS)
    load = {settings.pulse_stand: settings.pulse_moment}
    a = contributions(seen.modes, drive.C, load)
    first = Modes(*(each[:1] for each in seen.modes))
    one = LINK_NAMES.index(shown)

    def followed(*ends: float) -> Array:
        """Return the moments of the first drive under a load that ends, or never."""
        steps = [(0.0, a[:1]), *((end, -a[:1]) for end in ends)]
        found: Array = moments(time, first, drive.zeta[:1], steps)[0]
        return found

    def curve(name: str, link: str, words: str, moment: Array) -> Curve:
        return Curve(name, "N m", f"M{link}", words, moment, shown="N m")

    links = [
        curve(f"M{ij}", ij, "after the pulse", moment)
        for ij, moment in zip(LINK_NAMES, followed(length), strict=True)
    ]
    words = "pulse of this length"
    others = [
        curve(f"{1e3 * each:g} ms", shown, words, followed(each)[one])
        for each in LENGTHS
    ]
    others.append(curve("step", shown, "load that stays", followed()[one]))

    omega, phi, phi_ij = (each[seen.others] for each in seen.modes)
    of_others = a[seen.others, one : one + 1]
    spread = moments(
        time,
        Modes(omega, phi, phi_ij[:, one : one + 1]),
        drive.zeta[seen.others],
        [(0.0, of_others), (length, -of_others)],
    )
    opened = bands_of(f"M{shown}", "N m", spread[:, 0])
    title = f"{1e3 * length:g} ms on stand {settings.pulse_stand}: gearbox"
    panels = [
        Panel.of(title, *links[:4]),
        Panel.of("Spindles", *links[4:]),
        Panel.of(f"M{shown} after other pulses", *others),
    ]
    if opened:
        panels.insert(2, Panel.of(f"M{shown}, tolerances", links[one], *opened))
    return Chart(
        Axis("time", "s", "s"),
        time,
        (*links, *others),
        bands=opened,
        spans=(Span(0.0, min(length, end), "the pulse"),),
        panels=tuple(panels),
    )
