"""Stages of trials: all trials in memory, and what proposes the next of them.

A proposer gives the next stage from the answers so far, or none.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Integers, Truths
from tolstat.model.contract import TrialResults
from tolstat.model.description import Description
from tolstat.statistics.intervals.weights import COLUMNS, Thinned
from tolstat.statistics.limits.limit import margins
from tolstat.statistics.sample import Sample
from tolstat.statistics.sample_size import FIRST_STAGE, next_stage, trials_wanted
from tolstat.status import Status
from tolstat.store.run_records import STATUS, STEPS, Stopped
from tolstat.store.stored_run import Run
from tolstat.study.given_points import Case
from tolstat.study.study import Study


def rows_of(answers: TrialResults, trials: Integers | Sequence[int]) -> TrialResults:
    """Return the answers of some trials."""
    steps = None if answers.steps is None else answers.steps[trials]
    return TrialResults(answers.responses[trials], answers.status[trials], steps)


class Shortfall(NamedTuple):
    """A stopping rule that seems to need more trials than it may have."""

    wanted: float  # trials that it needs; infinite if not known yet
    rules: tuple[str, ...]  # as they are written
    at_most: int  # most trials that it may have


MOST_WITH_OUTPUT = 20  # failed trials whose output is kept: the first ones


class Stage(NamedTuple):
    """Trials that are evaluated before more are proposed."""

    first: int  # number of its first trial
    deviations: Array  # float64[trial, contributor], SI
    cases: Sequence[Case]  # settings, by the number of the trial
    # of the sampler, such as the weight of a rare run: float64[trial]
    columns: Mapping[str, Array] = {}
    shortfall: Shortfall | None = None
    answers: TrialResults | None = None  # where they are known and nothing is evaluated

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
    # by trial, the first ones that failed: what they printed last
    output: dict[int, str] = field(default_factory=dict)
    steps: NDArray[np.int64] | None = None  # int64[trial]; None without integration

    @classmethod
    def planned(cls, description: Description, deviations: Array) -> Trials:
        """Return trials of which none has run."""
        n = len(deviations)
        answers = np.full((n, len(description.responses)), np.nan)
        return cls(description, deviations, np.zeros(n, np.uint8), answers, n)

    @classmethod
    def begun(cls, study: Study, stage: Stage) -> Trials:
        """Return the trials of a study, those of the first stage sampled."""
        trials = cls.planned(study.description, stage.deviations)
        trials.drawn = dict(stage.columns)
        if study.model.integrates:
            trials.steps = np.zeros(stage.stop, np.int64)
        trials.make_room(study.trials)
        return trials

    def columns(self, study: Study) -> dict[str, NDArray[Any]]:
        """Return the columns of their run, which are filled as they run."""
        columns = dict(study.points.settings or {}) if study.points else {}
        names = [contributor.name for contributor in self.description.contributors]
        columns |= zip(names, self.deviations.T, strict=True)
        columns |= {**self.drawn, **self.by_response(), STATUS: self.status}
        return columns if self.steps is None else columns | {STEPS: self.steps}

    @property
    def ended(self) -> int:
        """Number of trials that have ended."""
        return int(np.count_nonzero(self.status))

    @property
    def failed(self) -> int:
        """Number of those that failed."""
        return int(np.count_nonzero(self.status > Status.DONE))

    @property
    def thinned(self) -> Thinned | None:
        """How those that are sampled were thinned; None if they were not."""
        if not (self.drawn.keys() >= COLUMNS.keys() and self.sampled):
            return None
        return Thinned(*(self.drawn[name][: self.sampled] for name in COLUMNS))

    @property
    def random(self) -> Trials:
        """The first ones, which are random: all of them if they were not thinned."""
        return self.first(self.thinned.plain) if self.thinned else self

    def add(self, stage: Stage) -> bool:
        """Note the deviations of a stage; return whether they were not sampled yet."""
        if stage.stop <= self.sampled:
            return False
        self.make_room(stage.stop)
        rows = slice(stage.first, stage.stop)
        self.deviations[rows], self.sampled = stage.deviations, stage.stop
        for name, values in stage.columns.items():
            self.drawn[name][rows] = values
        return True

    def lengthen(self, deviations: Array) -> None:
        """Take more trials: the deviations of those before, and of new ones."""
        self.make_room(len(deviations))
        self.deviations, self.sampled = deviations, len(deviations)

    def make_room(self, trials: int) -> None:
        """Have room for so many trials, not sampled yet."""
        if (room := trials - len(self.status)) <= 0:
            return
        self.deviations = _longer(self.deviations, room)
        self.responses = _longer(self.responses, room)
        self.drawn = {name: _longer(x, room) for name, x in self.drawn.items()}
        self.status = np.pad(self.status, (0, room))
        self.steps = None if self.steps is None else np.pad(self.steps, (0, room))

    def thin(self, random: int) -> None:
        """Let thinned stages follow so many random trials."""
        chance = np.where(np.arange(len(self.status)) < random, 1.0, np.nan)
        columns = chance, random * chance, chance.copy()
        self.drawn = dict(zip(COLUMNS, columns, strict=True))
        self.deviations[random:], self.sampled = np.nan, random

    def missing(self, stage: Stage) -> list[Case]:
        """Return the parts of cases that have not run, up to the end of a stage."""
        cases = []
        for case in stage.cases:
            missing = self.status[case.first : min(case.stop, stage.stop)] == 0
            ends = np.flatnonzero(np.diff(np.pad(missing.astype(np.int8), 1)))
            for first, stop in (case.first + ends.reshape(-1, 2)).tolist():
                cases.append(case._replace(first=first, stop=stop))
        return cases

    def take(self, blocks: list[tuple[int, TrialResults]]) -> None:
        """Keep finished blocks."""
        for first, outcome in blocks:
            rows = slice(first, first + len(outcome.status))
            self.status[rows], self.responses[rows] = outcome.status, outcome.responses
            if self.steps is not None and outcome.steps is not None:
                self.steps[rows] = outcome.steps
            self.output |= {first + row: text for row, text in outcome.output.items()}
        if len(self.output) > MOST_WITH_OUTPUT:
            self.output = dict(sorted(self.output.items())[:MOST_WITH_OUTPUT])

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
            {name: values[:trials] for name, values in self.drawn.items()},
            {n: text for n, text in self.output.items() if n < trials},
            None if self.steps is None else self.steps[:trials],
        )

    def by_response(self) -> dict[str, Array]:
        """Return all responses of all trials."""
        names = [response.name for response in self.description.responses]
        return dict(zip(names, self.responses.T, strict=True))

    def response(self, name: str) -> Array:
        """Return a response of all trials."""
        return self.by_response()[name]


def _longer(rows: Array, room: int) -> Array:
    """Return an array with so many more rows, NaN; the same without any."""
    if not room:
        return rows
    return np.concatenate([rows, np.full((room, *rows.shape[1:]), np.nan)])


class Proposer(Protocol):
    """What gives the next stage."""

    def next(self, trials: Trials) -> Stage | None:
        """Return the stage to evaluate now; None if there are enough trials."""


class StudyStages(Proposer, Protocol):
    """The stages of a study, with all of its trials."""

    trials: Trials


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
        self.latest = Stage(
            0, deviations, study.cases, stage.columns(), answers=study.answers
        )
        self.trials = Trials.begun(study, self.latest)

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
        self.latest = Stage(rows.stop, deviations, study.cases, stage.columns())
        return self.latest


class StoppingRule(ABC):
    """Stages until a rule of a study is reached.

    Attributes
    ----------
    rows : int
        How many rows the trials need to go on; 0 if these are enough.
    """

    rows = 0

    def __init__(self, study: Study) -> None:
        assert study.until  # checked with the study
        self._study, self._until = study, study.until

    @abstractmethod
    def next(self, trials: Trials) -> Stage | None:
        """Return the stage to evaluate now; None at the end, or without rows."""

    @property
    @abstractmethod
    def stopped(self) -> Stopped:
        """How the rule ended the run."""

    def is_late(self, trials: Trials) -> bool:
        """Return whether the stage is to end now, with the trials that have run."""
        return False

    def lengthen(self, trials: Trials) -> Study:
        """Sample more trials, as many as are to be `rows`; return the study of all."""
        self._study = replace(self._study, trials=self.rows)
        trials.lengthen(self._study.deviations())
        return self._study


class UntilPrecise(StoppingRule):
    """Stages until the rules of a study are reached; its trials are sampled already."""

    def __init__(self, study: Study) -> None:
        super().__init__(study)
        assert study.sampler  # checked with the study
        self._replicates = study.sampler.replicates
        self._looks: list[int] = []  # finished trials at each look
        self._wanted = 0.0  # trials needed in all, by the last look; 0 if enough

    def next(self, trials: Trials) -> Stage | None:
        """Return the trials that the rules seem to need, from one look to the next.

        With many trials that takes seconds.
        """
        first, stop, most = 0, FIRST_STAGE, len(trials.status)
        shortfall = None
        if self._looks:
            first = self._looks[-1]
            self._wanted = self._trials_wanted(trials, first)
            if not self._wanted or first == most:
                return None
            stop = next_stage(first, self._wanted)
            if self._wanted > most and first == FIRST_STAGE:
                shortfall = Shortfall(self._wanted, self._until.rules, most)
        self._looks.append(min(stop, most))
        deviations = trials.deviations[first : self._looks[-1]]
        return Stage(first, deviations, self._study.cases, shortfall=shortfall)

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
        return trials_wanted(
            self._until.precisions,
            trials.first(ended).by_response(),
            Sample(trials.status[:ended], self._replicates),
            {name: limit.permitted for name, limit in self._study.limits.items()},
            {response.name: response.range for response in responses if response.range},
        )
