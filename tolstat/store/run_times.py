"""How long a run took so far, and when it was last written."""

from __future__ import annotations

import math
import time
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.store.fingerprint import fingerprints

Clock = NDArray[np.float64]
EXACT = np.uint64(12)  # bits of a checksum that a float64 has no room for


def clock_of(seconds: float) -> Clock:
    """Return what is stored now of a run that took so many seconds: float64[3]."""
    return _checked(seconds, time.time())


def seconds_of(clock: NDArray[Any]) -> float:
    """Return how long a run took; NaN where nothing was written, or it is damaged."""
    return float(clock[0]) if is_whole(clock) else math.nan


def written_at(clock: NDArray[Any]) -> str:
    """Return when a run was last written, with its zone; empty where unknown."""
    if not is_whole(clock):
        return ""
    return datetime.fromtimestamp(clock[1]).astimezone().isoformat(timespec="seconds")


def is_whole(clock: NDArray[Any]) -> bool:
    """Tell whether a clock is as it was written."""
    return clock.tobytes() == _checked(clock[0], clock[1]).tobytes()


def _checked(seconds: float, at: float) -> Clock:
    values = [np.array([each]) for each in (seconds, at)]
    return np.array([seconds, at, float(fingerprints(values)[0] >> EXACT)])
