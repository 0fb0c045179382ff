"""Diagnostics of a run: slopes, worst cases, halved tolerances, idle contributors."""

from collections.abc import Sequence

import numpy as np

from tolstat.arrays import Array
from tolstat.execution.diagnostics.halved_tolerances import halved_shares
from tolstat.execution.diagnostics.idle_contributors import idle_contributors
from tolstat.execution.diagnostics.slopes_and_corners import (
    Target,
    slopes,
    slopes_by_name,
    tolerance_ends,
    worst_corners,
)
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.status import Status
from tolstat.store.run_records import Diagnostics, WorstCase
from tolstat.study.study import Study


def diagnostics_of(study: Study, trials: Trials, workers: Workers) -> Diagnostics:
    """Return the diagnostics of a run; none if no deviations were sampled."""
    if study.sampler is None:
        return Diagnostics(missing="no deviations were drawn")
    lower, upper = tolerance_ends(study)
    usual = (upper - lower) / 6  # sigma of a normal part at Cp = 1
    table = slopes(study.model, study.settings, usual, workers)
    by_name = slopes_by_name(study, table, usual > 0)
    return Diagnostics(
        by_name,
        _worst_cases(study, trials, lower, upper, table, workers),
        workers.call(halved_shares, study, trials, by_name),
        idle_contributors(study, trials, lower, upper, table, workers),
    )


def _worst_cases(
    study: Study,
    trials: Trials,
    lower: Array,
    upper: Array,
    slopes: Array,
    workers: Workers,
) -> dict[str, dict[str, WorstCase]]:
    """Return the worst trials within the tolerances, for each end of each limit."""
    names = [contributor.name for contributor in study.description.contributors]
    responses = [response.name for response in study.description.responses]
    batches = study.deviating.dependence.batches
    factors: dict[str, list[int]] = {}  # columns that change together
    for column in np.flatnonzero(lower < upper).tolist():
        batch = batches.get(names[column])
        factor = batch.name if batch and batch.share == 1 else names[column]
        factors.setdefault(factor, []).append(column)
    ends_of_limits = [
        (name, sign)
        for name, limit in study.limits.items()
        for sign, end in ((-1, limit.lower), (1, limit.upper))
        if np.isfinite(end)
    ]
    if not factors or not ends_of_limits:
        return {}
    groups, targets = list(factors.values()), []
    for name, sign in ends_of_limits:
        column = responses.index(name)
        starts = _worst_starts(sign * trials.responses[:, column], trials, lower, upper)
        starts.append(_steepest(sign * slopes[:, column], lower, upper, groups))
        targets.append(Target(column, sign, np.stack(starts)))
    corners = worst_corners(
        study.model, study.settings, lower, upper, groups, targets, workers
    )
    worst_cases: dict[str, dict[str, WorstCase]] = {}
    for (name, sign), corner in zip(ends_of_limits, corners, strict=True):
        trial = dict(zip(names, corner.deviations.tolist(), strict=True))
        side = "largest" if sign > 0 else "least"
        worst_cases.setdefault(name, {})[side] = WorstCase(
            corner.value, trial, corner.tried, corner.failed
        )
    return worst_cases


def _worst_starts(
    badness: Array, trials: Trials, lower: Array, upper: Array
) -> list[Array]:
    """Return the worst trial moved into the tolerances, and the worst inside them."""
    done = np.where(trials.status == Status.DONE, badness, -np.inf)
    starts = [np.clip(trials.deviations[done.argmax()], lower, upper)]
    within = ((trials.deviations >= lower) & (trials.deviations <= upper)).all(axis=1)
    inside = np.where(within, done, -np.inf)
    if inside.max() > -np.inf:
        starts.append(trials.deviations[inside.argmax()])
    return starts


def _steepest(
    slope: Array, lower: Array, upper: Array, factors: Sequence[list[int]]
) -> Array:
    """Return the worst corner according to the slopes at the nominal trial."""
    corner = lower.copy()
    for columns in factors:
        if np.nansum(slope[columns] * (upper - lower)[columns]) > 0:
            corner[columns] = upper[columns]
    return corner
