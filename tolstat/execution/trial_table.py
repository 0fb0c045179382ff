"""The trials of a run, in memory while it lasts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tolstat.model.contract import Answers
from tolstat.model.description import Description
from tolstat.status import Status
from tolstat.store.stored_run import Run

Array = NDArray[np.float64]


@dataclass
class Trials:
    """Deviations, and the answers so far."""

    description: Description  # names of the columns
    deviations: Array  # float64[trial, contributor], SI
    status: NDArray[np.uint8]  # uint8[trial]: 0 where a trial has not run
    responses: Array  # float64[trial, response], SI; NaN where there is none
    # trials that are over, and those of them that failed
    over: int = 0
    failed: int = 0
    # mapping of str to float64[trial]: what is stored of how they were drawn
    drawn: Mapping[str, Array] = field(default_factory=dict)

    @classmethod
    def planned(cls, description: Description, deviations: Array) -> Trials:
        """Return trials of which none has run."""
        n = len(deviations)
        answers = np.full((n, len(description.responses)), np.nan)
        return cls(description, deviations, np.zeros(n, np.uint8), answers)

    @classmethod
    def of_run(cls, run: Run, deviations: Array, whole: NDArray[np.bool_]) -> Trials:
        """Return the trials of a run, drawn again; only whole ones have run."""
        found = cls.planned(Description(run.contributors, run.responses), deviations)
        rows = np.flatnonzero(whole)
        for column, response in enumerate(run.responses):
            found.responses[rows, column] = run.column(response.name)[rows]
        found.status[rows] = run.status[rows]
        found.over = len(rows)
        found.failed = int(np.count_nonzero(run.status[rows] != Status.DONE))
        return found

    def take(self, blocks: list[tuple[int, Answers]]) -> None:
        """Keep finished blocks."""
        for first, outcome in blocks:
            rows = slice(first, first + len(outcome.status))
            self.status[rows], self.responses[rows] = outcome.status, outcome.responses
            self.over += len(outcome.status)
            self.failed += int(np.count_nonzero(outcome.status != Status.DONE))

    def forget(self, these: NDArray[np.bool_]) -> None:
        """Let some trials not have run."""
        self.status[these], self.responses[these] = Status.NOT_RUN, np.nan
        self.over = int(np.count_nonzero(self.status))
        self.failed = int(np.count_nonzero(self.status > Status.DONE))

    def first(self, trials: int) -> Trials:
        """Return the first trials, all of which are over."""
        return Trials(
            self.description,
            self.deviations[:trials],
            self.status[:trials],
            self.responses[:trials],
            self.over,
            self.failed,
        )

    def response(self, name: str) -> Array:
        """Return a response of all trials."""
        names = [each.name for each in self.description.responses]
        column: Array = self.responses[:, names.index(name)]
        return column
