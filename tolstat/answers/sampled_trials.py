"""The trials of a run that its statistics rest on."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.deviations.samplers import AS_STUDY, DISTANCE, OWN, WEIGHT, Saltelli
from tolstat.errors import Advice, QuestionError, Remedy
from tolstat.model.contract import Model
from tolstat.statistics.integration_error import AuditedResponse, response_ends
from tolstat.statistics.intervals.weights import Weights
from tolstat.statistics.limits.limit import NO_LIMIT, within
from tolstat.statistics.limits.yields import PartsUncertainty, Yield, yield_of
from tolstat.statistics.sample import Sample
from tolstat.statistics.sensitivity.group_surface import GroupSurface, like_normal
from tolstat.statistics.summary import QUANTILES, ResponseUncertainty
from tolstat.status import Status, ran_in_order
from tolstat.store.run_records import Sampled
from tolstat.store.stored_run import Run

UNLESS = ', unless the study says how its rows were sampled: sampled = "random"'
LEAST_DONE = 20  # trials of which a surface tells anything
MOST_TERMS = 10_000_000  # of surfaces of all responses; else of limited ones alone


@dataclass(frozen=True)
class Drawn:
    """Trials of a run that were sampled."""

    run: Run  # all of it
    sampled: Sampled  # how
    # int64[n], those that statistics rest on: all, the independent ones of a run made
    # for Sobol' indices, or the weighted ones of a rare run
    trials: NDArray[np.int64]
    sample: Sample  # these trials
    model: Model | None = None  # at hand, where a name does not find it

    def values(self, name: str, among: Truths | None = None) -> Array:
        """Return a response or contributor of these trials or some of them, SI."""
        column: Array = self.run.column(name)
        if len(self.trials) < self.run.trials:
            column = column[self.trials]
        return column if among is None or among.all() else column[among]

    def judged(self, permitted: float = 1.0) -> "Drawn":
        """Return the trials that tell of a limit: thinned ones, too, in whole stages.

        It permits such a share out of it: see `Sample.telling`. Weighted for other
        distributions only those that are random.
        """
        run = self.run
        if run.thinned is None or run.trials < run.thinned.plain or self.sample.weights:
            return self
        sampled = int(np.count_nonzero(~np.isnan(run.thinned.drawn)))
        thinned = run.thinned.first(sampled)
        number = thinned.in_whole_stages(ran_in_order(run.status))
        if not number:
            return self
        sample = Sample(run.status[:number], thinned=thinned.first(number))
        sample = sample.telling(permitted)
        return replace(self, trials=np.arange(len(sample.status)), sample=sample)

    def yield_of(self, name: str) -> Yield:
        """Return the yield of a limit, with its verdict."""
        limit = self.run.limits[name]
        judged = self.judged(1 - limit.demanded)
        return yield_of(
            judged.values(name), judged.sample_for(name), limit.permitted,
            limit.demanded, judged.ends(name), self.audited(name),
            self.uncertainty(name),
        )  # fmt: skip

    @property
    def trials_done(self) -> NDArray[np.int64]:
        """Those of these trials that are done, to see whether a response jumps.

        Of a rare run those of any stage. But the median of all deviations lies on a
        step of symmetric parts, to no side of it.
        """
        if self.run.aim:
            off_median = self.run.column(DISTANCE) > 0
            return np.flatnonzero((self.run.status == Status.DONE) & off_median)
        return self.trials[self.sample.done]

    def sample_for(self, *responses: str) -> Sample:
        """Return these trials for the limits of responses.

        A rare run has searched for trials out of one limit.
        """
        weights = self.sample.weights
        if weights and {*responses} == {self.run.aim}:
            searched = replace(weights, searched=True)
            return self.sample._replace(weights=searched)
        return self.sample

    def done(self, name: str) -> Array:
        """Return a response or contributor of those that are done, SI."""
        return self.values(name, self.sample.done)

    def deviating(self, among: NDArray[np.bool_]) -> dict[str, Array]:
        """Return the contributors that deviate among some of these trials, SI."""
        columns = {n.name: self.values(n.name, among) for n in self.run.contributors}
        return {n: x for n, x in columns.items() if len(x) and np.ptp(x) > 0}

    @cached_property
    def judged_parts(self) -> Mapping[str, Any]:
        """The measured parts, judged as deviations (`JudgedParts`), by entry."""
        if not self.run.measured:
            return {}
        from tolstat.answers.parts.judged_parts import judged_parts_of  # seldom used

        return judged_parts_of(self.run)

    @cached_property
    def uncertainties(self) -> dict[str, ResponseUncertainty]:
        """How uncertain responses are by the measured parts; `JOINT`: all limits.

        Empty without measured parts, and of a rare run: its trials lie in the tails.
        """
        run, done = self.run, self.sample.done
        if not run.measured or run.aim or np.count_nonzero(done) < LEAST_DONE:
            return {}
        from tolstat.statistics.measured.sample_uncertainty import (  # seldom used
            MeasuredTrials,
            uncertainties_of,
        )

        deviations = self.deviating(done)
        moving = (n in deviations for part in run.measured for n in part.contributors)
        if not any(moving) and not any(part.is_constant for part in run.measured):
            return {}
        names = [response.name for response in run.responses]
        if len(names) * len(deviations) ** 2 > MOST_TERMS:
            names = [*run.limits]
        weights, failed = self.sample.weights, self.sample.failed_trials
        trials = MeasuredTrials(
            run.measured,
            deviations,
            {name: self.done(name) for name in names},
            run.limits,
            None if weights is None else weights.values[done],
            float(weights.values[failed].sum()) if weights else float(failed.sum()),
        )
        return uncertainties_of(trials, QUANTILES)

    def uncertainty(self, name: str) -> PartsUncertainty | None:
        """Return how uncertain a limit is by measured parts; `JOINT`: all of them."""
        uncertainty = self.uncertainties.get(name)
        return uncertainty and uncertainty.share

    def ends(self, name: str) -> Array | None:
        """Return the responses that integration errors allow, as of `response_ends`.

        None where nothing was evaluated again, and of a residual.
        """
        if (again := self.run.audit_of(name)) is None:
            return None
        chosen = again.at_random | (again.chosen_by.get(name, 0) != 0)
        values, precise = self.run.column(name), again.responses[name]
        return response_ends(values, again.trials, precise, chosen)[:, self.trials]

    def audited(self, name: str) -> AuditedResponse | None:
        """Return what the audit shows of a response; None if not audited."""
        return audited_of(self.run, name)

    @property
    def grouped(self) -> bool:
        """Whether the run was made for Sobol' indices."""
        return self.sampled.group > 1

    def groups(self, name: str) -> Array:
        """Return a column in whole groups: float64[group, 2 + factor]."""
        values = self.run.column(name).reshape(-1, self.sampled.group)
        return values[self.whole_groups]

    @cached_property
    def whole_groups(self) -> Truths:
        """Which groups have no failed trial."""
        status = self.run.status.reshape(-1, self.sampled.group)
        return np.asarray(np.all(status == Status.DONE, axis=1))

    @cached_property
    def group_surface(self) -> GroupSurface:
        """What responses follow in whole groups."""
        factors, whole = self.sampled.factors, self.whole_groups
        unit = Saltelli().pairs(self.sampled.seed, factors, len(whole))[whole]
        contributors = {contributor.name for contributor in self.run.contributors}
        normal = [  # batches are
            name not in contributors
            or like_normal(self.groups(name)[:, 0], unit[:, 0, column])
            for column, name in enumerate(factors)
        ]
        return GroupSurface(unit, np.array(normal, np.bool_))


def audited_of(run: Run, name: str) -> AuditedResponse | None:
    """Return what the audit shows of a response; None if not audited."""
    if (audited := run.audit_of(name)) is None:
        return None
    limit = run.limits.get(name, NO_LIMIT)
    return audited.response(name, run.column(name), limit.permitted)


def changes_of(run: Run, name: str) -> Truths:
    """Return whether each trial evaluated again changes sides of its limit."""
    if (audited := run.audit_of(name)) is None:
        return np.zeros(0, dtype=np.bool_)
    permitted = run.limits[name].permitted
    before = within(run.column(name)[audited.trials], permitted)
    return np.asarray(before != within(audited.responses[name], permitted))


def drawn_trials(run: Run, model: Model | None = None) -> Drawn | None:
    """Return the trials of a run; None if they are no sample: see `no_sample`."""
    if run.sampled is None:
        return None
    if run.aim:
        weights = run.column(WEIGHT)
        trials = np.flatnonzero((run.status != Status.NOT_RUN) & ~np.isnan(weights))
        weighted = Weights(weights[trials], 1 / AS_STUDY)
        sample = Sample(run.status[trials], weights=weighted)
        return Drawn(run, run.sampled, trials, sample)
    trials = np.arange(run.random_trials)
    group = run.sampled.group
    if group > 1:
        trials = trials[trials % group < OWN]
    per_trial = run.random_trials / max(len(trials), 1)
    sample = Sample(run.status[trials], run.sampled.replicates, per_trial)
    return Drawn(run, run.sampled, trials, sample, model)


def no_sample(run: Run) -> QuestionError:
    """Return the error that says why the trials of a run are no sample."""
    unless = "" if run.grid else UNLESS
    return QuestionError(
        f"{run.path}: trials of a grid or a table are no sample: no statistics{unless}",
        Advice(
            Remedy.PLOT if run.grid else Remedy.EXPORT, run.path, run.machine, run=run
        ),
    )
