"""Stages of a run that ends when every limit is met or not met."""

import time
from dataclasses import replace

import numpy as np

from tolstat.arrays import Truths
from tolstat.execution.stages import Shortfall, Stage, StoppingRule, Trials
from tolstat.execution.thinned_stages import ThinnedStages
from tolstat.statistics.deciding.looks import looks_from, trials_that_settle, undecided
from tolstat.statistics.sample import Sample
from tolstat.statistics.sample_size import FEWEST_RANDOM, FIRST_STAGE, is_thinned
from tolstat.status import ran_in_order
from tolstat.store.run_records import Stopped
from tolstat.study.study import Study

GROWTH = 2  # times as many rows, once all of them have run


class UntilDecided(StoppingRule):
    """Stages of a tenth until every limit is decided, or the budget is used up.

    Of a slow model thinned ones follow. Neither they nor looks depend on the time
    that trials take, or on where a run was interrupted: it ends as it would have. A
    budget of time ends a stage, too: of thinned ones the latest then does not count.
    """

    def __init__(self, study: Study, thinned: ThinnedStages | None = None) -> None:
        super().__init__(study)
        assert self._until.budget  # else it asks for a precision
        self._budget, self._began = self._until.budget, 0.0
        self._sample, self._open = Sample(np.empty(0, np.uint8)), dict[str, Truths]()
        self._thinned = thinned

    def next(self, trials: Trials) -> Stage | None:
        """Return the trials up to the next look; None at the end, or without rows."""
        self.rows, rows, most = 0, len(trials.status), self._budget.most
        self._began = self._began or time.monotonic()
        late = self.is_late(trials)
        if self._thinned:
            if late:
                self._thinned.look_back(trials)
                self._note(self._thinned)
                return None
            return self._next_thinned(self._thinned, trials)
        ended, shortfall = ran_in_order(trials.status), None
        if late:
            self._look(trials.first(ended))
            return None
        look = min(next(looks_from(ended)), most)
        if look <= ended:
            self._look(trials.first(ended))
            if self._is_spent(ended) or not self._open:
                return None
            if self._is_slow(ended):
                trials.thin(ended)
                self._thinned, self.rows = ThinnedStages(self._study, trials), rows
                return None
            if ended == FIRST_STAGE and not self._budget.seconds:
                wanted = self.stopped.wanted
                if wanted > most:
                    shortfall = Shortfall(wanted, self._until.rules, most)
            look = min(next(looks_from(ended + 1)), most)
        if look > rows:
            self._ask_for(look, rows)
            return None
        deviations, cases = trials.deviations[ended:look], self._study.cases
        return Stage(ended, deviations, cases, shortfall=shortfall)

    def _next_thinned(self, thinned: ThinnedStages, trials: Trials) -> Stage | None:
        stage, rows = thinned.next(trials), len(trials.status)
        self._note(thinned)
        if stage is None or stage.first < trials.sampled:
            return stage
        if self._is_spent(stage.first) or stage.stop > self._budget.most:
            return None
        if stage.stop > rows:
            self._ask_for(stage.stop, rows)
            return None
        return stage

    def _note(self, thinned: ThinnedStages) -> None:
        self._sample, self._open = thinned.sample, thinned.undecided

    def is_late(self, trials: Trials) -> bool:
        """Return whether its time is over, and its first trials have run."""
        if self._budget.trials or not self._is_spent(0):
            return False
        first = trials.random.status if self._thinned else trials.status[:1]
        return bool(first.all())

    def _ask_for(self, trials: int, rows: int) -> None:
        """Ask for rows for so many trials at least, if there is memory for them."""
        self.rows = min(max(GROWTH * rows, trials), self._budget.most)
        if replace(self._study, trials=self.rows).unfit:  # too little memory
            self.rows = 0

    def _is_spent(self, ended: int) -> bool:
        seconds = time.monotonic() - self._began
        return ended >= self._budget.trials and seconds >= self._budget.seconds

    def _is_slow(self, ended: int) -> bool:
        """Return whether few of the further trials are to be evaluated."""
        if ended < FEWEST_RANDOM:
            return False
        if self._until.slow is not None:
            return self._until.slow
        needed = trials_that_settle(self._open, self._sample, self._study.limits)
        needed, model = min(needed, self._budget.most), self._study.model
        return is_thinned(
            needed - ended,
            isolated=model.isolation is not None,
            integrates=model.integrates,
        )

    def _look(self, trials: Trials) -> None:
        self._sample = Sample(trials.status)
        responses = trials.by_response()
        self._open = undecided(responses, self._sample, self._study.limits)

    def lengthen(self, trials: Trials) -> Study:
        """Have as many rows as are to be `rows`; return the study of all."""
        if not self._thinned:
            return super().lengthen(trials)
        trials.make_room(self.rows)
        self._study = replace(self._study, trials=self.rows)
        return self._study

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
