"""The integrator's face: equations and a block of trials in, their solution out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tolstat.errors import ModelError
from tolstat.integrator.trials import Accuracy, Array, Block, Solution


@dataclass(frozen=True)
class System:
    """Equations of motion, compiled.

    Attributes
    ----------
    rates, watch : callable
        Compiled with `signatures.rates_signature`: (moment, y, p, out) -> None, each
        float64[row, lane]. `moment` has the rows time (s) and phase (number of the
        last mark passed, from 0). `rates` fills all rows of `out`: the derivatives of
        the states, the rates of the quadratures, the quantities whose peaks are
        watched, those whose time above zero is, the lambda (1/s) of each damped state.
        `watch` fills the watched ones alone, from row 0.
    scale : float64[state]
        The size that each state's error is measured by.
    n_quadratures, n_extremes, n_above : int
        Numbers of those rows.
    damped : tuple of int
        The states that relax so fast that they alone would shorten the step: they are
        damped in it. lambda is minus the derivative of a state's rate by the state
        itself; one that is ten times too great gives wrong answers, see `damping`.
    crossings : tuple of int
        Which of the watched quantities, extremes first, are kinks of the rates where
        they change their sign: a step ends there, see `crossing`.

    Raises
    ------
    ModelError
        If what is damped is no state, what crosses is not watched, or either is named
        twice. `integrate` raises it where the equations fill other rows than are
        declared here.
    """

    rates: Callable[..., None]
    watch: Callable[..., None]
    scale: Array
    n_quadratures: int = 0
    n_extremes: int = 0
    n_above: int = 0
    damped: tuple[int, ...] = ()
    crossings: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what would be read beside the states, or beside what is watched."""
        for name, given, n, words in (
            ("damped", self.damped, len(self.scale), "states"),
            (
                "crossings",
                self.crossings,
                self.n_extremes + self.n_above,
                "watched quantities",
            ),
        ):
            numbers = given if isinstance(given, tuple) else ("",)
            if len(set(numbers) & set(range(n))) < len(numbers):
                allowed = f"0 to {n - 1}, each once" if n else "of which there are none"
                raise ModelError(
                    f"System({name}={given!r}): a tuple of numbers of {words}, "
                    f"{allowed}"
                )


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
    """Integrate a block of trials.

    Parameters
    ----------
    system : System
        The equations.
    start : float64[trial, state]
        The states at the first mark.
    parameters : float64[trial, parameter]
        What the equations get as `p`.
    marks : float64[trial, mark]
        Ascending times, s: the start, every time at which the rates may jump or
        something is to be stored, the end. The step lands on each and restarts there.
    accuracy : Accuracy
        How well.
    watch_from : int
        The phase (number of the mark that begins it) from which peaks and times above
        zero are taken.
    samples : float64[sample], optional
        Ascending times, s, at which the states are stored, by dense output.

    Returns
    -------
    Solution
        By trial: states and quadratures at the marks, peaks, histories, status, steps.
        What a failed trial did not reach is NaN.
    """
    # the compiler is loaded, and compiles, when something is first integrated
    from tolstat.integrator.march import march
    from tolstat.integrator.rooms import (
        check_rows,
        idle_lanes,
        room_for_steps,
        unsolved,
    )

    block = Block(
        start=np.ascontiguousarray(start, float),
        parameters=np.ascontiguousarray(parameters, float),
        marks=np.ascontiguousarray(marks, float),
        samples=np.ascontiguousarray([] if samples is None else samples, float),
        watch_from=int(watch_from),
        accuracy=Accuracy(
            rtol=float(accuracy.rtol),
            max_step=float(accuracy.max_step),
            max_steps=int(accuracy.max_steps),
        ),
    )
    solution = unsolved(system, block)
    lanes = idle_lanes(block, solution)
    step = room_for_steps(lanes, system.damped, system.crossings)
    check_rows(system, lanes, step)
    per_scale = 1.0 / np.ascontiguousarray(system.scale, float)
    march(system.rates, system.watch, per_scale, lanes, step, block, solution)
    return solution
