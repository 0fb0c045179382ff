"""The views by name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import ModelError
from tolstat.machines.rolling_block.drive import CANNOT_EXIST, CONDITIONS, drives
from tolstat.machines.rolling_block.modes import modes_of
from tolstat.machines.rolling_block.settings import Settings
from tolstat.machines.rolling_block.views import (
    combinations,
    pulses,
    response,
    shapes,
    speeds,
)
from tolstat.machines.rolling_block.views.seen import Seen
from tolstat.model.view import Offer, View

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
SHOWN: dict[str, Callable[[Seen], View]] = {
    "campbell": speeds.campbell,
    "resonances": speeds.resonances,
    "combinations": combinations.frequencies,
    "gearbox": combinations.reduced,
    "response": response.frequency_response,
    "poles": response.poles,
    "shapes": shapes.mode_shapes,
    "pulses": pulses.pulses,
}


def shown(name: str, deviations: NDArray[np.float64], settings: Settings) -> View:
    """Show a view of the first drive, bands of the others that can exist.

    Parameters
    ----------
    name : str
        Of an offer.
    deviations : float64[machine, contributor]
        Relative.
    settings : Settings
        Of all of them.

    Raises
    ------
    ModelError
        If the first drive cannot exist.
    """
    drive, exist = drives(deviations, settings)
    if not exist[0]:
        raise ModelError(f"this drive {CANNOT_EXIST}: {CONDITIONS[CANNOT_EXIST]}")
    modes = modes_of(drive.Q, drive.C)
    others = np.flatnonzero(exist[1:]) + 1
    return SHOWN[name](Seen(drive, modes, others, settings))
