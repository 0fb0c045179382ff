"""Room for what the march fills, and whether the equations keep to it."""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.integrator.lane_clock import CLOCK_ROWS, MOMENT_ROWS, PHASE
from tolstat.integrator.problem import (
    Block,
    Damping,
    Lanes,
    Solution,
    Step,
    System,
)
from tolstat.lanes.vector import WIDTH

UNWRITTEN = -8.765e300  # no equation says this
SPARE = 64  # rows behind those that are declared


def unsolved(system: System, block: Block) -> Solution:
    """Make room for what is to be found."""
    n, n_states = block.start.shape
    n_marks, n_samples = block.marks.shape[1], len(block.samples)
    return Solution(
        states=np.full((n, n_marks, n_states), np.nan),
        quadratures=np.full((n, n_marks, system.n_quadratures), np.nan),
        greatest=np.full((n, system.n_extremes), np.nan),
        least=np.full((n, system.n_extremes), np.nan),
        above=np.full((n, system.n_above), np.nan),
        history=np.full((n, n_samples, n_states), np.nan),
        status=np.zeros(n, dtype=np.int64),
        steps=np.zeros(n, dtype=np.int64),
    )


def idle_lanes(block: Block, solution: Solution) -> Lanes:
    """Make lanes of which none has a trial."""
    n_extremes = solution.greatest.shape[1]
    clock = _lanes(CLOCK_ROWS)
    clock[PHASE] = -1.0  # else lanes that never get a trial would run
    return Lanes(
        clock=clock,
        y=_lanes(block.start.shape[1]),
        p=_lanes(block.parameters.shape[1]),
        quadratures=_lanes(solution.quadratures.shape[2]),
        greatest=_lanes(n_extremes),
        least=_lanes(n_extremes),
        above=_lanes(solution.above.shape[1]),
        trial=np.full(WIDTH, -1),
        sample=np.zeros(WIDTH, np.int64),
    )


def room_for_steps(system: System, lanes: Lanes) -> Step:
    """Make room for the steps of some lanes."""
    n_states, n_damped = len(lanes.y), len(system.damped)
    n_rates = n_states + system.n_quadratures
    # where there is no `watch`, what is watched is among the rates
    first = 0 if system.watch else n_rates
    watched = slice(first, first + system.n_watched)
    spare = 0 if system.watch else n_damped
    middle, inside = (_lanes(watched.stop + spare) for _ in range(2))
    return Step(
        moment=_lanes(MOMENT_ROWS),
        k=_lanes(7, n_rates + system.n_watched + 2 * n_damped),
        middle=_lanes(n_states),
        end=_lanes(n_states),
        filled_middle=middle,
        filled_inside=inside,
        watched_middle=middle[watched],
        watched_inside=inside[watched],
        crossings=np.array(system.crossings, np.int64),
        damping=Damping(
            states=np.array(system.damped, np.int64),
            lambda_h=_lanes(n_damped),
            share=_lanes(n_damped),
        ),
    )


def check_rows(system: System, lanes: Lanes, step: Step) -> None:
    """Refuse equations that fill other rows than are declared.

    Compiled, they would write beside the stages and take Python down with them.
    """
    counts = {
        "states": len(lanes.y),
        "quadratures": system.n_quadratures,
        "extremes": system.n_extremes,
        "above": system.n_above,
        "damped": len(system.damped),
    }
    asked = [("rates", system.rates, counts)]
    if system.watch and system.n_watched:
        watched = {name: counts[name] for name in ("extremes", "above")}
        asked.append(("watch", system.watch, watched))
    for name, function, declared in asked:
        rows = sum(declared.values())
        out = np.full((rows + SPARE, WIDTH), UNWRITTEN)
        with np.errstate(all="ignore"):  # there is no machine in the lanes yet
            function(step.moment, lanes.y, lanes.p, out)
        filled = 1 + np.flatnonzero((out != UNWRITTEN).any(axis=1)).max(initial=-1)
        if filled != rows:
            words = ", ".join(f"{n} {each}" for each, n in declared.items() if n)
            raise ModelError(
                f"{name} fills {filled} rows, declared are {rows} ({words}); the "
                "counts of System and the rows of out belong together"
            )


def _lanes(*rows: int) -> Array:
    return np.zeros((*rows, WIDTH))
