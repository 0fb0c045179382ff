"""A run recorded in memory, with the methods of `RunWriter`."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Self

import numpy as np

from tolstat.errors import TolstatError
from tolstat.model.contract import TrialResults
from tolstat.store.provenance import now
from tolstat.store.stored_run import Run


class MemoryRecorder:
    """A run being recorded in memory, at last to be `recorded`.

    Attributes
    ----------
    run : Run
        What is recorded: the run as it is before its first trial, or at its end.
    """

    def __init__(self, run: Run) -> None:
        self.run = run
        self._began = time.perf_counter()

    def __enter__(self) -> Self:
        """Return the recorder."""
        return self

    def __exit__(self, *_: object) -> None:
        """Leave what is recorded as it is."""

    def write_drawn(self, trials: slice) -> None:
        """Leave the deviations of trials sampled now in the columns of the run."""

    def write_nominal(self, outcome: TrialResults) -> None:
        """Record the nominal trial."""
        self.run = replace(self.run, nominal_results=outcome)

    def write_blocks(self, blocks: list[tuple[int, TrialResults]]) -> None:
        """Leave finished blocks in the columns of the run, which take them."""

    def failed(self, error: TolstatError) -> TolstatError:
        """Return the error: nothing of the run remains."""
        return error

    def write_again(self, run: Run, by: object) -> None:
        """Record the run: complete, or with rows for more trials."""
        self.run = run

    def recorded(self) -> Run:
        """Return the run with all that is recorded."""
        columns = {n: np.array(values) for n, values in self.run.columns.items()}
        seconds = time.perf_counter() - self._began
        times = {"ended_at": now(), "seconds": seconds}
        return replace(self.run, columns=columns, times=times)
