"""The integrator's face: a block of trials in, their marks, sums and peaks out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.integrator.trials import Found

Array = NDArray[np.float64]


@dataclass(frozen=True)
class System:
    """Equations of motion, compiled.

    Attributes
    ----------
    rates, watch : callable
        Compiled with `step.rates_signature`: (moment, y, p, out) -> None. `moment` has
        the rows time (s) and phase (number of marks passed since the start). `rates`
        fills all rows of `out`: the derivatives of the states, the rates of the
        quadratures, the quantities whose peaks are watched, those whose time above
        zero is. `watch` fills the watched ones alone, from row 0.
    scale : float64[state]
        The size that each state's error is measured by.
    n_quadratures, n_extremes, n_above : int
        Numbers of those rows.
    """

    rates: Callable[..., None]
    watch: Callable[..., None]
    scale: Array
    n_quadratures: int = 0
    n_extremes: int = 0
    n_above: int = 0


@dataclass(frozen=True)
class Accuracy:
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


def integrate(
    system: System,
    start: Array,
    parameters: Array,
    marks: Array,
    accuracy: Accuracy,
    *,
    watch_from: int = 0,
    samples: Array | None = None,
) -> Found:
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
    Found
        By trial: states and quadratures at the marks, peaks, histories, status, steps.
        What a failed trial did not reach is NaN.
    """
    # the compiler is loaded, and compiles, when something is first integrated
    from tolstat.integrator.march import march

    n, n_marks = marks.shape
    samples = np.empty(0) if samples is None else np.ascontiguousarray(samples, float)
    found = Found(
        states=np.full((n, n_marks, start.shape[1]), np.nan),
        quadratures=np.full((n, n_marks, system.n_quadratures), np.nan),
        greatest=np.full((n, system.n_extremes), np.nan),
        least=np.full((n, system.n_extremes), np.nan),
        above=np.full((n, system.n_above), np.nan),
        history=np.full((n, len(samples), start.shape[1]), np.nan),
        status=np.zeros(n, dtype=np.int64),
        steps=np.zeros(n, dtype=np.int64),
    )
    limits = np.array([accuracy.rtol, accuracy.max_step, float(accuracy.max_steps)])
    arguments: tuple[Any, ...] = (
        np.ascontiguousarray(start, float),
        np.ascontiguousarray(parameters, float),
        np.ascontiguousarray(marks, float),
        samples,
        watch_from,
        np.ascontiguousarray(system.scale, float),
        limits,
    )
    march(system.rates, system.watch, *arguments, *found)
    return found
