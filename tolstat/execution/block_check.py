"""Whether the answer of a trial depends on the other trials of its block."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Integers, Truths
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Workers
from tolstat.model.checked import impossible
from tolstat.model.contract import Answers
from tolstat.store.stored_run import ROUNDING
from tolstat.study.given_points import Case
from tolstat.study.study import Study

HANDFUL = 3  # trials of a run that are evaluated together and alone
LOOKED_AT = 64  # first trials, among which are some that can be built
ALONE = 8  # trials of a verification that are evaluated alone


def other_bits(one: NDArray[Any], other: NDArray[Any]) -> Truths:
    """Return which numbers differ in any bit; one NaN is like another."""
    bits = [np.ascontiguousarray(each).view(np.uint64) for each in (one, other)]
    return np.asarray((bits[0] != bits[1]) & ~(np.isnan(one) & np.isnan(other)))


def differing(one: Answers, other: Answers) -> Truths:
    """Return which trials have other answers, in any bit."""
    found = [one.status != other.status, *other_bits(one.responses, other.responses).T]
    if one.steps is not None and other.steps is not None:
        found.append(one.steps != other.steps)
    return np.asarray(np.any(found, axis=0))


def alone(cases: Iterable[Case]) -> list[Case]:
    """Return cases of one trial each, so that each is a block of its own."""
    each = [(case, at) for case in cases for at in range(case.first, case.stop)]
    return [case._replace(first=at, stop=at + 1) for case, at in each]


def spread_over(trials: Integers) -> Integers:
    """Return some trials, from the first to the last."""
    some = np.linspace(0, len(trials) - 1, min(ALONE, len(trials)), dtype=np.int64)
    return trials[some]


def check_rows(
    study: Study, trials: Trials, missing: Sequence[Case], workers: Workers
) -> None:
    """Evaluate some trials together and alone; refuse a model that tells them apart.

    Where only rounding differs, a warning says so.

    Raises
    ------
    ModelError
        If an answer depends on the other trials of the block.
    """
    model = study.model
    case = max(missing, key=lambda each: each.stop - each.first, default=None)
    if case is None:
        return
    looked_at = trials.deviations[case.first : min(case.stop, case.first + LOOKED_AT)]
    possible = np.flatnonzero(impossible(model, looked_at, case.settings) == 0)
    some = possible[:HANDFUL]
    if len(some) < 2:
        return
    block, rows = Case(0, len(some), case.settings), looked_at[some]
    together = workers.simulate_cases(model, [block], rows)
    apart = workers.simulate_cases(model, alone([block]), rows)
    other = np.flatnonzero(differing(together, apart))
    if not len(other):
        return
    one, two = together.responses, apart.responses
    size = np.abs(one).max(axis=0, initial=0.0, where=np.isfinite(one))
    rounding = np.abs(one - two) <= ROUNDING * size
    unlike = other_bits(one, two) & ~rounding
    trial = int(case.first + some[other[0]])
    if np.array_equal(together.status, apart.status) and not unlike.any():
        warnings.warn(
            f"model '{model.name}': the answer of trial {trial} is rounded differently "
            "in other blocks, so a resumed run differs in its last bits; write "
            "(a * b).sum(axis=1) instead of a @ b",
            RuntimeWarning,
            stacklevel=2,
        )
        return
    words = ""
    for row, column in np.argwhere(unlike)[:1].tolist():
        trial, name = int(case.first + some[row]), study.description.responses[column]
        values = f"{one[row, column]:.6g} in a block of {len(some)}, "
        words = f" ({name.name} = {values}{two[row, column]:.6g} alone)"
    raise model.fault(
        f"the answer of trial {trial} depends on the other trials of its block{words}; "
        "evaluate must compute each row of deviations by itself"
    )
