"""Types of the integrator: its input, its state, its solution."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.errors import ModelError

# the clock of each lane, the state of its trial, has a row for each of these;
# the first two are also those of a moment, at which the rates are evaluated
TIME = 0  # s
PHASE = 1  # number of the last mark passed; -1 without a trial

STEP = 2  # s, to be tried next
ROOT = 3  # of the last accepted step, for `step.step_factor`
TARGET = 4  # s, the next mark
SMALLEST = 5  # s, a trial that needs shorter steps fails
COUNT = 6  # of steps tried
TRIED = 7  # s, the step tried last; kept if samples are taken
ACCEPTED = 8  # whether it was accepted: 1 or 0; kept with samples or a survey
ERROR = 9  # its error, 1 at the tolerance; kept at an event
EVENT = 10  # event: one of the four below
AFTER = 11  # s, the next step behind a targeted crossing; otherwise 0

JUMP = 12  # whether the state jumps at this event: 1 or 0
WORST = 13  # number of the state with the largest error; kept where a trial may fail
TRIAL = 14  # its number; -1: idle
SAMPLE = 15  # number of the next sample to take

MOMENT_ROWS = 2
CLOCK_ROWS = 16
SIDES = MOMENT_ROWS  # row of a moment with the side of the first crossing

NOTHING = 0.0
MARK_REACHED = 1.0
FAILED = 2.0
CROSSED = 3.0
ENDED = 4.0  # by a crossing

TIGHTER, LEAST_RTOL = 1000.0, 1e-12  # of an audit: below, rounding decides
SHORTER = 4.0  # steps of an audit, as the tolerance alone makes them: 1000^(1/5)

KINKED = 100.0  # of rtol: above, rates bend or jump inside a step

TIME_ENDED, WORST_STATE = range(2)  # columns of `Solution.ended`
RESIDUAL, PLACE, SIZE = range(3)  # columns of `Solution.survey`


class Moment(NamedTuple):
    """Time and phase of the trial."""

    t: Array  # s
    phase: Array


@dataclass(frozen=True)
class System:
    """Equations of motion, compiled.

    Attributes
    ----------
    rates : callable
        Compiled with `signatures.rates_signature`: (moment, y, p, out) -> None, each
        float64[row, lane]. `moment` has the rows time (s), phase (number of the last
        mark passed, from 0), and from row `SIDES` the side of each crossing: 1, -1, or
        0 if the quantity is held at zero. All rows of `out` are filled: the derivatives
        of the states, the rates of the quadratures, the quantities whose peaks are
        watched, those whose time above zero is, the lambda (1/s) of each damped state.
    scale : float64[state]
        Size to which the error of each state is related.
    watch : callable, optional
        Fills only the watched quantities, from row 0: the same numbers, faster.
        Without it `rates` is evaluated.
    n_quadratures, n_extremes, n_above : int
        Numbers of those rows.
    damped : tuple of int
        States that are damped in the step, because they relax so fast that only they
        would shorten it. lambda is minus the derivative of a state's rate by the state;
        a lambda ten times too great gives wrong results, see `damping`.
    sloped : tuple of int
        Quadratures whose rates depend on damped states. After the lambdas `out` has,
        for each damped state and each of these, the slope of the rate over the state.
    crossings : tuple of int
        Watched quantities, counted with extremes first, whose change of sign is a kink
        or a jump of the rates: a step ends there, see `crossing`. A quantity depends on
        time, states, parameters and the sides of other crossings.
    jump : callable, optional
        Compiled as `rates`; fills `out` with the states and the sides behind a
        crossing, as after an impact. `moment` has the sides without it.
    jumps_at_marks : bool
        Whether the state also jumps at each mark, the start included.
    ends : tuple of int
        Crossings, counted in `crossings`, that end the trial where their quantity is
        below zero. The states there are those at all later marks.
    sizes : tuple of float
        The least size of each crossing's quantity, to which zero is related. Without
        them it is the largest value in the trial.

    Raises
    ------
    ModelError
        If a damped number is no state, a crossing is not watched, or one is given
        twice. `integrate` raises it if the equations fill other rows than declared
        here.
    """

    rates: Callable[..., None]
    scale: Array
    watch: Callable[..., None] | None = None
    n_quadratures: int = 0
    n_extremes: int = 0
    n_above: int = 0
    damped: tuple[int, ...] = ()
    sloped: tuple[int, ...] = ()
    crossings: tuple[int, ...] = ()
    jump: Callable[..., None] | None = None
    jumps_at_marks: bool = False
    ends: tuple[int, ...] = ()
    sizes: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse numbers outside the states or the watched quantities."""
        for name, declared, n, words in (
            ("damped", self.damped, len(self.scale), "states"),
            ("sloped", self.sloped, self.n_quadratures, "quadratures"),
            ("crossings", self.crossings, self.n_watched, "watched quantities"),
            ("ends", self.ends, len(self.crossings), "crossings"),
        ):
            numbers = declared if isinstance(declared, tuple) else ("",)
            if len(set(numbers) & set(range(n))) < len(numbers):
                allowed = f"0 to {n - 1}, each once" if n else "of which there are none"
                raise ModelError(
                    f"System({name}={declared!r}): a tuple of numbers of {words}, "
                    f"{allowed}"
                )

    @property
    def n_watched(self) -> int:
        """Number of the watched quantities."""
        return self.n_extremes + self.n_above


class Accuracy(NamedTuple):
    """Tolerance and limits of the steps.

    Attributes
    ----------
    rtol : float
        A step is accepted if no state's error estimate exceeds rtol times its scale.
    max_step : float
        The longest step, s.
    max_steps : int
        A trial that needs more steps, rejected ones included, fails.
    """

    rtol: float
    max_step: float
    max_steps: int = 20_000_000

    def tightened(self) -> "Accuracy":
        """Return the accuracy of an audit, with a thousandth of rtol."""
        rtol = min(self.rtol, max(self.rtol / TIGHTER, LEAST_RTOL))
        return self._replace(rtol=rtol, max_step=self.max_step / SHORTER)


class Block(NamedTuple):
    """Trials to be integrated, with their starts, parameters and marks."""

    start: Array  # [trial, state]
    parameters: Array  # [trial, phase, parameter]; one phase where all have the same
    marks: Array  # [trial, mark], s, ascending: start, switching times, ..., end
    samples: Array  # [sample], s, ascending
    watch_from: int  # phase from which peaks and times above zero are taken
    accuracy: Accuracy
    jumps_at_marks: int  # 1 or 0
    ends: Integers  # of `System.ends`
    sizes: Array  # [crossing], of `System.sizes`


class Solution(NamedTuple):
    """Results by trial; NaN where a trial did not arrive."""

    states: Array  # [trial, mark, state]
    quadratures: Array  # [trial, mark, quadrature]
    greatest: Array  # [trial, extreme]
    least: Array  # [trial, extreme]
    above: Array  # [trial, quantity above zero], s
    history: Array  # [trial, sample, state]
    status: Integers  # [trial], of `tolstat.status.Status`
    steps: Integers  # [trial]
    # [trial, 2], of a trial that failed: TIME_ENDED, s, and WORST_STATE, the number of
    # the state with the largest error; of one that a crossing ends its time alone
    ended: Array
    # [trial, state then quadrature, 3]: the largest RESIDUAL inside a step, see
    # `survey`, its PLACE, s, and the largest SIZE; no rows without a survey
    survey: Array

    @property
    def peak(self) -> Array:
        """The largest size of each extreme, float64[trial, extreme]."""
        return np.maximum(self.greatest, -self.least)


class Residual(NamedTuple):
    """The largest difference of rates and dense output, over step and scale."""

    of_rtol: float  # a tenth of it with damped states, see `largest_residual`
    time: float  # s
    row: int  # number of the state, from 0; behind them those of quadratures
    states: int

    @property
    def kinked(self) -> bool:
        """Whether rates bend or jump inside a step."""
        return self.of_rtol > KINKED

    @property
    def words(self) -> str:
        """What was seen, where, and what to do."""
        number = self.row + 1
        name = f"state {number} of {self.states}"
        if self.row >= self.states:
            name = f"quadrature {number - self.states}"
        return (
            f"The rates bend or jump inside steps: at {self.time:.6g} s, {name} is "
            f"at least {self.of_rtol:.2g} rtol off its rate. Give what bends or jumps "
            "there a crossing, or a mark."
        )


class Results(NamedTuple):
    """The solution as it is filled, by trial; NaN where a trial did not arrive."""

    arrived: Array  # [trial, mark, state then quadrature]
    watched: Array  # [trial, greatest then least then time above zero]
    history: Array  # [trial, sample, state]
    status: Integers  # [trial]
    steps: Integers  # [trial]
    ended: Array  # [trial, 2], with the columns TIME_ENDED and WORST_STATE
    survey: Array  # [trial, state then quadrature, 3]; no rows without a survey


class Lanes(NamedTuple):
    """The running trials, one in each lane."""

    clock: Array  # [row of the clock, lane]
    y: Array  # [state, lane]
    quadratures: Array  # [quadrature, lane]
    greatest: Array  # [extreme, lane]
    least: Array  # [extreme, lane]
    above: Array  # [quantity above zero, lane], s
    side: Array  # [crossing, lane]: 1, -1, or 0 if held at zero
    size: Array  # [crossing, lane], the largest of the quantity in this trial
    returned: Array  # [crossing, lane], see `crossing`
    p: Array  # [parameter, lane]
    all_rows: Array  # [row, lane], all of these in this order
    arrived: Array  # [state then quadrature, lane], of these rows
    watched: Array  # [greatest then least then above, lane], of these rows


class Step(NamedTuple):
    """The tried step, in all lanes at once."""

    moment: Array  # [time, phase, sides; lane], at which rates are evaluated
    k: Array  # [stage, rate, lane]; last the undamped rates of the damped states
    middle: Array  # [state, lane]
    end: Array  # [state, lane]
    filled_middle: Array  # [row, lane], filled by `watch` there
    filled_inside: Array  # [row, lane], the same where a crossing is searched
    watched_middle: Array  # [watched, lane], of these rows
    watched_inside: Array  # [watched, lane]
    theta: Array  # [crossing, lane], fraction of the step
    jumped: Array  # [state, then side; lane], filled by `jump`; no rows without it
    surveyed: Array  # [rate, then time; lane]; no rows without a survey
    slope: Array  # [damped times sloped, lane]
    lambda_h: Array  # [damped, lane], lambda times the step
    share: Array  # [damped, lane], 1/(1 + g h lambda)
    crossings: Integers  # [crossing], which of the watched quantities
    damped: Integers  # [damped], which states
    sloped: Integers  # [sloped], which quadratures
