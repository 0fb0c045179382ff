"""Views of frequency functions: response, poles and zeros, damping.

Of the moment in a link, with modal damping and loads per 1 N m, they are

    G(f) = sum over r of a_r / (1 - (f/f_r)^2 + 2 i zeta f/f_r),

where a_r = C_ij phi_ij,r (phi_r^T L) / omega_r^2 is what mode r adds to the moment in
the link ij under a static load L. The rigid mode twists nothing.
"""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block import channels
from tolstat.machines.rolling_block.declarations import LOADS, MOMENT, Settings
from tolstat.machines.rolling_block.modes import contributions
from tolstat.machines.rolling_block.parameters import Drive, drives
from tolstat.machines.rolling_block.resonance import named_orders
from tolstat.machines.rolling_block.structure import GAPS, LINK_NAMES
from tolstat.model.view import Axis, Chart, Curve, Listing, Picture, Span, bands_of

POINTS = 1200
BELOW, BEYOND = 0.2, 1.3  # of the lowest and the highest natural frequency: the axis
NO_PART = 1e-9  # of the contributions of all modes: a smaller one is none


class PolesAndZeros(NamedTuple):
    """Of the undamped response of one drive, Hz."""

    poles: Array  # ascending
    cancelled: Array  # natural frequencies without response in the link
    zeros: Array  # ascending; where the link is at rest


def poles_and_zeros(omega: Array, a: Array) -> PolesAndZeros:
    """Return where an undamped response is infinite, and where it is zero.

    Of omega[mode], rad/s, of one drive, and a[mode], N m, the contributions of its
    modes to the moment of one link. Zeros that no real frequency meets are left out.
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
    f, zeros = omega / (2 * np.pi), np.sqrt(on_the_axis) * reference / (2 * np.pi)
    return PolesAndZeros(f[takes_part], f[~takes_part], zeros)


def _loads(settings: Settings) -> dict[str, tuple[int, ...]]:
    """Return response_loads in words: each by itself, then all of them at once."""
    places = settings.response_loads
    choices = [(load,) for load in places] + ([places] if len(places) > 1 else [])
    words = {1: "motor"}
    return {
        " + ".join(words.get(load, str(load)) for load in those): those
        for those in choices
    }


def frequencies(drive: Drive) -> Array:
    """Return the axis, Hz, with the peaks of the first where they are finite."""
    omega = drive.modes.omega[0] / (2 * np.pi)
    even = np.geomspace(BELOW * omega[0], BEYOND * omega[-1], POINTS)
    return np.unique(np.append(even, omega)) if drive.zeta[0] > 0 else even


def response(deviations: Array, settings: Settings) -> Chart:
    """Return amplitude and phase of the output per unit of the input."""
    drive = drives(deviations, settings)
    frequency = frequencies(drive)
    name, link = settings.response_output, settings.response_link
    answer = channels.output_of(link if name == MOMENT else name, settings)
    title = f"stretch {name}" if name in GAPS else name
    title = f"M{link}" if name == MOMENT else title
    sources = {words: channels.loads(*on) for words, on in _loads(settings).items()}
    denominator = "loads" if len(sources) > 1 or "motor" not in sources else "motor"
    if settings.response_input != LOADS:
        denominator = settings.response_input
        sources = {denominator: channels.input_of(denominator, settings)}
    amplitudes, phases = [], []
    for words, source in sources.items():
        G = channels.transfer(frequency, drive, settings, source, answer)[:, 0]
        size, angle = np.abs(G), np.angle(G[0])
        unit = f"{answer.unit}/{'/'.join(source.unit.split())}"
        unit = "1" if source.unit == answer.unit else unit
        of_one = f"{title} over the {'load' if denominator == 'loads' else denominator}"
        amplitudes.append(Curve(words, unit, "|G|", of_one, size[0], shown=unit))
        phases.append(Curve(f"phase, {words}", "rad", "arg G", "", angle, shown="deg"))
    spreads = bands_of(words, unit, size[1:])  # of the last: all at once
    turns = settings.working_speed / (2 * np.pi)
    works = {
        name: order * turns
        for name, order in named_orders(settings).items()
        if frequency[0] <= order * turns <= frequency[-1]
    }
    words = f"{title} over {denominator}: amplitude"
    return Chart.of(
        Axis("frequency", "Hz", "Hz", logarithmic=True),
        frequency,
        Picture(words, *amplitudes, *spreads, logarithmic=True),
        Picture("Phase", *phases),
        spans=tuple(Span(f, f, f"{w} at the working speed") for w, f in works.items()),
    )


def poles(deviations: Array, settings: Settings) -> Listing:
    """Return poles, zeros and modes that do not reach the link, without damping."""
    drive = drives(deviations[:1], settings)
    omega = drive.modes.omega[0]
    rows: list[tuple[str, str, float, float]] = []
    link = LINK_NAMES.index(settings.response_link)
    for words, those in _loads(settings).items():
        a = contributions(drive.modes, drive.C, dict.fromkeys(those, 1.0))[:, link]
        lines = poles_and_zeros(omega, a[0])
        parts = dict(zip((omega / (2 * np.pi)).tolist(), a[0].tolist(), strict=True))
        of_load = [(f, "pole", parts[f]) for f in lines.poles.tolist()]
        of_load += [(f, "does not reach", 0.0) for f in lines.cancelled.tolist()]
        of_load += [(f, "zero", np.nan) for f in lines.zeros.tolist()]
        rows += [(words, kind, f, part) for f, kind, part in sorted(of_load)]
    load, kind, frequency, part = map(np.array, zip(*rows, strict=True))
    return Listing.of(
        f"where M{settings.response_link} is infinite or zero, or is not reached",
        ("load", "1", "", load),
        ("what", "1", "", kind),
        ("frequency", "Hz", "Hz", frequency),
        ("static part a_r", "1", "1", part),
    )


def damping(deviations: Array, settings: Settings) -> Listing:
    """Return frequency and damping ratio of each mode, modal or by link."""
    drive = drives(deviations[:1], settings)
    frequency, zeta = channels.poles_of(drive, settings)
    undamped = drive.modes.omega[0] / (2 * np.pi)
    return Listing.of(
        "a mode, ascending; loss factors have no free vibration and do not count",
        ("mode", "1", "count", np.arange(1, len(undamped) + 1)),
        ("frequency", "Hz", "Hz", frequency[0]),
        ("damping ratio", "1", "%", zeta[0]),
        ("undamped", "Hz", "Hz", undamped),
    )
