"""Audit of a run: some trials evaluated again, much more precisely.

A few of them are evaluated a third time: do they move again? While one moves far, so
they are at a quarter of the longest step, unless all grow with each evaluation.
"""

import dataclasses
from itertools import pairwise
from typing import Any

import numpy as np

from tolstat.execution.diagnostics.audit_selection import (
    Selection,
    random_trials,
    select,
    select_more,
    select_third,
)
from tolstat.execution.stages import Trials
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.model.checked import tightened
from tolstat.model.contract import Model
from tolstat.statistics.integration_error import grows
from tolstat.store.run_records import Audited, joined
from tolstat.study.given_points import Case, cases_among
from tolstat.study.study import Study

TIGHTER = 32.0  # rtol of a third evaluation: twice the steps
MOST_STEPS = 20_000_000  # of all trials of one evaluation after the third
AGAIN, FAR = 5, 0.1  # more evaluations at most, while one moves by so much of the range
PARTS = 8  # of the trials at least, by their longest step; or eight trials of each


def audit(study: Study, trials: Trials, workers: Workers) -> Audited | None:
    """Return some trials evaluated more precisely; None if the model cannot.

    First those of `select`. Then, with the size of errors known, those that an error
    may carry across a limit, so that the fraction out of limit can be trusted, and more
    of those out of limit where trials moved. A few are evaluated a third time. Of a
    grid or a table one trial of each hundred.
    """
    seed = study.seed or 0
    if study.sampler is None:
        selection = Selection.joined(random_trials(seed, len(trials.deviations)))
        audited = evaluated_again(study, trials, selection, workers)
        return audited and _with_residual(study, trials, audited)
    sure = study.document.audit == "sure"
    selection = select(trials, study.limits, seed, sure=sure)
    audited = evaluated_again(study, trials, selection, workers)
    if audited is None:
        return None
    selection = select_more(trials, study.limits, audited, seed)
    if len(selection.trials) and (
        further := evaluated_again(study, trials, selection, workers)
    ):
        audited = joined(audited, further)
    selection = select_third(trials, study.limits, audited)
    third = _until_settled(study, trials, audited, selection, workers)
    audited = dataclasses.replace(audited, third=third)
    return _with_residual(study, trials, audited)


def _until_settled(
    study: Study, trials: Trials, first: Audited, chosen: Selection, workers: Workers
) -> Audited | None:
    """Return the third evaluation of chosen trials, or a later one while they move."""
    before = first
    for times in range(2, 3 + AGAIN):
        after, steps = _evaluated(study, trials, chosen, workers, times)
        if after is None:
            return before if times > 2 else None
        settled = not _moves_far(study, trials, before, after)
        if settled or 4 * steps > MOST_STEPS:
            return after
        before = after
    return before


def _with_residual(study: Study, trials: Trials, audited: Audited) -> Audited:
    if not study.model.integrates:
        return audited
    from tolstat.execution.diagnostics.kinks import residual_of  # and the integrator

    random = audited.trials[audited.at_random]
    residual = residual_of(study, trials.deviations, random)
    return dataclasses.replace(audited, residual=residual)


def _moves_far(study: Study, trials: Trials, first: Audited, second: Audited) -> bool:
    """Return whether trials evaluated again move by a tenth of a response's range."""
    rows = np.searchsorted(first.trials, second.trials)
    for name in study.limits or second.responses:
        before, after = first.responses[name][rows], second.responses[name]
        if grows(trials.response(name)[second.trials], before, after):
            continue  # it never settles
        values = np.concatenate([trials.response(name), before, after])
        largest = np.nanmax(np.abs(before - after), initial=0.0)
        if largest > 0.0 and largest > FAR * np.ptp(values[np.isfinite(values)]):
            return True
    return False


def evaluated_again(
    study: Study, trials: Trials, selection: Selection, workers: Workers
) -> Audited | None:
    """Return selected trials evaluated more precisely; None if the model cannot."""
    return _evaluated(study, trials, selection, workers, 1)[0]


def _evaluated(
    study: Study, trials: Trials, selection: Selection, workers: Workers, times: int
) -> tuple[Audited | None, int]:
    """Return the same with settings tightened so many times, and the steps of all."""
    model = study.model
    tight = finer(model, study.settings, times)
    if tight is None:
        return None, 0
    before, after = dataclasses.asdict(study.settings), dataclasses.asdict(tight)
    cases = [
        part
        for case in cases_among(study.cases, selection.trials)
        for part in phased(
            case._replace(settings=finer(model, case.settings, times)), times
        )
    ]
    answers = workers.simulate_cases(model, cases, trials.deviations[selection.trials])
    names = [response.name for response in study.description.responses]
    again = Audited(
        selection.trials,
        {name: float(x) for name, x in after.items() if x != before[name]},
        answers.status.astype(np.uint8),
        dict(zip(names, answers.responses.T, strict=True)),
        selection.at_random,
        selection.reasons,
    )
    return again, 0 if answers.steps is None else int(answers.steps.sum())


def finer(model: Model, settings: Any, times: int = 1) -> Any | None:
    """Return the settings of an audit, or (2 times) of its third evaluation.

    That, and each after it (3 times, ...), has a shorter longest step again, and a less
    tight rtol than tightening twice gives: it takes twice the steps of an audit, which
    is enough to see its errors.
    """
    tight = tightened(model, settings, times)
    if times == 1 or tight is None or not model.integrates:
        return tight
    once: Any = tightened(model, settings)
    rtol = max(once.rtol / TIGHTER, tight.rtol)
    return dataclasses.replace(tight, rtol=rtol)


def phased(case: Case, times: int = 1) -> list[Case]:
    """Return a case in parts whose longest steps differ a little.

    With equal steps all trials may miss the same short event. In a third evaluation
    (2 `times`, or more) trials are few: every two have another longest step.
    """
    settings = case.settings
    if not isinstance(step := getattr(settings, "max_step", None), float):
        return [case]
    trials = case.stop - case.first
    parts = max(PARTS, trials // PARTS) if times == 1 else -(-trials // 2)
    ends = np.unique(np.linspace(case.first, case.stop, parts + 1).astype(int)).tolist()
    shorter = step * (1 - (np.arange(parts) + (times - 1) / 2) / (3 * parts))
    return [
        Case(first, stop, dataclasses.replace(settings, max_step=float(shorter[i])))
        for i, (first, stop) in enumerate(pairwise(ends))
    ]
