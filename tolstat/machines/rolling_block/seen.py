"""What a view is made of: the drive that is shown, and others for its bands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import Modes
from tolstat.machines.rolling_block.parameters import Drive


class Seen(NamedTuple):
    """Drives; the first is shown, bands are of `others`."""

    drive: Drive
    modes: Modes
    others: NDArray[np.intp]
    settings: Settings
