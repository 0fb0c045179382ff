"""A few hundred machines at once, on threads of this process."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.description import Model, Outcome
from tolstat.study.blocks import finished_blocks
from tolstat.study.points import Case

BLOCK = 16


def processors() -> int:
    """Count the processors that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def simulate_all(
    model: Model, deviations: NDArray[np.float64], settings: Any
) -> Outcome:
    """Simulate machines on all processors.

    Parameters
    ----------
    model : Model
        The machine.
    deviations : float64[trial, contributor]
        SI; at least one trial.
    settings : object
        Of all of them.

    Returns
    -------
    Outcome
        In the order of the trials; without their steps.
    """
    cases = (Case(0, len(deviations), settings),)
    workers = processors()
    with ThreadPoolExecutor(workers, thread_name_prefix="worker") as executor:
        found = [
            block
            for blocks in finished_blocks(
                model, cases, deviations, executor,
                workers=workers, block=BLOCK, stopping=lambda: False,
            )
            for block in blocks
        ]  # fmt: skip
    outcomes = [outcome for _, outcome in sorted(found, key=lambda block: block[0])]
    return Outcome(
        np.concatenate([each.responses for each in outcomes]),
        np.concatenate([each.status for each in outcomes]),
    )
