"""The trials of a run in memory, sampled stage by stage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.errors import Advice, Remedy, StoppedError
from tolstat.execution.workers.crew import Interrupted, Workers
from tolstat.model.contract import Answers
from tolstat.model.description import Description
from tolstat.statistics.limits.limit import margins
from tolstat.status import Status
from tolstat.store.stored_run import Run
from tolstat.study.study import Study


@dataclass
class Trials:
    """Deviations, and the answers so far."""

    description: Description  # names of the columns
    deviations: Array  # float64[trial, contributor], SI
    status: NDArray[np.uint8]  # uint8[trial]: 0 where a trial has not run
    responses: Array  # float64[trial, response], SI; NaN where there is none
    # mapping of str to float64[trial]: columns of the sampler
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

    def take_stored(self, run: Run, which: Truths) -> None:
        """Keep the stored answers of a run, for the trials in `which`, bool[trial]."""
        whole = np.flatnonzero(which)
        self.status[whole] = run.status[whole]
        for column, response in enumerate(self.description.responses):
            if response.name in run.units:
                self.responses[whole, column] = run.column(response.name)[whole]

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


class Stages:
    """Trials whose first stage is sampled at once, later ones on request.

    Attributes
    ----------
    trials : Trials
        All of them; deviations and columns are NaN where they are not sampled yet.
    latest : slice
        The trials of the latest stage that is sampled.
    """

    def __init__(self, study: Study) -> None:
        self._limit = study.limits.get(study.aim)
        self._aim, self._course = study.aim, study.stages()
        stage, drawn = next(self._course)
        n, columns = study.trials, study.sampler.columns if study.sampler else ()
        missing = np.full((n - len(drawn), drawn.shape[1]), np.nan)
        every = np.concatenate([drawn, missing]) if len(missing) else drawn
        self.trials = Trials.planned(study.description, every)
        self.trials.drawn = {name: np.full(n, np.nan) for name in columns}
        self.latest = slice(0, len(drawn))
        self._note(stage.columns())

    def draw_next(self, workers: Workers | None = None) -> bool:
        """Sample a stage, once all trials of the latest are over; false after the last.

        A fit in a hundred directions takes many seconds; it raises `Interrupted` once
        the workers stop.
        """
        answered, rows = np.empty(0), self.latest
        if self._limit:
            answered = margins(
                self.trials.response(self._aim)[rows], self._limit.permitted
            )
            # failed trials are out of limit
            answered[self.trials.status[rows] != Status.DONE] = -np.inf
        send = self._course.send
        try:
            stage, deviations = (
                workers.here(send, answered) if workers else send(answered)
            )
        except StopIteration:
            return False
        self.latest = slice(rows.stop, rows.stop + len(deviations))
        self.trials.deviations[self.latest] = deviations
        self._note(stage.columns())
        return True

    def _note(self, columns: Mapping[str, Array]) -> None:
        for name, values in columns.items():
            self.trials.drawn[name][self.latest] = values


def drawn_again(run: Run, study: Study, workers: Workers | None = None) -> Stages:
    """Return the trials of a stored run, sampled again, with their stored answers.

    Stages that depend on missing answers are left out. Workers as in
    `Stages.draw_next`; StoppedError once they stop.
    """
    stages = Stages(study)
    whole = run.status != Status.NOT_RUN
    whole[run.damage.trials] = False
    trials = stages.trials
    trials.take_stored(run, whole)
    try:
        while trials.status[: stages.latest.stop].all() and stages.draw_next(workers):
            pass
    except Interrupted:
        raise StoppedError(
            f"stopped before any new trial ran; the run in {run.path} is unchanged",
            Advice(Remedy.RESUME, run.path, run.machine),
        ) from None
    not_drawn = slice(stages.latest.stop, None)
    trials.status[not_drawn], trials.responses[not_drawn] = Status.NOT_RUN, np.nan
    return stages
