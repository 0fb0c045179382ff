"""Views of the rolling block: histories, combinations, shapes, pulses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.rolling_block.declarations import RESPONSES, Settings
from tolstat.machines.rolling_block.frequency_response import (
    damping,
    frequency_response,
    poles,
)
from tolstat.machines.rolling_block.masses import masses
from tolstat.machines.rolling_block.modes import (
    contributions,
    moments,
    tracked,
    unit_shapes,
)
from tolstat.machines.rolling_block.parameters import drives, nominal
from tolstat.machines.rolling_block.regulator import regulator
from tolstat.machines.rolling_block.resonance import (
    campbell,
    fastest,
    free_speeds,
    resonances,
    rolling_speeds,
)
from tolstat.machines.rolling_block.structure import (
    LINK_NAMES,
    STANDS,
)
from tolstat.machines.rolling_block.torques import beats, rms, torques, travel
from tolstat.model.view import (
    Axis,
    Band,
    Chart,
    Curve,
    Level,
    Listing,
    Offer,
    Panel,
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

    Returns
    -------
    Chart
        Curves have the names of the responses that are their peaks.
    """
    words = {response.name: response for response in RESPONSES}
    stands = ", ".join(map(str, STANDS))
    entering = Span(0.0, settings.entries[-1], f"loads: stands {stands} enter")
    lasting = min(settings.pulse_length, settings.horizon)
    pulsing = Span(0.0, lasting, "pulse: while it lasts")
    curves: list[Curve] = []
    panels: list[Panel] = []
    for kind, what, moments_of, span in (
        ("moment_peak", "loads", loaded, entering),
        ("pulse_peak", "pulse", pulsed, pulsing),
    ):
        links = [
            Curve.of(words[f"{kind}_{ij}"], moment)
            for ij, moment in zip(LINK_NAMES, moments_of.T, strict=True)
        ]
        curves += links
        spans = (span,) if span.upper else ()
        for i, pair in enumerate(PAIRS):
            two = links[2 * i : 2 * i + 2]
            panels.append(Panel.of(f"{pair}, {what}", *two, spans=spans))
    return Chart(
        Axis("time", "s", "s"),
        time,
        tuple(curves),
        marks=peaks_of(curves, time),
        panels=tuple(panels),
    )


def combinations(_: Array, settings: Settings) -> Listing:
    """Return natural frequencies and free speeds of the nominal drives."""
    each = settings.every_combination
    omega = np.concatenate([nominal(one).modes.omega for one in each])
    free = [free_speeds(w[None], one) for w, one in zip(omega, each, strict=True)]
    total, widest = np.array(free)[:, :, 0].T
    rolling = settings.working_speed * np.array([rolling_speeds(one) for one in each]).T
    return Listing.of(
        "positions of the stages A, B, C, D; motor speed over roll speed",
        *_named(each),
        *((f"f{r}", "Hz", "Hz", w / (2 * np.pi)) for r, w in enumerate(omega.T, 1)),
        ("free speeds", "rad/s", "rpm", total),
        ("widest", "rad/s", "rpm", widest),
        ("condition f8/f1", "1", "1", omega[:, -1] / omega[:, 0]),
        *((f"v{s}", "m/s", "m/s", v) for s, v in zip(STANDS, rolling, strict=True)),
        ("limit of v34", "rad/s", "rpm", np.array([fastest(one) for one in each])),
    )


def gearbox(_: Array, settings: Settings) -> Listing:
    """Return ratios, and inertias and stiffnesses of the nominal drives."""
    each = settings.every_combination
    built = [nominal(one) for one in each]
    Q, C = (np.concatenate([one[i] for one in built]) for i in range(2))
    return Listing.of(
        "positions of the stages A, B, C, D; all reduced to the motor shaft",
        *_named(each),
        ("sum of Q", "kg m^2", "kg m^2", Q.sum(axis=1)),
        *((f"Q{i}", "kg m^2", "kg m^2", q) for i, q in enumerate(Q.T, start=1)),
        *(
            (f"C{ij}", "N m/rad", "kN m/rad", c)
            for ij, c in zip(LINK_NAMES, C.T, strict=True)
        ),
    )


def _named(
    each: list[Settings],
) -> tuple[tuple[str, str, str, NDArray[np.generic]], ...]:
    """Return the name of each combination, with its ratios of motor to roll."""
    return (
        ("combination", "1", "", np.array([one.name for one in each])),
        ("i31", "1", "1", np.array([one.ratios.i31 for one in each])),
        ("i34", "1", "1", np.array([one.ratios.i34 for one in each])),
    )


def shapes(deviations: Array, settings: Settings) -> Chart:
    """Return the shapes over the mass number, as points: the drive branches."""
    modes = drives(deviations, settings).modes
    first = unit_shapes(modes.phi[0])
    others = modes.phi[1:]
    if len(others):
        _, others = tracked(others, first)
    curves, panels = [], []
    spreads: list[Band] = []
    for r, hz in enumerate(modes.omega[0] / (2 * np.pi)):
        name, words = f"mode {r + 1}", f"{hz:.3f} Hz"
        curve = Curve(name, "1", f"phi{r + 1}", words, first[:, r], points=True)
        opened = bands_of(name, "1", others[:, :, r])
        curves.append(curve)
        spreads += opened
        panels.append(
            Panel.of(f"{hz:.2f} Hz", curve, *opened, levels=(Level(0.0, ""),))
        )
    return Chart(
        Axis("mass", "1", "1"),
        np.arange(1.0, len(first) + 1),
        tuple(curves),
        bands=tuple(spreads),
        panels=tuple(panels),
    )


def pulses(deviations: Array, settings: Settings) -> Chart:
    """Return the moments of all links after the pulse, and of one after others."""
    drive = drives(deviations, settings)
    shown, length = settings.response_link, settings.pulse_length
    lowest = float(drive.modes.omega[0, 0])
    end = min(settings.horizon, PERIODS * 2 * np.pi / lowest)
    time = np.linspace(0.0, end, POINTS)
    load = {settings.pulse_stand: settings.pulse_moment}
    a = contributions(drive.modes, drive.C, load)
    one = LINK_NAMES.index(shown)

    def followed(those: slice, links: slice, *ends: float) -> Array:
        """Return moments of drives in links, under a load that ends, or never."""
        part = a[those, links]
        steps = [(0.0, part), *((end, -part) for end in ends)]
        return moments(time, drive.modes.omega[those], drive.zeta[those], steps)

    def curve(name: str, link: str, words: str, moment: Array) -> Curve:
        return Curve(name, "N m", f"M{link}", words, moment, shown="N m")

    first, every = slice(0, 1), slice(None)
    links = [
        curve(f"M{ij}", ij, "after the pulse", moment)
        for ij, moment in zip(
            LINK_NAMES, followed(first, every, length)[0], strict=True
        )
    ]
    words = "pulse of this length"
    others = [
        curve(f"{1e3 * each:g} ms", shown, words, followed(first, every, each)[0, one])
        for each in LENGTHS
    ]
    others.append(
        curve("step", shown, "load that stays", followed(first, every)[0, one])
    )
    spread = followed(slice(1, None), slice(one, one + 1), length)
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


OFFERS = (
    Offer("campbell", "frequencies and excitations over the speed", campbell, MANY),
    Offer("resonances", "speeds that resonate, and why", resonances, MANY),
    Offer("combinations", "frequencies and speeds of each", combinations),
    Offer("gearbox", "ratios, inertias and stiffnesses of all combinations", gearbox),
    Offer("response", "frequency response, input to output", frequency_response, SOME),
    Offer("damping", "frequencies and damping ratios, modal or by link", damping),
    Offer("poles", "poles and zeros of a moment over loads", poles),
    Offer("masses", "partial frequencies, and which masses may go", masses),
    Offer("shapes", "mode shapes", shapes, SOME),
    Offer("pulses", "moments after the pulse, and after others", pulses, SOME),
    Offer("travel", "peaks of a pulse that travels from stand to stand", travel),
    Offer("regulator", "stability under an assumed speed regulator", regulator),
    Offer("beats", "beats of pairs of modes", beats),
    Offer("torques", "spectrum of a moment under random rolling torques", torques),
    Offer("rms", "rms of the moments under random rolling torques", rms),
)
