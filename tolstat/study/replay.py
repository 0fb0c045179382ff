"""A stored trial again, from the same compiled code."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import catalogue
from tolstat.errors import ModelError
from tolstat.lanes.cache import source_digest
from tolstat.machines.description import History, Model, MovingModel, Outcome
from tolstat.machines.settings import checked, field_of
from tolstat.store.provenance import processor
from tolstat.store.run import Run
from tolstat.study.evaluate import simulate
from tolstat.study.settings import read_setting
from tolstat.study.trajectory import history_of


class Replay(NamedTuple):
    """One machine of a run, simulated again.

    Attributes
    ----------
    deviations : dict of str to float
        By contributor, SI.
    outcome : Outcome
        Of this trial.
    history : History or None
        How it moved; None for a model that does not move.
    differences : tuple of str
        Responses that are not bit for bit as stored; also "status" and "steps".
    reason : str
        Why they may differ, if there is a reason.
    """

    deviations: dict[str, float]
    outcome: Outcome
    history: History | None
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
    machine = model or catalogue.find(str(run.facts["model"]))
    changes = {} if index is None else _changes(run, index, machine)
    settings = replace(settings_of(run, machine), **changes)
    names = [contributor.name for contributor in run.contributors]
    row = np.zeros(len(names))
    if index is not None:
        row = np.array([run.column(name)[index] for name in names])
    history = None
    if isinstance(machine, MovingModel):
        history = history_of(machine, row, settings)
        outcome = history.outcome
    else:
        outcome = simulate(machine, row[None, :], settings)
    return Replay(
        dict(zip(names, row.tolist(), strict=True)),
        outcome,
        history,
        _differences(run, index, outcome),
        _reason(run),
    )


def settings_of(run: Run, model: Model) -> Any:
    """Read the settings of a run from its own study.

    Parameters
    ----------
    run : Run
        Stored.
    model : Model
        Of the run.
    """
    given = run.study.table.get("settings", {})
    return model.settings(**{n: read_setting(model, n, v) for n, v in given.items()})


def _changes(run: Run, index: int, model: Model) -> dict[str, Any]:
    """Read what a grid changed for one trial."""
    changes: dict[str, Any] = {}
    for name in run.settings:
        value = run.column(name)[index].item()
        if isinstance(value, str):
            changes[name] = read_setting(model, name, value)
        else:
            changes[name] = checked(field_of(model, name), value)
    return changes


def _differences(run: Run, index: int | None, outcome: Outcome) -> tuple[str, ...]:
    """Name what is not bit for bit as stored."""
    stored: dict[str, Any] = {}
    names = [response.name for response in run.responses]
    for name in names:
        nominal = index is None
        stored[name] = run.nominal_values[name] if nominal else run.column(name)[index]
    found: NDArray[np.float64] = outcome.responses[0]
    different = [
        name
        for name, value in zip(names, found, strict=True)
        if np.float64(value).tobytes() != np.float64(stored[name]).tobytes()
        and not (np.isnan(value) and np.isnan(stored[name]))
    ]
    steps = run.nominal_values["steps"] if index is None else run.column("steps")[index]
    if outcome.steps is not None and outcome.steps[0] != steps:
        different.append("steps")
    return tuple(different)


def _reason(run: Run) -> str:
    """Say what could make a trial differ from the stored one."""
    if run.facts["source_digest"] != source_digest():
        return (
            f"the run was made by tolstat {run.facts['version_tolstat']} of another "
            f"source ({run.facts['source_digest']}, not {source_digest()})"
        )
    if run.facts["processor"] != processor():
        return f"the run was made on another processor ({run.facts['processor']})"
    return ""
