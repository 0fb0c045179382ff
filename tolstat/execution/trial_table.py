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
    # mapping of str to float64[trial]: what is stored of how they were drawn
    drawn: Mapping[str, Array] = field(default_factory=dict)

    @classmethod
    def planned(cls, description: Description, deviations: Array) -> Trials:
        """Return trials of which none has run."""
        n = len(deviations)
        answers = np.full((n, len(description.responses)), np.nan)
        return cls(description, deviations, np.zeros(n, np.uint8), answers)

    @property
    def over(self) -> int:
        """Number of trials that are over."""
        return int(np.count_nonzero(self.status))

    @property
    def failed(self) -> int:
        """Number of those that failed."""
        return int(np.count_nonzero(self.status > Status.DONE))

    def take(self, blocks: list[tuple[int, Answers]]) -> None:
        """Keep finished blocks."""
        for first, outcome in blocks:
            rows = slice(first, first + len(outcome.status))
            self.status[rows], self.responses[rows] = outcome.status, outcome.responses

    def take_stored(self, run: Run, which: NDArray[np.bool_]) -> None:
        """Keep the answers that a run has stored; bool[trial] says of which trials."""
        whole = np.flatnonzero(which)
        self.status[whole] = run.status[whole]
        for column, response in enumerate(self.description.responses):
            if response.name in run.units:
                self.responses[whole, column] = run.column(response.name)[whole]

    def forget(self, these: slice) -> None:
        """Let some trials not have run."""
        self.status[these], self.responses[these] = Status.NOT_RUN, np.nan

    def first(self, trials: int) -> Trials:
        """Return the first trials."""
        return Trials(
            self.description,
            self.deviations[:trials],
            self.status[:trials],
            self.responses[:trials],
        )

    def response(self, name: str) -> Array:
        """Return a response of all trials."""
        names = [each.name for each in self.description.responses]
        column: Array = self.responses[:, names.index(name)]
        return column
