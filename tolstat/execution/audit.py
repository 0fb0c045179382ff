"""A hundredth of the trials again, evaluated much more precisely."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.streams import random_bits, unit_samples_of
from tolstat.execution.workers import Workers
from tolstat.model.checked import tightened
from tolstat.store.plan import Audited
from tolstat.study.points import Case
from tolstat.study.study import Study

EVERY = 100  # trials of which one is evaluated again


def audited_trials(seed: int, trials: int) -> NDArray[np.int64]:
    """Choose one trial at random of each hundred.

    Parameters
    ----------
    seed : int
        Of the study.
    trials : int
        Of the run.

    Returns
    -------
    int64[n]
        Ascending; asking for more trials leaves those of whole hundreds as they were.
    """
    first = np.arange(0, trials, EVERY)
    u = unit_samples_of(random_bits(seed, "audit", len(first)))
    found: NDArray[np.int64] = first + (u * np.minimum(EVERY, trials - first)).astype(
        np.int64
    )
    return found


def audit(
    study: Study, deviations: NDArray[np.float64], workers: Workers
) -> Audited | None:
    """Evaluate a hundredth of the trials more precisely.

    Parameters
    ----------
    study : Study
        Checked.
    deviations : float64[trial, contributor]
        Of the trials that ran, SI.
    workers : Workers
        Who evaluate.

    Returns
    -------
    Audited or None
        None for a machine that cannot be evaluated more precisely.

    Raises
    ------
    Interrupted
        If it was not to be finished.
    """
    tight = tightened(study.model, study.settings)
    if tight is None:
        return None
    trials = audited_trials(study.seed or 0, len(deviations))
    cases = _tightened(study, trials)
    found = workers.simulate_cases(study.model, cases, deviations[trials])
    names = [response.name for response in study.description.responses]
    return Audited(
        trials,
        tightening(study.settings, tight),
        found.status.astype(np.uint8),
        dict(zip(names, found.responses.T, strict=True)),
    )


def tightening(settings: Any, tight: Any) -> dict[str, float]:
    """Return the numbers that differ between two settings, by name."""
    return {
        field.name: float(getattr(tight, field.name))
        for field in dataclasses.fields(settings)
        if getattr(tight, field.name) != getattr(settings, field.name)
    }


def _tightened(study: Study, chosen: NDArray[np.int64]) -> list[Case]:
    """Return the cases of chosen trials, numbered among these, with tight settings."""
    found = []
    for case in study.cases:
        first, stop = np.searchsorted(chosen, (case.first, case.stop)).tolist()
        if stop > first:
            found.append(Case(first, stop, study.model.tightened(case.settings)))
    return found
