"""Trials evaluated again, and why these."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntFlag
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Reason(IntFlag):
    """Why a response had a trial evaluated again; there may be several reasons."""

    NEAR = 1  # next to an end of its limit, or so near that an error may cross it
    WORST = 2  # nearest to the limit from within, or farthest beyond
    SPREAD = 4  # one of those spread over its range, the least and the largest included


@dataclass(frozen=True)
class Audited:
    """Trials that were evaluated again, more precisely.

    Attributes
    ----------
    trials : int64[n]
        Their numbers, ascending.
    settings : dict of str to float
        What was tightened, and to what: rtol.
    status : uint8[n]
        How they ended then.
    responses : dict of str to float64[n]
        SI.
    at_random : bool[n]
        Whether a trial is the one of its hundred that was chosen at random: only these
        speak for the machines that were not evaluated again.
    chosen_by : dict of str to uint8[n]
        By response that chose trials on purpose: sums of `Reason`, 0 for none.
    """

    trials: NDArray[np.int64]
    settings: Mapping[str, float]
    status: NDArray[np.uint8]
    responses: Mapping[str, NDArray[np.float64]]
    at_random: NDArray[np.bool_]
    chosen_by: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)


def joined(one: Audited, other: Audited) -> Audited:
    """Put other trials, evaluated with the same settings, among those of one."""
    trials = np.concatenate([one.trials, other.trials])
    order = np.argsort(trials)
    return Audited(
        trials[order],
        one.settings,
        np.concatenate([one.status, other.status])[order],
        _together(one.responses, other.responses, order),
        np.concatenate([one.at_random, other.at_random])[order],
        _together(one.chosen_by, other.chosen_by, order),
    )


def _together(
    one: Mapping[str, NDArray[Any]],
    other: Mapping[str, NDArray[Any]],
    order: NDArray[np.int64],
) -> dict[str, NDArray[Any]]:
    return {name: np.concatenate([one[name], other[name]])[order] for name in one}
