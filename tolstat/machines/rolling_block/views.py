"""Views of the rolling block: histories, combinations, shapes, pulses."""

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.rolling_block import (
    frequency_response,
    masses,
    regulator,
    resonance,
    torques,
)
from tolstat.machines.rolling_block.declarations import RESPONSES, Settings
from tolstat.machines.rolling_block.modes import (
    contributions,
    moments,
    tracked,
    unit_shapes,
)
from tolstat.machines.rolling_block.parameters import drives, nominal
from tolstat.machines.rolling_block.structure import LINK_NAMES, STANDS
from tolstat.model.view import (
    Axis,
    Chart,
    Curve,
    Level,
    Listing,
    Offer,
    Picture,
    Span,
    bands_of,
    peaks_of,
)

PAIRS = ("Motor side", "To C and D", "Spindles of C", "Spindles of D")
# trials with deviations, if a study gives tolerances: for fractions, for bands
MANY, SOME = 2000, 300
POINTS, PERIODS = 2001, 6  # of pulses: the lowest mode's, where the horizon permits
LENGTHS = (1e-3, 5e-3, 10e-3)  # s, the paper's range; and a step, which never ends


def chart_of(time: Array, loaded: Array, pulsed: Array, settings: Settings) -> Chart:
    """Return the moments, N m, [time, link]: loads stepping, and after the pulse.

    Curves have the names of the responses that are their peaks.
    """
    words = {response.name: response for response in RESPONSES}
    stands = ", ".join(map(str, STANDS))
    entering = Span(0.0, settings.entries[-1], f"loads: stands {stands} enter")
    lasting = min(settings.pulse_length, settings.horizon)
    pulsing = Span(0.0, lasting, "pulse: while it lasts")
    curves: list[Curve] = []
    pictures: list[Picture] = []
    for kind, loading, moments_of, span in (
        ("moment_peak", "loads", loaded, entering),
        ("pulse_peak", "pulse", pulsed, pulsing),
    ):
        by_link = zip(LINK_NAMES, moments_of.T, strict=True)
        links = [Curve.of(words[f"{kind}_{ij}"], moment) for ij, moment in by_link]
        curves += links
        spans = (span,) if span.upper else ()
        for i, pair in enumerate(PAIRS):
            two = links[2 * i : 2 * i + 2]
            pictures.append(Picture(f"{pair}, {loading}", *two, spans=spans))
    marks = peaks_of(curves, time)
    return Chart.of(Axis("time", "s", "s"), time, *pictures, marks=marks)


def combinations(_: Array, settings: Settings) -> Listing:
    """Return natural frequencies and free speeds of the nominal drives."""
    variants = settings.every_combination
    omega = np.concatenate([nominal(v).modes.omega for v in variants])
    both = zip(omega, variants, strict=True)
    free = [resonance.free_speeds(w[None], v) for w, v in both]
    total, widest = np.array(free)[:, :, 0].T
    per_speed = np.array([resonance.rolling_speeds(v) for v in variants]).T
    rolling = settings.working_speed * per_speed
    limit = np.array([resonance.fastest(v) for v in variants])
    return Listing.of(
        "positions of the stages A, B, C, D; motor speed over roll speed",
        *_named(variants),
        *((f"f{r}", "Hz", "Hz", w / (2 * np.pi)) for r, w in enumerate(omega.T, 1)),
        ("free speeds", "rad/s", "rpm", total),
        ("widest", "rad/s", "rpm", widest),
        ("condition f8/f1", "1", "1", omega[:, -1] / omega[:, 0]),
        *((f"v{s}", "m/s", "m/s", v) for s, v in zip(STANDS, rolling, strict=True)),
        ("limit of v34", "rad/s", "rpm", limit),
    )


def gearbox(_: Array, settings: Settings) -> Listing:
    """Return ratios, and inertias and stiffnesses of the nominal drives."""
    variants = settings.every_combination
    built = [nominal(v) for v in variants]
    Q, C = (np.concatenate([drive[i] for drive in built]) for i in range(2))
    links = zip(LINK_NAMES, C.T, strict=True)
    return Listing.of(
        "positions of the stages A, B, C, D; all reduced to the motor shaft",
        *_named(variants),
        ("sum of Q", "kg m^2", "kg m^2", Q.sum(axis=1)),
        *((f"Q{i}", "kg m^2", "kg m^2", q) for i, q in enumerate(Q.T, start=1)),
        *((f"C{ij}", "N m/rad", "kN m/rad", c) for ij, c in links),
    )


def _named(
    variants: list[Settings],
) -> tuple[tuple[str, str, str, NDArray[np.generic]], ...]:
    """Return the name of each combination, with its ratios of motor to roll."""
    return (
        ("combination", "1", "", np.array([v.name for v in variants])),
        ("i31", "1", "1", np.array([v.ratios.i31 for v in variants])),
        ("i34", "1", "1", np.array([v.ratios.i34 for v in variants])),
    )


def shapes(deviations: Array, settings: Settings) -> Chart:
    """Return the shapes over the mass number, as points: the drive branches."""
    modes = drives(deviations, settings).modes
    first = unit_shapes(modes.phi[0])
    others = modes.phi[1:]
    if len(others):
        _, others = tracked(others, first)
    pictures = []
    for r, hz in enumerate(modes.omega[0] / (2 * np.pi)):
        name, words = f"mode {r + 1}", f"{hz:.3f} Hz"
        curve = Curve(name, "1", f"phi{r + 1}", words, first[:, r], points=True)
        opened = bands_of(name, "1", others[:, :, r])
        zero = (Level(0.0, ""),)
        pictures.append(Picture(f"{hz:.2f} Hz", curve, *opened, levels=zero))
    number = np.arange(1.0, len(first) + 1)
    return Chart.of(Axis("mass", "1", "1"), number, *pictures)


def pulses(deviations: Array, settings: Settings) -> Chart:
    """Return the moment in response_link after the pulse, after others, and a step.

    The last curve is that of the pulse which travels from stand to stand.
    """
    drive = drives(deviations, settings)
    omega, zeta, link_name = drive.modes.omega, drive.zeta, settings.response_link
    length, size = settings.pulse_length, settings.pulse_moment
    end = min(settings.horizon, PERIODS * 2 * np.pi / float(omega[0, 0]))
    time = np.linspace(0.0, end, POINTS)
    link = slice(LINK_NAMES.index(link_name), LINK_NAMES.index(link_name) + 1)
    a = size * contributions(drive.modes, drive.C, {settings.pulse_stand: 1.0})[:, link]
    moment_name = f"M{link_name}"
    lengths = {moment_name: length, **{f"{1e3 * t:g} ms": t for t in LENGTHS}}
    after = {name: [(0.0, a[:1]), (t, -a[:1])] for name, t in lengths.items()}
    after["step"] = [(0.0, a[:1])]
    moving = torques.travelling(drive, settings)
    after["travelling"] = [(t, size * part[:1, link]) for t, part in moving]
    curves = [
        Curve(
            name, "N m", moment_name, "a pulse",
            moments(time, omega[:1], zeta[:1], steps)[0, 0], shown="N m",
        )
        for name, steps in after.items()
    ]  # fmt: skip
    steps = [(0.0, a[1:]), (length, -a[1:])]
    opened = bands_of(
        moment_name, "N m", moments(time, omega[1:], zeta[1:], steps)[:, 0]
    )
    title = f"{moment_name}: {1e3 * length:g} ms on stand {settings.pulse_stand}"
    return Chart.of(
        Axis("time", "s", "s"),
        time,
        Picture(title, curves[0], *opened),
        Picture(f"{moment_name} after other pulses", *curves[1:]),
        spans=(Span(0.0, min(length, end), "the pulse"),),
    )


OFFERS = (
    Offer("campbell", "frequencies over the motor's speed", resonance.campbell, MANY),
    Offer("resonances", "speeds that resonate, and why", resonance.resonances, MANY),
    Offer("combinations", "frequencies and speeds of each", combinations),
    Offer("gearbox", "ratios, inertias and stiffnesses of all combinations", gearbox),
    Offer("response", "frequency response", frequency_response.response, SOME),
    Offer("damping", "frequencies and damping ratios", frequency_response.damping),
    Offer("poles", "poles and zeros of a moment over loads", frequency_response.poles),
    Offer("masses", "which masses may go", masses.masses),
    Offer("shapes", "mode shapes", shapes, SOME),
    Offer("pulses", "moments after the pulse, and after others", pulses, SOME),
    Offer("travel", "peaks of a pulse from stand to stand", torques.travel),
    Offer("regulator", "growth under an assumed regulator", regulator.regulator),
    Offer("beats", "beats of pairs of modes", torques.beats),
    Offer("torques", "a moment under random rolling torques", torques.torques),
    Offer("rms", "rms of all moments under random rolling torques", torques.rms),
)
