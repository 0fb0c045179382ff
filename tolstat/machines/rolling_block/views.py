"""What the rolling block can show, by name; the mode shapes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block import (
    campbell,
    combinations,
    pulses,
    response_views,
)
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import modes_of, tracked, unit_shapes
from tolstat.machines.rolling_block.parameters import drives
from tolstat.machines.rolling_block.seen import Seen
from tolstat.model.view import (
    Axis,
    Band,
    Chart,
    Curve,
    Level,
    Offer,
    Panel,
    View,
    bands_of,
)

# drives with deviations, where a study gives tolerances: for shares, for bands
MANY, SOME = 2000, 300

OFFERS = (
    Offer("campbell", "frequencies and excitations over the motor's speed", MANY),
    Offer("resonances", "speeds at which excitations meet frequencies", MANY),
    Offer("combinations", "frequencies and free speeds of the 128 combinations"),
    Offer("gearbox", "ratios, reduced inertias, stiffnesses of the 128 combinations"),
    Offer("response", "frequency response, response_link to response_loads", SOME),
    Offer("poles", "poles and zeros of these, modes that do not reach the link"),
    Offer("shapes", "mode shapes", SOME),
    Offer("pulses", "moments after the pulse, and after others", SOME),
)


def mode_shapes(seen: Seen) -> Chart:
    """Chart the shapes over the number of the mass, as points: the drive branches."""
    first = unit_shapes(seen.modes.phi[0])
    hz = seen.modes.omega[0] / (2 * np.pi)
    others = np.empty((0, *first.shape))
    if len(seen.others):
        _, others = tracked(seen.modes.phi[seen.others], first)
    curves, panels = [], []
    spreads: list[Band] = []
    for r, frequency in enumerate(hz):
        name = f"mode {r + 1}"
        curves.append(
            Curve(
                name, "1", f"phi{r + 1}", f"{frequency:.3f} Hz", first[:, r],
                points=True,
            )
        )  # fmt: skip
        opened = bands_of(name, "1", others[:, :, r])
        spreads += opened
        names = (name, *(band.name for band in opened))
        panels.append(Panel(f"{frequency:.2f} Hz", names, levels=(Level(0.0, ""),)))
    return Chart(
        Axis("mass", "1", "1"),
        np.arange(1.0, len(first) + 1),
        tuple(curves),
        bands=tuple(spreads),
        panels=tuple(panels),
    )


SHOWN: dict[str, Callable[[Seen], View]] = {
    "campbell": campbell.campbell,
    "resonances": campbell.resonances,
    "combinations": combinations.frequencies,
    "gearbox": combinations.reduced,
    "response": response_views.frequency_response,
    "poles": response_views.poles,
    "shapes": mode_shapes,
    "pulses": pulses.pulses,
}


def shown(name: str, deviations: NDArray[np.float64], settings: Settings) -> View:
    """Show a view of the first drive, bands of the others that can exist."""
    drive, exist = drives(deviations, settings)
    modes = modes_of(drive.Q, drive.C)
    others = np.flatnonzero(exist[1:]) + 1
    return SHOWN[name](Seen(drive, modes, others, settings))
