"""The trials of a run in memory: deviations, and the answers so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.model.contract import Answers
from tolstat.model.description import Description
from tolstat.status import Status
from tolstat.store.stored_run import Run
from tolstat.study.given_points import Case


class Shortfall(NamedTuple):
    """A stopping rule that seems to need more trials than it may have."""

    wanted: float  # trials that it needs; infinite if not known yet
    rules: tuple[str, ...]  # as they are written
    at_most: int  # most trials that it may have


class Stage(NamedTuple):
    """Trials that are evaluated before more are proposed."""

    number: int  # from 0
    first: int  # number of its first trial
    deviations: Array  # float64[trial, contributor], SI
    cases: Sequence[Case]  # settings, by the number of the trial
    # of the sampler, such as the logarithm of the density ratio: float64[trial]
    columns: Mapping[str, Array] = {}
    shortfall: Shortfall | None = None

    @property
    def stop(self) -> int:
        """The number after its last trial."""
        return self.first + len(self.deviations)


@dataclass
class Trials:
    """Deviations, and the answers so far."""

    description: Description  # names of the columns
    deviations: Array  # float64[trial, contributor], SI; NaN where not sampled yet
    status: NDArray[np.uint8]  # uint8[trial]: 0 where a trial has not run
    responses: Array  # float64[trial, response], SI; NaN where there is none
    sampled: int  # how many have deviations
    # mapping of str to float64[trial]: columns of the sampler
    drawn: Mapping[str, Array] = field(default_factory=dict)

    @classmethod
    def planned(cls, description: Description, deviations: Array) -> Trials:
        """Return trials of which none has run."""
        n = len(deviations)
        answers = np.full((n, len(description.responses)), np.nan)
        return cls(description, deviations, np.zeros(n, np.uint8), answers, n)

    @classmethod
    def begun(cls, description: Description, stage: Stage, trials: int) -> Trials:
        """Return so many trials, those of the first stage sampled."""
        room = trials - stage.stop
        trials_of_all = cls.planned(description, _longer(stage.deviations, room))
        trials_of_all.sampled = stage.stop
        trials_of_all.drawn = {
            name: _longer(values, room) for name, values in stage.columns.items()
        }
        return trials_of_all

    @property
    def ended(self) -> int:
        """Number of trials that have ended."""
        return int(np.count_nonzero(self.status))

    @property
    def failed(self) -> int:
        """Number of those that failed."""
        return int(np.count_nonzero(self.status > Status.DONE))

    def add(self, stage: Stage) -> bool:
        """Note the deviations of a stage; return whether they were not sampled yet."""
        if stage.stop <= self.sampled:
            return False
        if (room := stage.stop - len(self.status)) > 0:
            self.deviations = _longer(self.deviations, room)
            self.responses = _longer(self.responses, room)
            self.status = np.pad(self.status, (0, room))
        rows = slice(stage.first, stage.stop)
        self.deviations[rows], self.sampled = stage.deviations, stage.stop
        for name, values in stage.columns.items():
            self.drawn[name][rows] = values
        return True

    def missing(self, stage: Stage) -> list[Case]:
        """Return the parts of cases that have not run, up to the end of a stage."""
        cases = []
        for case in stage.cases:
            missing = self.status[case.first : min(case.stop, stage.stop)] == 0
            ends = np.flatnonzero(np.diff(np.pad(missing.astype(np.int8), 1)))
            for first, stop in (case.first + ends.reshape(-1, 2)).tolist():
                cases.append(case._replace(first=first, stop=stop))
        return cases

    def take(self, blocks: list[tuple[int, Answers]]) -> None:
        """Keep finished blocks."""
        for first, outcome in blocks:
            rows = slice(first, first + len(outcome.status))
            self.status[rows], self.responses[rows] = outcome.status, outcome.responses

    def take_stored(self, run: Run, which: Truths) -> None:
        """Keep the stored answers of a run, for the trials in `which`, bool[trial]."""
        rows = np.flatnonzero(which)
        self.status[rows] = run.status[rows]
        for column, response in enumerate(self.description.responses):
            if response.name in run.units:
                self.responses[rows, column] = run.column(response.name)[rows]

    def first(self, trials: int) -> Trials:
        """Return the first trials."""
        return Trials(
            self.description,
            self.deviations[:trials],
            self.status[:trials],
            self.responses[:trials],
            trials,
        )

    def response(self, name: str) -> Array:
        """Return a response of all trials."""
        names = [response.name for response in self.description.responses]
        column: Array = self.responses[:, names.index(name)]
        return column


def _longer(rows: Array, room: int) -> Array:
    """Return an array with so many more rows, NaN; the same without any."""
    if not room:
        return rows
    return np.concatenate([rows, np.full((room, *rows.shape[1:]), np.nan)])
