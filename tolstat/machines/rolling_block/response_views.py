"""The frequency response between loads and a link: amplitude, phase, poles, zeros."""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.frequency_response import (
    contributions,
    poles_and_zeros,
    response,
)
from tolstat.machines.rolling_block.seen import Seen
from tolstat.machines.rolling_block.topology import LINK_NAMES
from tolstat.model.view import Axis, Band, Chart, Curve, Listing, Panel, bands_of

POINTS = 1200
BELOW, BEYOND = 0.2, 1.3  # of the lowest and the highest natural frequency: the axis


def _channels(seen: Seen) -> dict[str, Array]:
    """Return contributions [trial, mode] to the link, by words for what loads it.

    Each load by itself, then all of them at once, 1 N m each.
    """
    link = LINK_NAMES.index(seen.settings.response_link)
    loads = seen.settings.response_loads
    asked = [(load,) for load in loads] + ([loads] if len(loads) > 1 else [])
    words = {1: "motor"}
    return {
        " + ".join(words.get(load, str(load)) for load in those): contributions(
            seen.modes, seen.drive.C, dict.fromkeys(those, 1.0)
        )[:, link]
        for those in asked
    }


def frequency_response(seen: Seen) -> Chart:
    """Chart amplitude and phase of the moment in the link per moment of the load."""
    omega = seen.modes.omega[0] / (2 * np.pi)
    even = np.geomspace(BELOW * omega[0], BEYOND * omega[-1], POINTS)
    # the peaks themselves among the points, where they are finite
    damped = seen.drive.zeta[0] > 0
    frequency = np.unique(np.concatenate([even, omega])) if damped else even
    link = seen.settings.response_link
    amplitudes, phases = [], []
    spreads: tuple[Band, ...] = ()
    for words, a in _channels(seen).items():
        G = response(frequency, seen.modes, a, seen.drive.zeta)
        amplitudes.append(
            Curve(words, "1", "|G|", f"M{link} over the load", np.abs(G[0]), shown="1")
        )
        phases.append(
            Curve(f"phase, {words}", "rad", "arg G", "", np.angle(G[0]), shown="deg")
        )
        spreads = bands_of(words, "1", np.abs(G[seen.others]))  # the last: all at once
    loads = "motor" if seen.settings.response_loads == (1,) else "loads"
    return Chart(
        Axis("frequency", "Hz", "Hz", logarithmic=True),
        frequency,
        (*amplitudes, *phases),
        bands=spreads,
        panels=(
            Panel(
                f"M{link} over {loads}: amplitude",
                (*(c.name for c in amplitudes), *(b.name for b in spreads)),
                logarithmic=True,
            ),
            Panel("Phase", tuple(each.name for each in phases)),
        ),
    )


def poles(seen: Seen) -> Listing:
    """List poles, zeros and modes that do not reach the link, without damping."""
    omega = seen.modes.omega[0]
    rows: list[tuple[str, str, float, float]] = []
    for words, a in _channels(seen).items():
        found = poles_and_zeros(omega, a[0])
        parts = dict(zip((omega / (2 * np.pi)).tolist(), a[0].tolist(), strict=True))
        of_load = [(f, "pole", parts[f]) for f in found.poles.tolist()]
        of_load += [(f, "does not reach", 0.0) for f in found.cancelled.tolist()]
        of_load += [(f, "zero", np.nan) for f in found.zeros.tolist()]
        rows += [(words, kind, f, part) for f, kind, part in sorted(of_load)]
    load, kind, frequency, part = map(np.array, zip(*rows, strict=True))
    return Listing(
        (
            Axis("load", "1"),
            Axis("what", "1"),
            Axis("frequency", "Hz", "Hz"),
            Axis("static part a_r", "1", "1"),
        ),
        (load, kind, frequency, part),
        f"where M{seen.settings.response_link} is infinite or zero, or is not reached",
    )
