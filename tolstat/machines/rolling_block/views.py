"""Views of the rolling block: histories, combinations, shapes, pulses."""

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.rolling_block import channels, modes, resonance, torques
from tolstat.machines.rolling_block.declarations import RESPONSES, Settings
from tolstat.machines.rolling_block.modes import Drive, nominal
from tolstat.machines.rolling_block.regulator import regulator
from tolstat.machines.rolling_block.structure import LINK_NAMES, STANDS
from tolstat.model import view
from tolstat.model.view import Axis, Chart, Curve, Listing, Offer, Picture, Span
from tolstat.moving import Solution

PAIRS = ("Motor side", "To C and D", "Spindles of C", "Spindles of D")
# trials with deviations, if a study gives tolerances: for fractions, for bands
MANY, SOME = 2000, 300


def chart_of(
    time: Array, drive: Drive, loaded: Solution, pulsed: Solution, settings: Settings
) -> Chart:
    """Return the moments while the loads of the stands step, and after the pulse.

    Curves have the names of the responses that are their peaks.
    """
    words = {response.name: response for response in RESPONSES}
    stands = ", ".join(map(str, STANDS))
    lasting = min(settings.pulse_length, settings.horizon)
    spans = {
        "loads": Span(0.0, settings.entries[-1], f"loads: stands {stands} enter"),
        "pulse": Span(0.0, lasting, "pulse: while it lasts"),
    }
    curves: list[Curve] = []
    pictures: list[Picture] = []
    for kind, loading, size, solution in (
        ("moment_peak", "loads", settings.total_load, loaded),
        ("pulse_peak", "pulse", settings.pulse_moment, pulsed),
    ):
        moments = size * drive.C * solution.history[0, :, : len(LINK_NAMES)]
        by_link = zip(LINK_NAMES, moments.T, strict=True)
        links = [Curve.of(words[f"{kind}_{ij}"], moment) for ij, moment in by_link]
        curves += links
        shaded = (spans[loading],) if spans[loading].upper else ()
        for i, pair in enumerate(PAIRS):
            two = links[2 * i : 2 * i + 2]
            pictures.append(Picture(f"{pair}, {loading}", *two, spans=shaded))
    marks = view.peaks_of(curves, time)
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


OFFERS = (
    Offer("campbell", "frequencies over the motor's speed", resonance.campbell, MANY),
    Offer("resonances", "speeds that resonate, and why", resonance.resonances, MANY),
    Offer("combinations", "frequencies and speeds of each", combinations),
    Offer("gearbox", "ratios, inertias and stiffnesses of all combinations", gearbox),
    Offer("response", "frequency response", channels.response, SOME),
    Offer("damping", "frequencies and damping ratios", channels.damping),
    Offer("poles", "poles and zeros of a moment over loads", channels.poles),
    Offer("masses", "which masses may go", modes.masses),
    Offer("shapes", "mode shapes", modes.shapes, SOME),
    Offer("pulses", "moments after the pulse, and after others", torques.pulses, SOME),
    Offer("travel", "peaks of a pulse from stand to stand", torques.travel),
    Offer("regulator", "growth under an assumed regulator", regulator),
    Offer("beats", "beats of pairs of modes", torques.beats),
    Offer("torques", "a moment under random rolling torques", torques.torques),
    Offer("rms", "rms of all moments under random rolling torques", torques.rms),
)
