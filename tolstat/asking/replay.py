"""A stored trial again, from the same compiled code."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from tolstat import catalogue
from tolstat.asking.trajectory import STEP
from tolstat.errors import ModelError
from tolstat.model.checked import history_of, simulate
from tolstat.model.contract import Model, Outcome
from tolstat.model.settings import read, setting_of
from tolstat.model.view import Chart
from tolstat.store.provenance import processor
from tolstat.store.run import Run


class Replay(NamedTuple):
    """One machine of a run, simulated again.

    Attributes
    ----------
    deviations : dict of str to float
        By contributor, SI.
    outcome : Outcome
        Of this trial.
    word : str
        How it ended.
    history : Chart or None
        How it moved; None for a model that does not move.
    differences : tuple of str
        Responses that are not bit for bit as stored; also "status" and "steps".
    reason : str
        Why they may differ, if there is a reason.
    """

    deviations: dict[str, float]
    outcome: Outcome
    word: str
    history: Chart | None
    differences: tuple[str, ...]
    reason: str


def replay(run: Run, index: int | None, model: Model | None = None) -> Replay:
    """Simulate one machine of a run again and compare.

    Parameters
    ----------
    run : Run
        Stored.
    index : int or None
        Number of the trial, from 0; None for the nominal machine.
    model : Model, optional
        A machine of your own, if the run is of one.

    Returns
    -------
    Replay
        With what differs from the stored row, bit for bit.

    Raises
    ------
    ModelError
        If there is no such trial.
    """
    if index is not None and not 0 <= index < run.trials:
        raise ModelError(
            f"trial {index}: {run.path} has the trials 0 to {run.trials - 1}"
        )
    machine = catalogue.find(model or run.model)
    settings = read(machine, run.study.table.get("settings", {}))
    if index is not None:
        settings = replace(settings, **_swept(run, index, machine))
    names = [contributor.name for contributor in run.contributors]
    row = np.zeros(len(names))
    if index is not None:
        row = np.array([run.column(name)[index] for name in names])
    chart = None
    if machine.moves:
        chart, outcome = history_of(machine, row, settings, STEP)
    else:
        outcome = simulate(machine, row[None, :], settings)
    assert outcome.status is not None
    return Replay(
        dict(zip(names, row.tolist(), strict=True)),
        outcome,
        run.words.get(int(outcome.status[0]), "unknown"),
        chart,
        _differences(run, index, outcome),
        _reason(run, machine),
    )


def _swept(run: Run, index: int, model: Model) -> dict[str, Any]:
    """Read what a grid changed for one trial."""
    changes: dict[str, Any] = {}
    for name in run.swept:
        value, kind = run.column(name)[index].item(), setting_of(model, name).kind
        changes[name] = (
            kind.read(value) if isinstance(value, str) else kind.checked(value)
        )
    return changes


def _differences(run: Run, index: int | None, outcome: Outcome) -> tuple[str, ...]:
    """Name what is not bit for bit as stored."""
    different = []
    for place, response in enumerate(run.responses):
        name = response.name
        stored = run.nominal_values[name] if index is None else run.column(name)[index]
        found = outcome.responses[0, place]
        same = np.float64(found).tobytes() == np.float64(stored).tobytes()
        if not (same or (np.isnan(found) and np.isnan(stored))):
            different.append(name)
    if outcome.steps is not None and run.steps is not None:
        steps = run.nominal_values["steps"] if index is None else run.steps[index]
        if outcome.steps[0] != steps:
            different.append("steps")
    return tuple(different)


def _reason(run: Run, model: Model) -> str:
    """Say what could make a trial differ from the stored one."""
    if run.source_digest != model.source_digest:
        return (
            f"the run was made by tolstat {run.provenance['version_tolstat']} of "
            f"another source ({run.source_digest}, not {model.source_digest})"
        )
    if run.provenance["processor"] != processor():
        return f"the run was made on another processor ({run.provenance['processor']})"
    return ""
