"""Frequency response of the moment in a link to a load: poles, zeros, cancellation.

With modal damping, and loads per 1 N m,

    G(f) = sum over r of a_r / (1 - (f/f_r)^2 + 2 i zeta f/f_r),

where a_r = C_ij phi_ij,r (phi_r^T L) / omega_r^2 is what mode r adds to the moment in
the link ij under a static load L. The rigid mode twists nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import Modes, contributions
from tolstat.machines.rolling_block.parameters import Drive, drives
from tolstat.machines.rolling_block.structure import LINK_NAMES
from tolstat.model.view import Axis, Chart, Curve, Listing, Panel, bands_of

POINTS = 1200
BELOW, BEYOND = 0.2, 1.3  # of the lowest and the highest natural frequency: the axis
NO_PART = 1e-9  # of the contributions of all modes: a smaller one is none


def response(
    frequency: Array, modes: Modes, a: Array, zeta: Array
) -> NDArray[np.complex128]:
    """Return G, N m, complex128[trial, frequency], over the frequency, Hz.

    Contributions are a[trial, mode], N m.
    """
    ratio = 2 * np.pi * frequency / modes.omega[:, :, None]
    below = 1.0 - ratio**2 + 2j * zeta[:, None, None] * ratio
    G: NDArray[np.complex128] = np.sum(a[:, :, None] / below, axis=1)
    return G


class PolesAndZeros(NamedTuple):
    """Of the undamped response of one drive, Hz."""

    poles: Array  # ascending
    cancelled: Array  # natural frequencies without response in the link
    zeros: Array  # ascending; where the link is at rest


def poles_and_zeros(omega: Array, a: Array) -> PolesAndZeros:
    """Return where an undamped response is infinite, and where it is zero.

    Zeros that no real frequency meets are left out.

    Parameters
    ----------
    omega, a : float64[mode]
        Natural frequencies of one drive, rad/s; contributions of its modes to the
        moment of one link, N m.
    """
    takes_part = np.abs(a) > NO_PART * np.sum(np.abs(a))
    # x = (f/f_ref)^2 and its poles, of the order of 1
    reference = np.exp(np.mean(np.log(omega)))
    poles, part = (omega[takes_part] / reference) ** 2, a[takes_part]
    numerator = np.zeros(1)
    for r, size in enumerate(part):
        others = np.delete(poles, r)
        numerator = np.polyadd(numerator, size * np.poly(others) / np.prod(-others))
    # A moment does not jump in a link that is links away from the load: the sums of
    # a_r x_r, a_r x_r^2, ... vanish, and with each of them the highest power of x
    moment = part
    while len(numerator) > 1:
        moment = moment * poles
        if abs(np.sum(moment)) > NO_PART * np.sum(np.abs(moment)):
            break
        numerator = numerator[1:]
    roots = np.roots(numerator)
    real = np.abs(roots.imag) < 1e-9 * np.abs(roots)
    on_the_axis = np.sort(roots.real[real & (roots.real > 0)])
    return PolesAndZeros(
        poles=omega[takes_part] / (2 * np.pi),
        cancelled=omega[~takes_part] / (2 * np.pi),
        zeros=np.sqrt(on_the_axis) * reference / (2 * np.pi),
    )


def _channels(drive: Drive, settings: Settings) -> dict[str, Array]:
    """Return contributions [trial, mode] to the link, by its loads in words.

    Each load by itself, then all of them at once, 1 N m each.
    """
    link = LINK_NAMES.index(settings.response_link)
    loads = settings.response_loads
    asked = [(load,) for load in loads] + ([loads] if len(loads) > 1 else [])
    words = {1: "motor"}
    return {
        " + ".join(words.get(load, str(load)) for load in those): contributions(
            drive.modes, drive.C, dict.fromkeys(those, 1.0)
        )[:, link]
        for those in asked
    }


def frequency_response(deviations: Array, settings: Settings) -> Chart:
    """Return amplitude and phase of the moment in the link per moment of the load."""
    drive = drives(deviations, settings)
    omega = drive.modes.omega[0] / (2 * np.pi)
    even = np.geomspace(BELOW * omega[0], BEYOND * omega[-1], POINTS)
    # the points include the peaks, where they are finite
    damped = drive.zeta[0] > 0
    frequency = np.unique(np.concatenate([even, omega])) if damped else even
    link = settings.response_link
    amplitudes, phases = [], []
    for words, a in _channels(drive, settings).items():
        G = response(frequency, drive.modes, a, drive.zeta)
        size, angle = np.abs(G), np.angle(G[0])
        over = f"M{link} over the load"
        amplitudes.append(Curve(words, "1", "|G|", over, size[0], shown="1"))
        phases.append(Curve(f"phase, {words}", "rad", "arg G", "", angle, shown="deg"))
    spreads = bands_of(words, "1", size[1:])  # of the last: all at once
    loads = "motor" if settings.response_loads == (1,) else "loads"
    title = f"M{link} over {loads}: amplitude"
    return Chart(
        Axis("frequency", "Hz", "Hz", logarithmic=True),
        frequency,
        (*amplitudes, *phases),
        bands=spreads,
        panels=(
            Panel.of(title, *amplitudes, *spreads, logarithmic=True),
            Panel.of("Phase", *phases),
        ),
    )


def poles(deviations: Array, settings: Settings) -> Listing:
    """Return poles, zeros and modes that do not reach the link, without damping."""
    drive = drives(deviations[:1], settings)
    omega = drive.modes.omega[0]
    rows: list[tuple[str, str, float, float]] = []
    for words, a in _channels(drive, settings).items():
        found = poles_and_zeros(omega, a[0])
        parts = dict(zip((omega / (2 * np.pi)).tolist(), a[0].tolist(), strict=True))
        of_load = [(f, "pole", parts[f]) for f in found.poles.tolist()]
        of_load += [(f, "does not reach", 0.0) for f in found.cancelled.tolist()]
        of_load += [(f, "zero", np.nan) for f in found.zeros.tolist()]
        rows += [(words, kind, f, part) for f, kind, part in sorted(of_load)]
    load, kind, frequency, part = map(np.array, zip(*rows, strict=True))
    return Listing.of(
        f"where M{settings.response_link} is infinite or zero, or is not reached",
        ("load", "1", "", load),
        ("what", "1", "", kind),
        ("frequency", "Hz", "Hz", frequency),
        ("static part a_r", "1", "1", part),
    )
