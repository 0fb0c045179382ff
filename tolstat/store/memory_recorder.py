"""A run recorded in memory, with the methods of `RunWriter`."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Self

import numpy as np

from tolstat.errors import TolstatError
from tolstat.model.contract import Answers
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
        self._columns = {name: np.array(column) for name, column in run.columns.items()}
        self._began = time.perf_counter()

    def __enter__(self) -> Self:
        """Return the recorder."""
        return self

    def __exit__(self, *_: object) -> None:
        """Leave what is recorded as it is."""

    def write_drawn(self, trials: slice) -> None:
        """Record the deviations of trials sampled now, before they run."""
        for name in self.run.input_names:
            self._columns[name][trials] = self.run.columns[name][trials]

    def write_nominal(self, outcome: Answers) -> None:
        """Record the nominal trial."""
        self.run = replace(self.run, nominal_answers=outcome)

    def write_blocks(self, blocks: list[tuple[int, Answers]]) -> None:
        """Record finished blocks: the first trial of each, and its answers."""
        for first, outcome in blocks:
            for name, values in self.run.columns_of(outcome).items():
                self._columns[name][first : first + len(values)] = values

    def failed(self, error: TolstatError) -> TolstatError:
        """Return the error: nothing of the run remains."""
        return error

    def write_again(self, run: Run, by: object) -> None:
        """Record the run: complete, or with rows for more trials."""
        for name, column in run.columns.items():
            rows = self._columns.get(name, column[:0])
            if len(column) > len(rows):
                longer = self._columns[name] = np.array(column)
                if name not in run.input_names:
                    longer[: len(rows)] = rows
        self.run = run

    def recorded(self) -> Run:
        """Return the run with all that is recorded."""
        columns = {n: v[: self.run.trials] for n, v in self._columns.items()}
        seconds = time.perf_counter() - self._began
        times = {"ended_at": now(), "seconds": seconds}
        return replace(self.run, columns=columns, times=times)
