"""Blocks of trials on the workers of an executor."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.description import Model, Outcome
from tolstat.study.evaluate import simulate
from tolstat.study.points import Case

LOOK_AGAIN = 0.1  # s, between two looks at whether to stop
GRACE = 1.0  # s, for running blocks to end; a compilation does not
SUBMITTED = 3  # blocks for each worker, so that none waits for the writer


def finished_blocks(
    model: Model,
    cases: tuple[Case, ...],
    deviations: NDArray[np.float64],
    executor: Executor,
    *,
    workers: int,
    block: int,
    stopping: Callable[[], bool],
) -> Iterator[list[tuple[int, Outcome]]]:
    """Run all trials in blocks and yield what is finished, as it comes.

    Parameters
    ----------
    model : Model
        The machine.
    cases : tuple of Case
        Its settings.
    deviations : float64[trial, contributor]
        SI.
    executor : concurrent.futures.Executor
        Runs the blocks; the results do not depend on which.
    workers, block : int
        How many blocks run at once, and how many trials a block has.
    stopping : callable
        Asked ten times a second; once true, no further block begins, and a running
        one that does not end in a second is left.

    Yields
    ------
    list of (int, Outcome)
        Blocks with the number of their first trial.
    """
    stopped = False
    starts = _starts(cases, block)
    running: dict[Future[Outcome], int] = {}
    patience = math.inf
    try:
        while True:
            while not stopped and len(running) < SUBMITTED * workers:
                block_of = next(starts, None)
                if block_of is None:
                    break
                first, end, settings = block_of
                rows = deviations[first:end]
                future = executor.submit(simulate, model, rows, settings)
                running[future] = first
            if not running:
                return
            done, _ = wait(running, timeout=LOOK_AGAIN, return_when=FIRST_COMPLETED)
            if done:
                yield [(running.pop(future), future.result()) for future in done]
            if stopping() and not stopped:
                stopped = True
                patience = time.monotonic() + GRACE
                for future in list(running):
                    if future.cancel():
                        del running[future]
            if stopped and time.monotonic() > patience:
                return
    finally:
        for future in running:
            future.cancel()


def _starts(cases: tuple[Case, ...], block: int) -> Iterator[Case]:
    """Cut cases into blocks."""
    for case in cases:
        for first in range(case.first, case.stop, block):
            yield Case(first, min(first + block, case.stop), case.settings)


def block_size(trials: int, workers: int) -> int:
    """Choose how many trials a block has: long blocks keep lanes busy, short ones news.

    Parameters
    ----------
    trials, workers : int
        Of the run.

    Returns
    -------
    int
        Between 32 and 128; the results do not depend on it.
    """
    return min(128, max(32, trials // (4 * workers)))
