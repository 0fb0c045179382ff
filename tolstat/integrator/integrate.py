"""Interface of the integrator: the solution of equations for a block of trials."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tolstat.arrays import Array
from tolstat.integrator.mistakes import check_block, check_equations
from tolstat.integrator.problem import (
    CLOCK_ROWS,
    MOMENT_ROWS,
    PHASE,
    TRIAL,
    Accuracy,
    Block,
    Lanes,
    Results,
    Solution,
    Step,
    System,
)
from tolstat.status import Status


class Integration(NamedTuple):
    """What a model asked of the integrator, and what it got."""

    system: System
    block: Block
    solution: Solution

    @property
    def failure(self) -> str:
        """Where its first failed trial ended, and by which state; else empty."""
        failed = np.flatnonzero(self.solution.status != Status.DONE)
        if not len(failed):
            return ""
        time, state = self.solution.ended[failed[0]]
        if np.isnan(time):  # it reached the end, but a result is not finite
            return ""
        count = len(self.system.scale)
        return f"ended at {time:.6g} s by the error of state {state + 1:.0f} of {count}"


class _Observer(NamedTuple):
    integrations: list[Integration]
    surveys: bool


_observer: ContextVar[_Observer | None] = ContextVar("_observer", default=None)


@contextmanager
def observed(*, surveyed: bool = False) -> Iterator[list[Integration]]:
    """Collect the integrations of this thread, for an examination.

    `surveyed`: their solutions have a survey of their steps.
    """
    observer = _Observer([], surveyed)
    token = _observer.set(observer)
    try:
        yield observer.integrations
    finally:
        _observer.reset(token)


def integrate(
    system: System,
    start: Array,
    parameters: Array,
    marks: Array,
    accuracy: Accuracy,
    *,
    watch_from: int = 0,
    samples: Array | None = None,
) -> Solution:
    """Return the solution of a block of trials.

    Parameters
    ----------
    system : System
        The equations.
    start : float64[trial, state]
        The states at the first mark.
    parameters : float64[trial, parameter] or float64[trial, phase, parameter]
        Argument `p` of the equations; it may change at each mark.
    marks : float64[trial, mark]
        Ascending times, s: the start, times at which the rates may jump or states are
        stored, the end. The step lands on each and restarts there.
    accuracy : Accuracy
        Tolerance and limits of the steps.
    watch_from : int
        The phase (number of the mark that begins it) from which peaks and times above
        zero are taken.
    samples : float64[sample], optional
        Ascending times, s, at which the states are stored, by dense output.

    Raises
    ------
    ModelError
        If the numbers of trials, states or rows do not fit together, times do not
        ascend, a tolerance is not above zero, the equations read states or parameters
        that are not given, or `watch` differs from the rates. See `mistakes`.

    Returns
    -------
    Solution
        By trial: states and quadratures at the marks, peaks, histories, status, steps.
        NaN where a failed trial did not arrive.
    """
    # the first integration loads the compiler, and compiles
    from tolstat.integrator.march import march

    rtol, max_step, max_steps = accuracy
    block = Block(
        start=_writeable(start),
        parameters=_by_phase(parameters),
        marks=_writeable(marks),
        samples=_writeable([] if samples is None else samples),
        watch_from=int(watch_from),
        accuracy=Accuracy(float(rtol), float(max_step), int(max_steps)),
        jumps_at_marks=int(system.jumps_at_marks),
        ends=np.array(system.ends, np.int64),
        sizes=_writeable(system.sizes),
    )
    check_block(system, block)
    check_equations(system, block)
    observer = _observer.get()
    surveyed = observer is not None and observer.surveys
    results, solution = _unsolved(system, block, surveyed)
    lanes = _idle_lanes(system, block)
    march(
        system.rates,
        system.watch or system.rates,
        system.jump or system.rates,
        1.0 / np.ascontiguousarray(system.scale, float),
        lanes,
        _room_for_steps(system, lanes, surveyed),
        block,
        results,
    )
    if observer:
        observer.integrations.append(Integration(system, block, solution))
    return solution


def _writeable(numbers: ArrayLike) -> Array:
    """Return an array for compiled code: it takes no read-only one, as deviations."""
    return np.require(numbers, float, ["C", "W"])


def _by_phase(parameters: ArrayLike) -> Array:
    """Return parameters as float64[trial, phase, parameter]."""
    numbers = _writeable(parameters)
    return numbers[:, None, :] if numbers.ndim == 2 else numbers


def _unsolved(system: System, block: Block, surveyed: bool) -> tuple[Results, Solution]:
    """Return the results of a block to be filled, and the solution: views of them."""
    (n, n_states), n_extremes = block.start.shape, system.n_extremes

    def room(*shape: int) -> Array:
        return np.full((n, *shape), np.nan)

    arrived = room(block.marks.shape[1], n_states + system.n_quadratures)
    watched = room(2 * n_extremes + system.n_above)
    both: dict[str, Any] = {
        "history": room(len(block.samples), n_states),
        "status": np.full(n, Status.NOT_RUN.value),
        "steps": np.zeros(n, np.int64),
        "ended": room(2),
        "survey": np.zeros((n, arrived.shape[2] if surveyed else 0, 3)),
    }
    solution = Solution(
        states=arrived[:, :, :n_states],
        quadratures=arrived[:, :, n_states:],
        greatest=watched[:, :n_extremes],
        least=watched[:, n_extremes : 2 * n_extremes],
        above=watched[:, 2 * n_extremes :],
        **both,
    )
    return Results(arrived=arrived, watched=watched, **both), solution


def _idle_lanes(system: System, block: Block) -> Lanes:
    counts = {
        "clock": CLOCK_ROWS,
        "y": block.start.shape[1],
        "quadratures": system.n_quadratures,
        "greatest": system.n_extremes,
        "least": system.n_extremes,
        "above": system.n_above,
        "side": len(system.crossings),
        "size": len(system.crossings),
        "returned": len(system.crossings),
    }
    end = dict(zip(counts, np.cumsum([*counts.values()]).tolist(), strict=True))
    all_rows = _lanes(end["returned"])
    all_rows[[PHASE, TRIAL]] = -1.0
    return Lanes(
        **{name: all_rows[end[name] - n : end[name]] for name, n in counts.items()},
        p=_lanes(block.parameters.shape[2]),
        all_rows=all_rows,
        arrived=all_rows[end["clock"] : end["quadratures"]],
        watched=all_rows[end["quadratures"] : end["above"]],
    )


def _room_for_steps(system: System, lanes: Lanes, surveyed: bool) -> Step:
    n_states, n_damped = len(lanes.y), len(system.damped)
    n_slopes = n_damped * len(system.sloped)
    n_rates = n_states + system.n_quadratures
    # without `watch`, the watched quantities are among the rates
    first = 0 if system.watch else n_rates
    watched = slice(first, first + system.n_watched)
    spare = 0 if system.watch else n_damped + n_slopes
    middle, inside = (_lanes(watched.stop + spare) for _ in range(2))
    n_rows = n_rates + system.n_watched + 2 * n_damped + n_slopes
    return Step(
        moment=_lanes(MOMENT_ROWS + len(system.crossings)),
        k=_lanes(7, n_rows),
        middle=_lanes(n_states),
        end=_lanes(n_states),
        filled_middle=middle,
        filled_inside=inside,
        watched_middle=middle[watched],
        watched_inside=inside[watched],
        theta=_lanes(len(system.crossings)),
        jumped=_lanes(n_states + len(system.crossings) if system.jump else 0),
        surveyed=_lanes(n_rows + 1 if surveyed else 0),
        slope=_lanes(n_slopes),
        lambda_h=_lanes(n_damped),
        share=_lanes(n_damped),
        crossings=np.array(system.crossings, np.int64),
        damped=np.array(system.damped, np.int64),
        sloped=np.array(system.sloped, np.int64),
    )


def _lanes(*rows: int) -> Array:
    from tolstat.lanes.vector import WIDTH  # loads the compiler

    return np.zeros((*rows, WIDTH))
