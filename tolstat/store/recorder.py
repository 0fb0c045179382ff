"""What takes the trials of a run while they are carried out; here, into memory."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import TolstatError
from tolstat.model.contract import Answers
from tolstat.store.plan import STATUS, STEPS
from tolstat.store.provenance import now
from tolstat.store.stored_run import Run

Blocks = list[tuple[int, Answers]]


class Recorder(ABC):
    """What a run is recorded with: its rows, then its end.

    Attributes
    ----------
    path : Path
        The file, or what stands for it.
    run : Run
        What is recorded: the run as it is before its first trial, or at its end.
    """

    path: Path
    run: Run

    def __enter__(self) -> Self:
        """Return the recorder."""
        return self

    @abstractmethod
    def __exit__(self, *_: object) -> None:
        """End the recording."""

    @abstractmethod
    def write_drawn(self, trials: slice) -> None:
        """Record the deviations of trials sampled now, before they run."""

    @abstractmethod
    def write_nominal(self, outcome: Answers) -> None:
        """Record the nominal trial."""

    @abstractmethod
    def write_blocks(self, blocks: Blocks) -> None:
        """Record finished blocks."""

    @abstractmethod
    def failed(self, error: TolstatError) -> TolstatError:
        """Return the error of a run that failed, with how much of it is recorded."""

    @abstractmethod
    def finish(self, run: Run) -> None:
        """Record the complete run."""

    def _filled(self, outcome: Answers) -> dict[str, NDArray[Any]]:
        """Return the columns that trials fill."""
        names = [response.name for response in self.run.responses]
        columns: dict[str, NDArray[Any]]
        columns = dict(zip(names, outcome.responses.T, strict=True))
        columns[STATUS] = outcome.status.astype(np.uint8)
        if outcome.steps is not None:
            columns[STEPS] = outcome.steps
        return columns


class MemoryRecorder(Recorder):
    """A run that is recorded in memory."""

    def __init__(self, run: Run) -> None:
        self.path, self.run = run.path, run
        self._columns = {name: np.array(column) for name, column in run.columns.items()}
        self._began = time.perf_counter()

    def write_drawn(self, trials: slice) -> None:
        """Record the deviations of trials sampled now, before they run."""
        for name in self.run.input_names:
            self._columns[name][trials] = self.run.columns[name][trials]

    def write_nominal(self, outcome: Answers) -> None:
        """Record the nominal trial."""
        self.run = replace(self.run, nominal_answers=outcome)

    def write_blocks(self, blocks: Blocks) -> None:
        """Record finished blocks."""
        for first, outcome in blocks:
            for name, values in self._filled(outcome).items():
                self._columns[name][first : first + len(values)] = values

    def failed(self, error: TolstatError) -> TolstatError:
        """Return the error: nothing of the run remains."""
        return error

    def finish(self, run: Run) -> None:
        """Record the complete run."""
        self.run = run

    def recorded(self) -> Run:
        """Return the run with all that is recorded."""
        columns = {n: v[: self.run.trials] for n, v in self._columns.items()}
        seconds = time.perf_counter() - self._began
        return replace(
            self.run,
            columns=columns,
            times={"ended_at": now(), "seconds": seconds},
        )

    def __exit__(self, *_: object) -> None:
        """Leave what is recorded as it is."""
