"""What the rolling block can show, by name: histories, combinations, shapes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.machines.rolling_block.declarations import RESPONSES, Settings
from tolstat.machines.rolling_block.frequency_response import frequency_response, poles
from tolstat.machines.rolling_block.modes import modes_of, tracked, unit_shapes
from tolstat.machines.rolling_block.parameters import Seen, drives, nominal
from tolstat.machines.rolling_block.resonance import campbell, free_speeds, resonances
from tolstat.machines.rolling_block.structure import (
    COMBINATIONS,
    LINK_NAMES,
    STANDS,
    ratios,
)
from tolstat.machines.rolling_block.transient import pulses
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
    View,
    bands_of,
    peaks_of,
)

KINDS = ("moment_peak", "pulse_peak")
PAIRS = ("Motor side", "To C and D", "Spindles of C", "Spindles of D")
# drives with deviations, where a study gives tolerances: for shares, for bands
MANY, SOME = 2000, 300


def chart_of(time: Array, loaded: Array, pulsed: Array, settings: Settings) -> Chart:
    """Chart the moments, N m, [time, link]: loads stepping, and after the pulse.

    Returns
    -------
    Chart
        Curves have the names of the responses that are their peaks.
    """
    words = {response.name: response for response in RESPONSES}
    curves = [
        Curve.of(words[f"{kind}_{ij}"], moment)
        for kind, moments in zip(KINDS, (loaded, pulsed), strict=True)
        for ij, moment in zip(LINK_NAMES, moments.T, strict=True)
    ]
    ends = settings.entries[-1], min(settings.pulse_length, settings.horizon)
    stands = ", ".join(map(str, STANDS))
    shaded = (
        Span(0.0, ends[0], f"loads: stands {stands} enter"),
        Span(0.0, ends[1], "pulse: while it lasts"),
    )
    pairs = tuple(zip(LINK_NAMES[::2], LINK_NAMES[1::2], strict=True))
    panels = [
        Panel(
            f"{pair}, {what}",
            tuple(f"{kind}_{ij}" for ij in links),
            spans=(span,) if span.upper else (),
        )
        for kind, what, span in zip(KINDS, ("loads", "pulse"), shaded, strict=True)
        for pair, links in zip(PAIRS, pairs, strict=True)
    ]
    return Chart(
        Axis("time", "s", "s"),
        time,
        tuple(curves),
        marks=peaks_of(curves, time),
        panels=tuple(panels),
    )


def combinations(seen: Seen) -> Listing:
    """List natural frequencies and free speeds of the nominal drives."""
    each = [replace(seen.settings, combination=those) for those in COMBINATIONS]
    omega = np.stack([modes_of(*nominal(one)[:2]).omega[0] for one in each])
    free = [free_speeds(w[None], one) for w, one in zip(omega, each, strict=True)]
    total, widest = np.array(free)[:, :, 0].T
    return Listing.of(
        "positions of the stages A, B, C, D; motor speed over roll speed",
        *_named(),
        *((f"f{r}", "Hz", "Hz", w / (2 * np.pi)) for r, w in enumerate(omega.T, 1)),
        ("free speeds", "rad/s", "rpm", total),
        ("widest", "rad/s", "rpm", widest),
    )


def gearbox(seen: Seen) -> Listing:
    """List ratios, and inertias and stiffnesses of the nominal drives."""
    each = [
        nominal(replace(seen.settings, combination=those)) for those in COMBINATIONS
    ]
    Q, C = (np.concatenate([one[i] for one in each]) for i in range(2))
    return Listing.of(
        "positions of the stages A, B, C, D; all reduced to the motor shaft",
        *_named(),
        ("sum of Q", "kg m^2", "kg m^2", Q.sum(axis=1)),
        *((f"Q{i}", "kg m^2", "kg m^2", q) for i, q in enumerate(Q.T, start=1)),
        *(
            (f"C{ij}", "N m/rad", "kN m/rad", c)
            for ij, c in zip(LINK_NAMES, C.T, strict=True)
        ),
    )


def _named() -> tuple[tuple[str, str, str, NDArray[np.generic]], ...]:
    """Name each combination, with its ratios of motor to roll."""
    every = [ratios(each) for each in COMBINATIONS]
    names = [" ".join(map(str, each)) for each in COMBINATIONS]
    return (
        ("combination", "1", "", np.array(names)),
        ("i31", "1", "1", np.array([each.i31 for each in every])),
        ("i34", "1", "1", np.array([each.i34 for each in every])),
    )


def shapes(seen: Seen) -> Chart:
    """Chart the shapes over the number of the mass, as points: the drive branches."""
    first = unit_shapes(seen.modes.phi[0])
    others = np.empty((0, *first.shape))
    if len(seen.others):
        _, others = tracked(seen.modes.phi[seen.others], first)
    curves, panels = [], []
    spreads: list[Band] = []
    for r, hz in enumerate(seen.modes.omega[0] / (2 * np.pi)):
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


def _of_drives(show: Callable[[Seen], View]) -> Callable[[Array, Settings], View]:
    """Return what shows the first drive, with bands of the others that can exist."""

    def view(deviations: Array, settings: Settings) -> View:
        drive, exist = drives(deviations, settings)
        modes = modes_of(drive.Q, drive.C)
        others = np.flatnonzero(exist[1:]) + 1
        return show(Seen(drive, modes, others, settings))

    return view


OFFERS = (
    Offer(
        "campbell",
        "frequencies and excitations over the motor's speed",
        _of_drives(campbell),
        MANY,
    ),
    Offer(
        "resonances",
        "speeds at which excitations meet frequencies",
        _of_drives(resonances),
        MANY,
    ),
    Offer(
        "combinations",
        "frequencies and free speeds of the 128 combinations",
        _of_drives(combinations),
    ),
    Offer(
        "gearbox",
        "ratios, reduced inertias, stiffnesses of the 128 combinations",
        _of_drives(gearbox),
    ),
    Offer(
        "response",
        "frequency response, response_link to response_loads",
        _of_drives(frequency_response),
        SOME,
    ),
    Offer(
        "poles",
        "poles and zeros of these, modes that do not reach the link",
        _of_drives(poles),
    ),
    Offer("shapes", "mode shapes", _of_drives(shapes), SOME),
    Offer(
        "pulses", "moments after the pulse, and after others", _of_drives(pulses), SOME
    ),
)
