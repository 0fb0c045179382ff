"""What the integrator is given, what it holds, what it finds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Block(NamedTuple):
    """What is asked: trials with their starts, parameters and marks."""

    start: Array  # [trial, state]
    parameters: Array  # [trial, parameter]
    marks: Array  # [trial, mark], s, ascending: start, switching times, ..., end
    samples: Array  # [sample], s, ascending
    watch_from: int  # phase from which peaks and shares count
    max_step: float  # s


class Found(NamedTuple):
    """What comes out, by trial."""

    states: Array  # [trial, mark, state]
    quadratures: Array  # [trial, mark, quadrature]
    greatest: Array  # [trial, watched]
    least: Array  # [trial, watched]
    above: Array  # [trial, watched], s
    history: Array  # [trial, sample, state]
    status: NDArray[np.int64]  # [trial]
    steps: NDArray[np.int64]  # [trial]


class Lanes(NamedTuple):
    """The trials under way, one in each lane."""

    clock: Array  # [TIME ... EVENT, lane]
    y: Array  # [state, lane]
    p: Array  # [parameter, lane]
    sums: Array  # [quadrature, lane]
    greatest: Array  # [watched, lane]
    least: Array  # [watched, lane]
    above: Array  # [watched, lane]
    k: Array  # [stage, rate, lane]
    trial: NDArray[np.int64]  # [lane]; -1: idle
    sample: NDArray[np.int64]  # [lane]: next sample to take
