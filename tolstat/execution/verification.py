"""Verification of a run: checksums, deviations, trials evaluated again."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Integers
from tolstat.errors import TolstatError
from tolstat.execution.block_check import alone, differing, spread_over
from tolstat.execution.compatibility import study_of, trials_drawn_otherwise
from tolstat.execution.diagnostics.audit import random_trials
from tolstat.execution.planning import plan_of
from tolstat.execution.trial_table import drawn_again
from tolstat.execution.workers.crew import Workers
from tolstat.model.contract import Answers, Model
from tolstat.status import Status
from tolstat.store.layout import STEPS
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.given_points import cases_among
from tolstat.study.study import Study


class Verification(NamedTuple):
    """Findings on a run whose seal is intact; trials by their numbers."""

    run: Run  # with its `damage`: trials whose data do not fit their checksum
    contradicting: Integers  # whose status contradicts their responses
    drawn_otherwise: Integers  # whose deviations differ when sampled again
    evaluated: Integers  # that were evaluated again
    different: Integers  # those of them that differ from the stored ones in any bit
    apart: Integers  # those that were also evaluated alone
    dependent: Integers  # those of them that differ alone from those in a block
    nominal_differs: bool  # whether the nominal trial does
    # causes of differences without damage: another source, processor
    reasons: tuple[str, ...]

    @property
    def trials(self) -> Integers:
        """Every trial with a finding."""
        some = self.contradicting, self.drawn_otherwise, self.different, self.dependent
        return np.unique(np.concatenate([self.run.damage.trials, *some]))

    @property
    def whole(self) -> bool:
        """Whether there is no finding."""
        return not (self.run.damage or len(self.trials) or self.nominal_differs)


def verify(
    path: str | os.PathLike[str],
    *,
    every: bool = False,
    workers: int | None = None,
    model: Model | None = None,
) -> Verification:
    """Return the trials of a run that are not as they were written.

    Parameters
    ----------
    path : path
        The run file.
    every : bool
        Whether all its trials are evaluated again; else one of each hundred.
    workers, model
        As of `tolstat.run`.

    Returns
    -------
    Verification
        The findings. `tolstat.resume` repairs damaged trials. A trial that fits its
        checksum and still differs here needs a new run.

    Raises
    ------
    DamagedError
        If the file is damaged outside its trials.

    Examples
    --------
    >>> tolstat.verify("runs/stack-up.h5").whole
    True
    """
    run = open_run(Path(path), damaged=True)
    try:
        study = study_of(run, run.trials, model)
    except TolstatError as error:  # data or model are missing here
        raise type(error)(
            f"{path}: checksums: {run.damage.words or 'all fit'}; its trials cannot be "
            f"sampled and evaluated again: {error}"
        ) from error
    trials = drawn_again(run, study).trials
    plan = plan_of(study, trials, run.path)
    ran = np.flatnonzero(run.status != Status.NOT_RUN)
    chosen = np.intersect1d(ran, random_trials(study.seed or 0, run.trials))
    otherwise = trials_drawn_otherwise(run, plan)
    # trials with other deviations cannot be compared
    chosen = np.setdiff1d(ran if every else chosen, otherwise)
    chosen = chosen[~np.isnan(trials.deviations[chosen]).any(axis=1)]
    with Workers(workers) as crew:
        found = _again(study, chosen, trials.deviations, crew)
        other = differing(found, _stored(run, chosen))
        apart = np.union1d(spread_over(chosen), spread_over(chosen[other[1:]]))
        dependent = apart[:0]
        if len(apart):
            single = alone(cases_among(study.cases, apart))
            rows = trials.deviations[apart]
            among = found.rows(1 + np.searchsorted(chosen, apart))
            answers = crew.simulate_cases(study.model, single, rows)
            dependent = apart[differing(answers, among)]
    nominal_ran = run.nominal_values["status"] != Status.NOT_RUN.word
    return Verification(
        run,
        _contradicting(run),
        otherwise,
        chosen,
        chosen[other[1:]],
        apart,
        dependent,
        bool(other[0] and (nominal_ran or run.complete)),
        tuple(run.made_otherwise(study.model.source_digest)),
    )


def _contradicting(run: Run) -> Integers:
    """Return trials that are done without responses, or failed with some."""
    finite = [np.isfinite(run.column(each.name)) for each in run.responses]
    known = np.isin(run.status, list(run.words))
    done, ran = run.status == Status.DONE, run.status != Status.NOT_RUN
    answered = np.all(finite, axis=0)
    return np.flatnonzero(~known | (ran & (done != answered)))


def _again(
    study: Study, chosen: Integers, deviations: Array, workers: Workers
) -> Answers:
    """Return the nominal and the chosen trials, among other neighbours than stored."""
    nominal = np.zeros((1, deviations.shape[1]))
    found = workers.simulate(study.model, nominal, study.settings)
    if not len(chosen):
        return found
    cases, order = cases_among(study.cases, chosen), np.arange(len(chosen))
    for case in cases:  # the last trials come into the first block
        order[case.first : case.stop] = order[case.first : case.stop][::-1]
    again = workers.simulate_cases(study.model, cases, deviations[chosen[order]])
    return Answers.joined([found, again.rows(order)])


def _stored(run: Run, chosen: Integers) -> Answers:
    """Return the answers of the nominal and the chosen trials as the run has them."""

    def both(name: str) -> NDArray[Any]:
        return np.append(run.nominal_values[name], run.column(name)[chosen])

    codes = {word: code for code, word in run.words.items()}
    nominal = codes.get(run.nominal_values["status"], Status.NOT_RUN)
    return Answers(
        np.stack([both(each.name) for each in run.responses], axis=1),
        np.append(nominal, run.status[chosen]),
        both(STEPS) if run.steps is not None else None,
    )
