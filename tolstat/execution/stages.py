"""The trials of a run, drawn stage by stage as their sampler has it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Workers
from tolstat.statistics.limits.limit import margins
from tolstat.status import Status
from tolstat.store.stored_run import Run
from tolstat.study.study import Study

Array = NDArray[np.float64]


class Stages:
    """Trials of which the first stage is drawn, and the next ones on request.

    Attributes
    ----------
    trials : Trials
        All of them; deviations and columns are NaN where they are not drawn yet.
    latest : slice
        The trials of the latest stage that is drawn.
    """

    def __init__(self, study: Study) -> None:
        self._limit = study.limits.get(study.aim)
        self._aim, self._course, self._number = study.aim, study.stages(), 0
        stage, drawn = next(self._course)
        n, columns = study.trials, study.sampler.columns if study.sampler else ()
        missing = np.full((n - len(drawn), drawn.shape[1]), np.nan)
        every = np.concatenate([drawn, missing]) if len(missing) else drawn
        self.trials = Trials.planned(study.description, every)
        self.trials.drawn = {name: np.full(n, np.nan) for name in columns}
        self.latest = slice(0, len(drawn))
        self._note(stage.columns(0))

    def draw_next(self, workers: Workers | None = None) -> bool:
        """Draw a stage, once all trials of the latest are over; false after the last.

        A fit among a hundred directions takes many seconds: once the workers stop it is
        not waited for (`Interrupted`).
        """
        answered, rows = np.empty(0), self.latest
        if self._limit:
            answered = margins(
                self.trials.response(self._aim)[rows], self._limit.permitted
            )
            # what failed is out of limit
            answered[self.trials.status[rows] != Status.DONE] = -np.inf
        send = self._course.send
        try:
            stage, deviations = (
                workers.here(send, answered) if workers else send(answered)
            )
        except StopIteration:
            return False
        self.latest = slice(rows.stop, rows.stop + len(deviations))
        self._number += 1
        self.trials.deviations[self.latest] = deviations
        self._note(stage.columns(self._number))
        return True

    def _note(self, columns: Mapping[str, Array]) -> None:
        for name, values in columns.items():
            self.trials.drawn[name][self.latest] = values


def drawn_again(run: Run, study: Study, workers: Workers | None = None) -> Stages:
    """Draw the trials of a stored run again; what is stored whole has run.

    Trials of stages that are drawn from answers which are not all there are missing.
    Workers as of `Stages.draw_next`.
    """
    stages = Stages(study)
    whole = run.status != Status.NOT_RUN
    whole[run.damage.trials] = False
    trials = stages.trials
    trials.take_stored(run, whole)
    while trials.status[: stages.latest.stop].all() and stages.draw_next(workers):
        pass
    trials.forget(slice(stages.latest.stop, None))
    return stages


def is_drawn(deviations: Array) -> NDArray[np.bool_]:
    """Tell which trials are drawn: bool[trial]."""
    return np.asarray(~np.isnan(deviations).any(axis=1), np.bool_)
