"""What of a run is not as it was written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.status import Status
from tolstat.store.fingerprint import fingerprints, is_whole
from tolstat.store.layout import (
    ALONE,
    CHECKSUM,
    CLOCK,
    STATUS,
    columns_of,
    nominal_columns_of,
)

NAMED = 20  # ranges of trials that are listed


@dataclass(frozen=True)
class Damage:
    """What is not as it was written."""

    # int64[n]: Numbers of the trials, ascending
    trials: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    nominal: bool = False  # whether the nominal machine is
    clock: bool = False  # whether the time that the run took is

    def __bool__(self) -> bool:
        """Tell whether there is any."""
        return bool(len(self.trials)) or self.nominal or self.clock

    @property
    def words(self) -> str:
        """What is damaged, every trial by its number."""
        parts = [f"trials {ranges_of(self.trials)}"] if len(self.trials) else []
        parts += ["the nominal machine"] if self.nominal else []
        parts += ["the time that the run took"] if self.clock else []
        return ", ".join(parts)


def ranges_of(trials: Iterable[int]) -> str:
    """Write numbers of trials: "3, 17-20"."""
    ranges: list[list[int]] = []
    for trial in map(int, trials):
        if ranges and trial == ranges[-1][1] + 1:
            ranges[-1][1] = trial
        else:
            ranges.append([trial, trial])
    words = [f"{a}" if a == b else f"{a}-{b}" for a, b in ranges[:NAMED]]
    left = len(ranges) - NAMED
    more = [f"and {left} more ranges"] if left > 0 else []
    return ", ".join(words + more)


def damage_of(
    file: h5py.File,
    columns: Mapping[str, NDArray[Any]],
    *,
    complete: bool,
) -> Damage:
    """Compare the checksums of a run with its columns, the status read first."""
    status = columns[STATUS]
    ran = status != Status.NOT_RUN
    stored = file[CHECKSUM][...]
    found = fingerprints([columns[name] for name in columns_of(file)])
    wrong = ran & (found != stored) if not complete else ~ran | (found != stored)
    checksum = file[ALONE][()]  # before what it is of: both may be written now
    alone = [np.atleast_1d(file[name][()]) for name in nominal_columns_of(file)]
    nominal = bool(checksum or complete) and fingerprints(alone)[0] != checksum
    # that of a run which is being written may be caught in between
    clock = complete and not is_whole(file[CLOCK][...])
    return Damage(np.flatnonzero(wrong), bool(nominal), clock)
