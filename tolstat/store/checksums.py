"""Checksums of trials and of the clock of a run.

A checksum has 64 bits, over all that is stored of a trial.
"""

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array

ODD = np.uint64(0x9E3779B97F4A7C15)  # 2**64 over the golden ratio
HALF = np.uint64(32)
AT_ONCE = 8192  # rows, so that the data stay in the processor's cache
EXACT = np.uint64(12)  # bits of a checksum that a float64 has no room for
NAMED = 20  # ranges of trials that are listed


def fingerprints(columns: Sequence[NDArray[Any]], first: int = 0) -> NDArray[np.uint64]:
    """Return a checksum of all that is stored of each trial, uint64[trial].

    Every step maps 64 bits one to one, so a change of one value always changes the
    checksum. It includes the number of the trial, so swapped rows are found too.
    Columns are numbers or fixed-length texts. A checksum is never 0, which stands for
    a trial without one.
    """
    rows = len(columns[0])
    words = [word for column in columns for word in _words(column)]
    checksums = np.empty(rows, np.uint64)
    for start in range(0, rows, AT_ONCE):
        part = slice(start, min(start + AT_ONCE, rows))
        mixed = np.arange(first + part.start, first + part.stop, dtype=np.uint64) * ODD
        for word in words:
            mixed = (mixed ^ word[part].astype(np.uint64)) * ODD
            mixed ^= mixed >> HALF
        checksums[part] = np.where(mixed == 0, ODD, mixed)
    return checksums


def _words(column: NDArray[Any]) -> list[NDArray[Any]]:
    """Return a column as unsigned integers; a text as several."""
    column = np.ascontiguousarray(column)
    if column.dtype.kind == "S":
        return list(column.view(np.uint8).reshape(len(column), -1).T)
    return [column.view(f"u{column.dtype.itemsize}")]


def clock_of(seconds: float) -> Array:
    """Return the clock of a run that took so many seconds until now: float64[3]."""
    return _checked(seconds, time.time())


def seconds_of(clock: NDArray[Any]) -> float:
    """Return how long a run took, s; NaN if the clock is empty or damaged."""
    return float(clock[0]) if is_whole(clock) else math.nan


def written_at(clock: NDArray[Any]) -> str:
    """Return when a run was last written, with its zone; empty where unknown."""
    if not is_whole(clock):
        return ""
    return datetime.fromtimestamp(clock[1]).astimezone().isoformat(timespec="seconds")


def is_whole(clock: NDArray[Any]) -> bool:
    """Return whether a clock is undamaged."""
    return clock.tobytes() == _checked(clock[0], clock[1]).tobytes()


def _checked(seconds: float, written: float) -> Array:
    checksum = fingerprints([np.array([seconds]), np.array([written])])[0]
    return np.array([seconds, written, float(checksum >> EXACT)])


@dataclass(frozen=True)
class Damage:
    """Parts of a run that have changed since they were written."""

    # int64[n]: Numbers of the trials, ascending
    trials: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    nominal: bool = False  # whether the nominal trial is damaged
    clock: bool = False  # whether the duration of the run is

    def __bool__(self) -> bool:
        """Return whether there is any damage."""
        return bool(len(self.trials)) or self.nominal or self.clock

    @property
    def words(self) -> str:
        """What is damaged, every trial by its number."""
        parts = [f"trials {ranges_of(self.trials)}"] if len(self.trials) else []
        parts += ["the nominal trial"] if self.nominal else []
        parts += ["the duration of the run"] if self.clock else []
        return ", ".join(parts)


def ranges_of(trials: Iterable[int]) -> str:
    """Return numbers of trials as text: "3, 17-20"."""
    ranges: list[list[int]] = []
    for trial in map(int, trials):
        if ranges and trial == ranges[-1][1] + 1:
            ranges[-1][1] = trial
        else:
            ranges.append([trial, trial])
    words = [f"{a}" if a == b else f"{a}-{b}" for a, b in ranges[:NAMED]]
    if len(ranges) > NAMED:
        words.append(f"and {len(ranges) - NAMED} more ranges")
    return ", ".join(words)
