"""What the integrator is given, what it holds, what it finds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Accuracy(NamedTuple):
    """How well to integrate.

    Attributes
    ----------
    rtol : float
        A step is accepted when no state's error estimate exceeds rtol times its scale.
    max_step : float
        The longest step, s.
    max_steps : int
        A trial that needs more steps, rejected ones included, is given up.
    """

    rtol: float
    max_step: float
    max_steps: int = 20_000_000


class Block(NamedTuple):
    """What is asked: trials with their starts, parameters and marks."""

    start: Array  # [trial, state]
    parameters: Array  # [trial, parameter]
    marks: Array  # [trial, mark], s, ascending: start, switching times, ..., end
    samples: Array  # [sample], s, ascending
    watch_from: int  # phase from which peaks and times above zero are taken
    accuracy: Accuracy


class Solution(NamedTuple):
    """What comes out, by trial; NaN where a trial did not get."""

    states: Array  # [trial, mark, state]
    quadratures: Array  # [trial, mark, quadrature]
    greatest: Array  # [trial, extreme]
    least: Array  # [trial, extreme]
    above: Array  # [trial, quantity above zero], s
    history: Array  # [trial, sample, state]
    status: NDArray[np.int64]  # [trial], of `tolstat.status.Status`
    steps: NDArray[np.int64]  # [trial]


class Lanes(NamedTuple):
    """The trials under way, one in each lane."""

    clock: Array  # [row of `clock`, lane]
    y: Array  # [state, lane]
    p: Array  # [parameter, lane]
    quadratures: Array  # [quadrature, lane]
    greatest: Array  # [extreme, lane]
    least: Array  # [extreme, lane]
    above: Array  # [quantity above zero, lane], s
    trial: NDArray[np.int64]  # [lane]; -1: idle
    sample: NDArray[np.int64]  # [lane]: next sample to take


class Damping(NamedTuple):
    """What the damping of all stages of a step has in common."""

    states: NDArray[np.int64]  # [damped]
    lambda_h: Array  # [damped, lane], lambda times the step
    share: Array  # [damped, lane], 1/(1 + g h lambda)


class Step(NamedTuple):
    """The step that is tried, in all lanes at once."""

    moment: Array  # [row of `clock`, lane], which the rates are asked for
    k: Array  # [stage, rate, lane]; last the rates that the damped states had undamped
    middle: Array  # [state, lane]
    end: Array  # [state, lane]
    watched_middle: Array  # [watched, lane]
    watched_inside: Array  # [watched, lane], where a crossing is looked for
    crossings: NDArray[np.int64]  # [crossing], which of the watched quantities
    damping: Damping
