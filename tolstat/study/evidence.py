"""Further simulations for the report of a run: slopes, worst case, worst trials."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat import catalogue
from tolstat.errors import ModelError
from tolstat.lanes.cache import source_digest
from tolstat.machines.description import Model, MovingModel
from tolstat.statistics.evidence import Evidence, Worst, WorstCase
from tolstat.status import Status
from tolstat.store.run import Run
from tolstat.study.audit import tightened
from tolstat.study.classical import Target, slopes, worst_corners
from tolstat.study.parallel import processors, simulate_all
from tolstat.study.replay import settings_of
from tolstat.study.trajectory import history_of

Array = NDArray[np.float64]

WORST = 10  # trials of each limited response
SKETCHED = 1e-3  # s, between two points of a small picture


def gather(run: Run, model: Model | None = None) -> Evidence:
    """Simulate what the report of a run wants to know beyond its trials.

    Parameters
    ----------
    run : Run
        Whose machines were drawn.
    model : Model, optional
        A machine of your own, if the run is of one.

    Returns
    -------
    Evidence
        Empty, with the reason, for a model that is not at hand or a grid.
    """
    try:
        machine = model or catalogue.find(str(run.facts["model"]))
    except ModelError:
        return Evidence(
            missing=f"the model '{run.facts['model']}' is not in the catalogue"
        )
    if run.facts["source_digest"] != source_digest():
        return Evidence(
            missing="the run was made by another source "
            f"(tolstat {run.facts['version_tolstat']}); run the study again"
        )
    if not run.assumed or "promise" not in run.facts:
        return Evidence(missing="no deviations were drawn")
    settings = settings_of(run, machine)
    columns = [contributor.name for contributor in run.contributors]
    drawn = np.column_stack([run.column(name) for name in columns])
    worst = {name: worst_trials(run, name) for name in run.limits}
    tight = tightened(settings)
    return Evidence(
        _slopes(run, machine, settings),
        _worst_cases(run, machine, settings, drawn),
        _again(run, machine, tight, drawn, worst),
        _histories(machine, settings, drawn, worst),
        None if tight is None else tight.rtol,
    )


def worst_trials(run: Run, response: str) -> list[int]:
    """Return the ten trials nearest to, or farthest beyond, a limit; the worst first.

    Parameters
    ----------
    run : Run
        With a limit for the response.
    response : str
        Its name.
    """
    lower, upper = run.limits[response]
    values = run.column(response)
    with np.errstate(invalid="ignore"):
        margin = np.minimum(upper - values, values - lower)
    margin[run.status != Status.DONE] = np.inf
    order: list[int] = np.argsort(margin, kind="stable")[:WORST].tolist()
    return [trial for trial in order if margin[trial] < np.inf]


def _slopes(run: Run, model: Model, settings: Any) -> dict[str, dict[str, float]]:
    """Differentiate every response at the nominal machine."""
    zones = [
        run.assumed[each.name].tolerance if each.name in run.assumed else (0.0, 0.0)
        for each in run.contributors
    ]
    lower, upper = np.array(zones).T
    deviation = (upper - lower) / 6  # of a normal part at Cp = 1: how far is usual
    table = slopes(model, settings, deviation)
    return {
        response.name: {
            contributor.name: float(table[row, column])
            for row, contributor in enumerate(run.contributors)
            if deviation[row] > 0
        }
        for column, response in enumerate(run.responses)
        if np.any(deviation > 0)
    }


def _worst_cases(
    run: Run,
    model: Model,
    settings: Any,
    drawn: Array,
) -> dict[str, list[WorstCase]]:
    """Search the worst corners of the tolerances, for each end of each limit."""
    names = [contributor.name for contributor in run.contributors]
    zones = [run.assumed[n].tolerance if n in run.assumed else (0, 0) for n in names]
    lower, upper = np.array(zones, dtype=float).T
    factors: dict[str, list[int]] = {}
    for column, name in enumerate(names):
        if name in run.assumed and lower[column] < upper[column]:
            factors.setdefault(run.assumed[name].batch or name, []).append(column)
    responses = [response.name for response in run.responses]
    asked = [
        (name, sign)
        for name, (least, most) in run.limits.items()
        for sign, end in ((-1, least), (1, most))
        if np.isfinite(end)
    ]
    targets = []
    for name, sign in asked:
        # from the trial nearest to it, moved into the tolerances
        values = sign * run.column(name)
        values[run.status != Status.DONE] = -np.inf
        start = np.clip(drawn[values.argmax()], lower, upper)
        targets.append(Target(responses.index(name), sign, start))
    if not factors or not targets:
        return {}
    found: dict[str, list[WorstCase]] = {}
    corners = worst_corners(
        model, settings, lower, upper, list(factors.values()), targets
    )
    for (name, sign), corner in zip(asked, corners, strict=True):
        machine = dict(zip(names, corner.deviations.tolist(), strict=True))
        side = "largest" if sign > 0 else "least"
        case = WorstCase(side, corner.value, machine, corner.tried, corner.failed)
        found.setdefault(name, []).append(case)
    return found


def _again(
    run: Run,
    model: Model,
    tight: Any | None,
    drawn: Array,
    worst: dict[str, list[int]],
) -> dict[str, list[Worst]]:
    """Integrate the worst trials again, more precisely, and put them in order."""
    trials = _all_of(worst)
    if not trials:
        return {name: [] for name in worst}
    again = np.full((len(trials), len(run.responses)), np.nan)
    if tight is not None:
        again = simulate_all(model, drawn[trials], tight).responses
    found = {}
    for name, chosen in worst.items():
        column = [response.name for response in run.responses].index(name)
        each = [
            Worst(
                trial,
                float(run.column(name)[trial]),
                float(again[trials.index(trial), column]),
            )
            for trial in chosen
        ]
        lower, upper = run.limits[name]

        def margin(w: Worst, lower: float = lower, upper: float = upper) -> float:
            known = w.value if np.isnan(w.precise) else w.precise
            return min(upper - known, known - lower)

        found[name] = sorted(each, key=margin)
    return found


def _histories(
    model: Model, settings: Any, drawn: Array, worst: dict[str, list[int]]
) -> dict[int, Any]:
    """Tell how the worst trials moved."""
    if not isinstance(model, MovingModel):
        return {}
    trials = _all_of(worst)

    def one(trial: int) -> Any:
        return history_of(model, drawn[trial], settings, SKETCHED)

    with ThreadPoolExecutor(processors()) as executor:
        return dict(zip(trials, executor.map(one, trials), strict=True))


def _all_of(worst: dict[str, list[int]]) -> list[int]:
    trials: Sequence[int] = sorted({t for chosen in worst.values() for t in chosen})
    return list(trials)
