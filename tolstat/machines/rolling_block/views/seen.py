"""What a view is made of: the drive that is shown, and others for its bands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.drive import Drive
from tolstat.machines.rolling_block.modes import Modes
from tolstat.machines.rolling_block.settings import Settings
from tolstat.model.view import Band

Array = NDArray[np.float64]

LOWER, UPPER = 0.05, 0.95  # of the machines, between which bands lie
BAND_WORDS = "5..95 %"


class Seen(NamedTuple):
    """Drives; the first is shown, bands are of `others`."""

    drive: Drive
    modes: Modes
    others: NDArray[np.intp]
    settings: Settings


def bands(name: str, unit: str, values: Array) -> tuple[Band, ...]:
    """Return the band that machines open; none where there are no machines.

    Parameters
    ----------
    name, unit : str
        Of the curve that has the band.
    values : float64[machine, point]
        SI.
    """
    if not len(values):
        return ()
    lower, upper = np.quantile(values, (LOWER, UPPER), axis=0)
    return (Band(f"{name}, {BAND_WORDS}", unit, lower, upper, of=name),)
