"""Proposers: each gives the next stage of trials, from the answers so far, or none."""

from typing import Protocol

import numpy as np

from tolstat.errors import Advice, Remedy, StoppedError
from tolstat.execution.trial_table import Shortfall, Stage, Trials
from tolstat.execution.workers.block_scheduler import Interrupted, Workers
from tolstat.statistics.limits.limit import margins
from tolstat.statistics.precision import FIRST, next_stage, trials_wanted
from tolstat.statistics.sample import Sample
from tolstat.status import Status
from tolstat.store.run_records import Stopped
from tolstat.store.stored_run import Run
from tolstat.study.study import Study


class Proposer(Protocol):
    """What gives the next stage."""

    def next(self, trials: Trials) -> Stage | None:
        """Return the stage to evaluate now; None if there are enough trials."""


class SampledStages:
    """The stages of a sampler: of most samplers and of given trials a single one.

    The latest stage is proposed until all of its trials are over.

    Attributes
    ----------
    latest : Stage
        The stage that was sampled last.
    trials : Trials
        All trials of the study, with the first stage sampled.
    """

    def __init__(self, study: Study) -> None:
        self._study, self._course = study, study.stages()
        stage, deviations = next(self._course)
        self.latest = Stage(0, 0, deviations, study.cases, stage.columns(0))
        self.trials = Trials.begun(study.description, self.latest, study.trials)

    def next(self, trials: Trials) -> Stage | None:
        """Return the latest stage while it is not over, then another one, if any.

        A fit in a hundred directions takes many seconds.
        """
        study, rows = self._study, slice(self.latest.first, self.latest.stop)
        if not trials.status[rows].all():
            return self.latest
        answered = np.empty(0)
        if limit := study.limits.get(study.aim):
            answered = margins(trials.response(study.aim)[rows], limit.permitted)
            # failed trials are out of limit
            answered[trials.status[rows] != Status.DONE] = -np.inf
        try:
            stage, deviations = self._course.send(answered)
        except StopIteration:
            return None
        number = self.latest.number + 1
        columns = stage.columns(number)
        self.latest = Stage(number, rows.stop, deviations, study.cases, columns)
        return self.latest


class UntilPrecise:
    """Stages until the rules of a study are reached; its trials are sampled already."""

    def __init__(self, study: Study) -> None:
        assert study.until and study.sampler  # checked with the study
        self._study, self._until = study, study.until
        self._replicates = study.sampler.replicates
        self._looks: list[int] = []  # finished trials at each look
        self._wanted = 0.0  # trials needed in all, by the last look; 0 if enough

    def next(self, trials: Trials) -> Stage | None:
        """Return the trials that the rules seem to need, from one look to the next.

        With many trials that takes seconds.
        """
        first, stop, most = 0, FIRST, len(trials.status)
        shortfall = None
        if self._looks:
            first = self._looks[-1]
            self._wanted = self._trials_wanted(trials, first)
            if not self._wanted or first == most:
                return None
            stop = next_stage(first, self._wanted)
            if self._wanted > most and first == FIRST:
                shortfall = Shortfall(self._wanted, self._until.rules, most)
        self._looks.append(min(stop, most))
        deviations = trials.deviations[first : self._looks[-1]]
        number, cases = len(self._looks) - 1, self._study.cases
        return Stage(number, first, deviations, cases, shortfall=shortfall)

    @property
    def stopped(self) -> Stopped:
        """How the rules ended the run."""
        return Stopped(
            self._until.rules,
            not self._wanted,
            tuple(self._looks),
            self._study.trials,
            self._wanted,
        )

    def _trials_wanted(self, trials: Trials, ended: int) -> float:
        """Return how many trials the rules need in all; 0 if there are enough."""
        responses = trials.description.responses
        names = [response.name for response in responses]
        return trials_wanted(
            self._until.precisions,
            dict(zip(names, trials.responses[:ended].T, strict=True)),
            Sample(trials.status[:ended], self._replicates),
            {name: limit.permitted for name, limit in self._study.limits.items()},
            {response.name: response.range for response in responses if response.range},
        )


def drawn_again(
    run: Run, study: Study, workers: Workers | None = None
) -> SampledStages:
    """Return the trials of a stored run, sampled again, with their stored answers.

    Stages that depend on missing answers are left out. StoppedError once the workers
    stop.
    """
    stages = SampledStages(study)
    trials = stages.trials
    answered = run.status != Status.NOT_RUN
    answered[run.damage.trials] = False
    trials.take_stored(run, answered)
    try:
        while trials.status[: trials.sampled].all():
            stage = (
                workers.call(stages.next, trials) if workers else stages.next(trials)
            )
            if stage is None:
                break
            trials.add(stage)
    except Interrupted:
        raise StoppedError(
            f"stopped before any new trial ran; the run in {run.path} is unchanged",
            Advice(Remedy.RESUME, run.path, run.machine),
        ) from None
    not_sampled = slice(trials.sampled, None)
    trials.status[not_sampled], trials.responses[not_sampled] = Status.NOT_RUN, np.nan
    return stages
