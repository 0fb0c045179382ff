"""Stages of a run that ends when every limit is met or not met."""

import time
from dataclasses import replace

import numpy as np

from tolstat.arrays import Truths
from tolstat.execution.stages import Shortfall, Stage, StoppingRule, Trials
from tolstat.statistics.deciding.looks import (
    looks_from,
    trials_that_settle,
    undecided,
)
from tolstat.statistics.sample import Sample
from tolstat.statistics.sample_size import FIRST_STAGE
from tolstat.store.run_records import Stopped
from tolstat.study.study import Study

GROWTH = 2  # times as many rows, once all of them have run


class UntilDecided(StoppingRule):
    """Stages of a tenth until every limit is decided, or the budget is used up.

    Looks do not depend on where a run was interrupted: it ends as it would have.
    """

    def __init__(self, study: Study) -> None:
        super().__init__(study)
        assert self._until.budget  # else it asks for a precision
        self._budget, self._began = self._until.budget, 0.0
        self._sample, self._open = Sample(np.empty(0, np.uint8)), dict[str, Truths]()

    def next(self, trials: Trials) -> Stage | None:
        """Return the trials up to the next look; None at the end, or without rows."""
        self.rows, rows, most = 0, len(trials.status), self._budget.most
        self._began, shortfall = self._began or time.monotonic(), None
        not_run = np.flatnonzero(trials.status == 0)
        ended = int(not_run[0]) if len(not_run) else rows
        look = min(next(looks_from(ended)), most)
        if look <= ended:
            self._look(trials.first(ended))
            seconds = time.monotonic() - self._began
            spent = ended >= self._budget.trials and seconds >= self._budget.seconds
            if spent or not self._open:
                return None
            if ended == FIRST_STAGE and not self._budget.seconds:
                wanted = self.stopped.wanted
                if wanted > most:
                    shortfall = Shortfall(wanted, self._until.rules, most)
            look = min(next(looks_from(ended + 1)), most)
        if look > rows:
            self.rows = min(max(GROWTH * rows, look), most)
            if replace(self._study, trials=self.rows).unfit:  # too little memory
                self.rows = 0
            return None
        deviations, cases = trials.deviations[ended:look], self._study.cases
        return Stage(ended, deviations, cases, shortfall=shortfall)

    def _look(self, trials: Trials) -> None:
        names = [response.name for response in trials.description.responses]
        responses = dict(zip(names, trials.responses.T, strict=True))
        self._sample = Sample(trials.status)
        self._open = undecided(responses, self._sample, self._study.limits)

    @property
    def stopped(self) -> Stopped:
        """How the verdicts, or the budget, ended the run."""
        ended = len(self._sample.status)
        return Stopped(
            self._until.rules,
            not self._open,
            (ended,),
            self._budget.trials or ended,
            trials_that_settle(self._open, self._sample, self._study.limits),
        )
