"""Verification of a run: whether it is as it was written, and repeats bit for bit.

Checksums, deviations, trials evaluated again, and some of them alone.
"""

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.errors import TolstatError
from tolstat.execution import compatibility
from tolstat.execution.compatibility import (
    made_differently,
    study_of,
    trials_sampled_differently,
)
from tolstat.execution.diagnostics.audit_selection import random_trials
from tolstat.execution.run_loop import other_results
from tolstat.execution.sampled_again import drawn_again
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.model.contract import Model
from tolstat.status import Status
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.given_points import cases_among
from tolstat.study.study import Study

BLOCK = 100  # trials of a block, so that they have other neighbours than in the run
ALONE = 8  # trials at most that are evaluated alone


class Verification(NamedTuple):
    """Findings on a run whose seal is intact; trials by their numbers."""

    run: Run  # with its `damage`: trials whose data do not fit their checksum
    contradicting: Integers  # whose status contradicts their responses
    drawn_otherwise: Integers  # whose deviations differ when sampled again
    evaluated: Integers  # that were evaluated again
    different: Integers  # those of them that differ from the stored ones in any bit
    alone: Integers  # those of them that were also evaluated alone
    dependent: Integers  # those of these that differ from the stored ones
    nominal_differs: bool  # whether the nominal trial does
    # causes of differences without damage: another source, processor
    reasons: tuple[str, ...]
    file: str = ""  # whether the file of its rows is as it was; empty without one

    @property
    def trials(self) -> Integers:
        """Every trial with a finding."""
        findings = (
            self.contradicting,
            self.drawn_otherwise,
            self.different,
            self.dependent,
        )
        return np.unique(np.concatenate([self.run.damage.trials, *findings]))

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
    ran = np.flatnonzero(run.status != Status.NOT_RUN)
    chosen = np.intersect1d(ran, random_trials(study.seed or 0, run.trials))
    resampled = trials_sampled_differently(run, trials.columns(study))
    # trials with other deviations cannot be compared
    chosen = np.setdiff1d(ran if every else chosen, resampled)
    chosen = chosen[~np.isnan(trials.deviations[chosen]).any(axis=1)]
    with Workers(workers, block=BLOCK) as crew, Workers(workers, block=1) as single:
        nominal = _nominal_differs(run, study, single)
        alone = chosen[:: len(chosen) // ALONE + 1]
        if known := study.answers:
            chosen, alone = ran, ran[:0]  # nothing is evaluated: all are compared
            different = compatibility.rows_differing(run, known, ran)
        else:
            different = _differing(run, study, chosen, trials.deviations, crew)
        dependent = _differing(run, study, alone, trials.deviations, single)
    return Verification(
        run,
        _contradicting(run),
        resampled,
        chosen,
        different,
        alone,
        dependent,
        nominal,
        tuple(made_differently(run, study.model.source_digest)),
        compatibility.file_read_again(run, study),
    )


def _contradicting(run: Run) -> Integers:
    """Return trials that are done without responses, or failed with some."""
    answered = np.isfinite(run.results().responses).all(axis=1)
    unknown = np.isin(run.status, list(run.words), invert=True)
    done, ran = run.status == Status.DONE, run.status != Status.NOT_RUN
    return np.flatnonzero(unknown | (ran & (done != answered)))


def _nominal_differs(run: Run, study: Study, workers: Workers) -> bool:
    """Return whether the nominal trial now differs in any bit."""
    if not (run.complete or run.nominal_results.status.any()):
        return False
    rows = np.zeros((1, len(run.contributors)))
    again = workers.simulate(study.model, rows, study.settings)
    return bool(other_results(again, run.nominal_results).any())


def _differing(
    run: Run, study: Study, chosen: Integers, deviations: Array, workers: Workers
) -> Integers:
    """Return which of the chosen trials now differ in any bit."""
    if not len(chosen):
        return chosen
    cases = cases_among(study.cases, chosen)
    again = workers.simulate_cases(study.model, cases, deviations[chosen])
    return chosen[other_results(again, run.results(chosen))]
