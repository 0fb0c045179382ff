"""What the integrator is given, what it holds, what it finds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.integrator.clock import CLOCK_ROWS, MOMENT_ROWS
from tolstat.integrator.damping import Damping
from tolstat.lanes.vector import WIDTH

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

    @classmethod
    def idle(cls, block: Block, solution: Solution) -> Lanes:
        """Make lanes of which none has a trial."""
        n_extremes = solution.greatest.shape[1]
        return cls(
            clock=_lanes(CLOCK_ROWS),
            y=_lanes(block.start.shape[1]),
            p=_lanes(block.parameters.shape[1]),
            quadratures=_lanes(solution.quadratures.shape[2]),
            greatest=_lanes(n_extremes),
            least=_lanes(n_extremes),
            above=_lanes(solution.above.shape[1]),
            trial=np.full(WIDTH, -1),
            sample=np.zeros(WIDTH, np.int64),
        )


class Step(NamedTuple):
    """The step that is tried, in all lanes at once."""

    moment: Array  # [row of `clock`, lane], which the rates are asked for
    k: Array  # [stage, rate, lane]
    middle: Array  # [state, lane]
    end: Array  # [state, lane]
    watched_middle: Array  # [watched, lane]
    damping: Damping

    @classmethod
    def of(cls, lanes: Lanes, damped: tuple[int, ...]) -> Step:
        """Make room for the steps of some lanes; of their states some are damped."""
        n_states, n_damped = len(lanes.y), len(damped)
        n_watched = len(lanes.greatest) + len(lanes.above)
        return cls(
            moment=_lanes(MOMENT_ROWS),
            k=_lanes(7, n_states + len(lanes.quadratures) + n_watched + n_damped),
            middle=_lanes(n_states),
            end=_lanes(n_states),
            watched_middle=_lanes(n_watched),
            damping=Damping(
                np.array(damped, np.int64), *(_lanes(n_damped) for _ in range(4))
            ),
        )


def _lanes(*rows: int) -> Array:
    return np.zeros((*rows, WIDTH))
