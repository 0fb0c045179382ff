"""Some trials again, evaluated much more precisely."""

from __future__ import annotations

import dataclasses

import numpy as np

from tolstat.execution.diagnostics.trial_selection import (
    Choice,
    choose,
    choose_in_reach,
    random_trials,
)
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Workers
from tolstat.model.checked import tightened
from tolstat.store.run_records import Audited, joined
from tolstat.study.given_points import cases_among
from tolstat.study.study import Study


def audit(study: Study, trials: Trials, workers: Workers) -> Audited | None:
    """Evaluate some trials more precisely; None for a model that cannot be.

    First those of `choose`; then, once it is known how large errors are, what they may
    carry across a limit, so that the fraction out of limit can be trusted. Of a grid or
    a table, which the user chose, one of each hundred.
    """
    seed = study.seed or 0
    if study.sampler is None:
        chosen = random_trials(seed, len(trials.deviations))
        return evaluated_again(study, trials, Choice(chosen, chosen >= 0, {}), workers)
    choice = choose(trials, study.limits, seed)
    found = evaluated_again(study, trials, choice, workers)
    if found is None:
        return None
    errors = {name: _largest_error(trials, found, name) for name in study.limits}
    more = choose_in_reach(trials, study.limits, choice, errors)
    further = (
        evaluated_again(study, trials, more, workers) if len(more.trials) else None
    )
    return joined(found, further) if further else found


def evaluated_again(
    study: Study, trials: Trials, choice: Choice, workers: Workers
) -> Audited | None:
    """Evaluate chosen trials more precisely; None for a model that cannot be."""
    tight = tightened(study.model, study.settings)
    if tight is None:
        return None
    before, now = dataclasses.asdict(study.settings), dataclasses.asdict(tight)
    cases = [
        case._replace(settings=study.model.tightened(case.settings))
        for case in cases_among(study.cases, choice.trials)
    ]
    rows = trials.deviations[choice.trials]
    found = workers.simulate_cases(study.model, cases, rows)
    names = [response.name for response in study.description.responses]
    return Audited(
        choice.trials,
        {name: float(now[name]) for name in now if now[name] != before[name]},
        found.status.astype(np.uint8),
        dict(zip(names, found.responses.T, strict=True)),
        choice.at_random,
        choice.chosen_by,
    )


def _largest_error(trials: Trials, audited: Audited, name: str) -> float:
    errors = np.abs(trials.response(name)[audited.trials] - audited.responses[name])
    known = errors[np.isfinite(errors)]
    return float(known.max()) if len(known) else np.nan
