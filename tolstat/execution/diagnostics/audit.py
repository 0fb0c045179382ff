"""Some trials again, evaluated much more precisely."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.execution.diagnostics.audit_selection import (
    Choice,
    choose,
    choose_in_reach,
    random_trials,
)
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Workers
from tolstat.model.checked import tightened
from tolstat.store.audited import Audited, joined
from tolstat.study.given_points import cases_among
from tolstat.study.study import Study


def audit(study: Study, trials: Trials, workers: Workers) -> Audited | None:
    """Evaluate some trials more precisely.

    First those of `choose`; then, once it is known how large errors are, what they may
    carry across a limit, so that the share of machines beyond can be trusted. None for
    a machine that cannot be evaluated more precisely.
    """
    tight = tightened(study.model, study.settings)
    if tight is None:
        return None
    numbers = tightening(study.settings, tight)
    if study.sampler is None:
        # machines of a grid or a table were chosen by the user: nothing is rare there
        chosen = random_trials(study.seed or 0, len(trials.deviations))
        choice = Choice(chosen, np.ones(len(chosen), bool), {})
        return _audited(study, trials, choice, numbers, workers)
    choice = choose(trials, study.limits, study.seed or 0)
    found = _audited(study, trials, choice, numbers, workers)
    errors = {name: _largest_error(trials, found, name) for name in study.limits}
    more = choose_in_reach(trials, study.limits, choice, errors)
    if not len(more.trials):
        return found
    return joined(found, _audited(study, trials, more, numbers, workers))


def evaluated_again(
    study: Study, trials: Trials, chosen: NDArray[np.int64], workers: Workers
) -> Audited | None:
    """Evaluate chosen trials more precisely; None for a machine that cannot be."""
    tight = tightened(study.model, study.settings)
    if tight is None:
        return None
    choice = Choice(chosen, np.zeros(len(chosen), bool), {})
    return _audited(study, trials, choice, tightening(study.settings, tight), workers)


def _audited(
    study: Study,
    trials: Trials,
    choice: Choice,
    numbers: dict[str, float],
    workers: Workers,
) -> Audited:
    """Evaluate chosen trials more precisely."""
    chosen, at_random, chosen_by = choice
    cases = [
        case._replace(settings=study.model.tightened(case.settings))
        for case in cases_among(study.cases, chosen)
    ]
    found = workers.simulate_cases(study.model, cases, trials.deviations[chosen])
    names = [response.name for response in study.description.responses]
    return Audited(
        chosen,
        numbers,
        found.status.astype(np.uint8),
        dict(zip(names, found.responses.T, strict=True)),
        at_random,
        chosen_by,
    )


def _largest_error(trials: Trials, audited: Audited, name: str) -> float:
    errors = np.abs(trials.response(name)[audited.trials] - audited.responses[name])
    known = errors[np.isfinite(errors)]
    return float(known.max()) if len(known) else np.nan


def tightening(settings: Any, tight: Any) -> dict[str, float]:
    """Return the numbers that differ between two settings, by name."""
    return {
        field.name: float(getattr(tight, field.name))
        for field in dataclasses.fields(settings)
        if getattr(tight, field.name) != getattr(settings, field.name)
    }
