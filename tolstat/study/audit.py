"""A hundredth of the trials again, integrated much more precisely."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.streams import random_bits, unit_samples_of
from tolstat.study.points import Case

EVERY = 100  # trials of which one is integrated again
TIGHTER = 1000.0  # times smaller is rtol
LEAST_RTOL = 1e-12  # below which rounding decides


def audited_trials(seed: int, trials: int) -> NDArray[np.int64]:
    """Choose one trial at random of each hundred.

    Parameters
    ----------
    seed : int
        Of the study.
    trials : int
        Of the run.

    Returns
    -------
    int64[n]
        Ascending; asking for more trials leaves those of whole hundreds as they were.
    """
    first = np.arange(0, trials, EVERY)
    u = unit_samples_of(random_bits(seed, "audit", len(first)))
    found: NDArray[np.int64] = first + (u * np.minimum(EVERY, trials - first)).astype(
        np.int64
    )
    return found


def tightened(settings: Any) -> Any | None:
    """Return settings with rtol a thousand times smaller; None if there is no rtol."""
    rtol = getattr(settings, "rtol", None)
    if not isinstance(rtol, float):
        return None
    return dataclasses.replace(settings, rtol=max(rtol / TIGHTER, LEAST_RTOL))


def tightened_cases(
    cases: tuple[Case, ...], chosen: NDArray[np.int64]
) -> tuple[Case, ...]:
    """Return the cases of chosen trials, numbered among these, integrated tightly."""
    found = []
    for case in cases:
        first, stop = np.searchsorted(chosen, (case.first, case.stop)).tolist()
        if stop > first:
            found.append(Case(first, stop, tightened(case.settings)))
    return tuple(found)
