"""What a report wants beyond the trials: slopes, worst cases and trials, halvings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat.execution.diagnostics.halved_tolerances import halved_shares
from tolstat.execution.diagnostics.slopes_and_corners import (
    Target,
    slopes,
    worst_corners,
)
from tolstat.execution.diagnostics.trial_selection import margins, worst_trials
from tolstat.execution.planning import assumed_of
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Workers
from tolstat.status import Status
from tolstat.store.audited import Audited
from tolstat.store.stored_diagnostics import Diagnostics, Worst, WorstCase
from tolstat.study.study import Study

Array = NDArray[np.float64]


def gather(
    study: Study, trials: Trials, audited: Audited | None, workers: Workers
) -> Diagnostics:
    """Evaluate what a report wants beyond the trials; nothing where none were drawn."""
    if study.sampler is None:
        return Diagnostics(missing="no deviations were drawn")
    zones = _zones(study)
    slopes = _slopes(study, zones, workers)
    return Diagnostics(
        slopes,
        _worst_cases(study, trials, zones, slopes, workers),
        _worst(study, trials, audited),
        halved_shares(study, trials),
    )


def _zones(study: Study) -> dict[str, tuple[float, float]]:
    """Return the tolerance of each contributor that deviates, SI."""
    assumed = assumed_of(study.deviating)
    return {
        each.name: assumed[each.name].tolerance
        for each in study.description.contributors
        if each.name in assumed
    }


def _slopes(
    study: Study, zones: Mapping[str, tuple[float, float]], workers: Workers
) -> dict[str, dict[str, float]]:
    """Differentiate every response at the nominal machine."""
    contributors, responses = study.description
    ends = [zones.get(each.name, (0.0, 0.0)) for each in contributors]
    # of a normal part at Cp = 1: how far is usual
    usual = np.array([(upper - lower) / 6 for lower, upper in ends])
    if not np.any(usual > 0):
        return {}
    table = slopes(study.model, study.settings, usual, workers)
    return {
        response.name: {
            contributor.name: float(table[row, column])
            for row, contributor in enumerate(contributors)
            if usual[row] > 0
        }
        for column, response in enumerate(responses)
    }


def _worst_cases(
    study: Study,
    trials: Trials,
    zones: Mapping[str, tuple[float, float]],
    slopes: Mapping[str, Mapping[str, float]],
    workers: Workers,
) -> dict[str, dict[str, WorstCase]]:
    """Search the worst machines within the tolerances, for each end of each limit."""
    names = [contributor.name for contributor in study.description.contributors]
    responses = [response.name for response in study.description.responses]
    ends = np.array([zones.get(name, (0.0, 0.0)) for name in names])
    lower, upper = ends.reshape(-1, 2).T
    batches = study.deviating.dependence.batches
    factors: dict[str, list[int]] = {}
    for column, name in enumerate(names):
        if lower[column] < upper[column]:
            batch = batches.get(name)
            alike = batch.name if batch and batch.share == 1 else name
            factors.setdefault(alike, []).append(column)
    asked = [
        (name, sign)
        for name, limit in study.limits.items()
        for sign, end in ((-1, limit.lower), (1, limit.upper))
        if np.isfinite(end)
    ]
    if not factors or not asked:
        return {}
    targets = []
    for name, sign in asked:
        slope = np.array([slopes[name].get(each, 0.0) for each in names])
        steepest = _steepest(sign * slope, lower, upper, factors.values())
        starts = _worst_starts(sign * trials.response(name), trials, lower, upper)
        targets.append(
            Target(responses.index(name), sign, np.stack([*starts, steepest]))
        )
    corners = worst_corners(
        study.model, study.settings, lower, upper, list(factors.values()), targets,
        workers,
    )  # fmt: skip
    found: dict[str, dict[str, WorstCase]] = {}
    for (name, sign), corner in zip(asked, corners, strict=True):
        machine = dict(zip(names, corner.deviations.tolist(), strict=True))
        side = "largest" if sign > 0 else "least"
        case = WorstCase(corner.value, machine, corner.tried, corner.failed)
        found.setdefault(name, {})[side] = case
    return found


def _worst_starts(
    badness: Array, trials: Trials, lower: Array, upper: Array
) -> list[Array]:
    """Return the worst trial moved into the tolerances, and the worst within them."""
    done = np.where(trials.status == Status.DONE, badness, -np.inf)
    starts = [np.clip(trials.deviations[done.argmax()], lower, upper)]
    within = ((trials.deviations >= lower) & (trials.deviations <= upper)).all(axis=1)
    inside = np.where(within, done, -np.inf)
    if inside.max() > -np.inf:
        starts.append(trials.deviations[inside.argmax()])
    return starts


def _steepest(
    slope: Array, lower: Array, upper: Array, factors: Iterable[Sequence[int]]
) -> Array:
    """Return the corner that slopes at the nominal machine point to."""
    corner = lower.copy()
    for columns in map(list, factors):
        if np.nansum(slope[columns] * (upper - lower)[columns]) > 0:
            corner[columns] = upper[columns]
    return corner


def _worst(
    study: Study, trials: Trials, audited: Audited | None
) -> dict[str, list[Worst]]:
    """List the worst trials of each limited response, with the precise values."""
    chosen = {
        name: worst_trials(trials.response(name), trials.status, limit)
        for name, limit in study.limits.items()
    }
    found = {}
    for name, some in chosen.items():
        precise = np.full(len(some), np.nan)
        if audited is not None:
            places = np.searchsorted(audited.trials, some)
            precise = audited.responses[name][places]
        known = np.where(np.isnan(precise), trials.response(name)[some], precise)
        order = np.argsort(margins(known, study.limits[name]), kind="stable")
        found[name] = [Worst(some[i], float(precise[i])) for i in order]
    return found
