"""A stored trial again, from the same compiled code."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from tolstat import catalogue
from tolstat.answers.views.trajectory import STEP
from tolstat.errors import ModelError
from tolstat.model.checked import history_of, simulate
from tolstat.model.contract import Answers, Model
from tolstat.model.settings import as_typed, read, setting_of
from tolstat.model.view import Chart
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.given_points import setting_name
from tolstat.study.links_section import settings_with_links


class Replay(NamedTuple):
    """One machine of a run, simulated again.

    Attributes
    ----------
    deviations : dict of str to float
        By contributor, SI.
    outcome : Answers
        Of this trial.
    word : str
        How it ended.
    history : Chart or None
        How it moved; None for a model that does not move.
    differences : tuple of str
        What is not as stored: responses, bit for bit; "status", "steps".
    reason : str
        Why they may differ, if there is a reason.
    """

    deviations: dict[str, float]
    outcome: Answers
    word: str
    history: Chart | None
    differences: tuple[str, ...]
    reason: str


def replay(
    run: Run | str | os.PathLike[str], index: int | None, model: Model | None = None
) -> Replay:
    """Simulate one machine of a run again and compare.

    Parameters
    ----------
    run : Run or path
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
    run = run if isinstance(run, Run) else open_run(run, damaged=True)
    if index is not None and not 0 <= index < run.trials:
        raise ModelError(
            f"trial {index}: {run.path} has the trials 0 to {run.trials - 1}"
        )
    machine = catalogue.find(model or run.model)
    settings = read(machine, settings_with_links(run.study.table, machine))
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
    return Replay(
        dict(zip(names, row.tolist(), strict=True)),
        outcome,
        run.words.get(int(outcome.status[0]), "unknown"),
        chart,
        _differences(run, index, outcome),
        "; ".join(run.made_otherwise(machine.source_digest)),
    )


def _swept(run: Run, index: int, model: Model) -> dict[str, Any]:
    """Read what a grid changed for one trial."""
    changes: dict[str, Any] = {}
    for swept in run.swept:
        column = swept.name
        name = setting_name(column)
        value, kind = run.column(column)[index].item(), setting_of(model, name).kind
        if isinstance(value, str):
            typed = run.study.table["grid"][name]
            changes[name] = kind.read(next(t for t in typed if as_typed(t) == value))
        else:
            changes[name] = kind.checked(value)
    return changes


def _differences(run: Run, index: int | None, outcome: Answers) -> tuple[str, ...]:
    """Name what is not bit for bit as stored."""
    different = []
    for place, response in enumerate(run.responses):
        name = response.name
        stored = run.nominal_values[name] if index is None else run.column(name)[index]
        found = outcome.responses[0, place]
        same = np.float64(found).tobytes() == np.float64(stored).tobytes()
        if not (same or (np.isnan(found) and np.isnan(stored))):
            different.append(name)
    word = run.nominal_values["status"] if index is None else run.ended_as(index)
    if run.words.get(int(outcome.status[0])) != word:
        different.append("status")
    if outcome.steps is not None and run.steps is not None:
        steps = run.nominal_values["steps"] if index is None else run.steps[index]
        if outcome.steps[0] != steps:
            different.append("steps")
    return tuple(different)
