"""One trial simulated again: its deviations, its responses, how it moved."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from tolstat import catalogue
from tolstat.answers.answer import Answer
from tolstat.answers.next_steps import to_resume
from tolstat.document.blocks import Block, Column, Document, Figure, paragraph, table
from tolstat.document.inline import Name, Number, Parts, Typed, listed
from tolstat.errors import ModelError, RunFileError
from tolstat.model.checked import history_of, simulate
from tolstat.model.contract import STEP, Answers, Model
from tolstat.model.description import Response
from tolstat.model.setting_kinds import as_typed
from tolstat.model.settings import read, setting_of
from tolstat.model.view import Chart
from tolstat.render.tables import Row
from tolstat.statistics.limits.limit import Limit
from tolstat.status import Status, words_of
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.given_points import setting_name
from tolstat.study.links_section import settings_with_links
from tolstat.study.study import Study
from tolstat.units.scale import Scale, scale_of


class Quantity(NamedTuple):
    """A setting, a deviation or a response of one trial."""

    value: float | str  # SI
    scale: Scale  # how it is shown
    sentence: str = ""  # what it is
    limit: str = ""  # of a response, in words; empty where it has none
    out_of_limit: bool = False

    @property
    def number(self) -> Number | str:
        """The value, and how it is shown."""
        value = self.value
        return value if isinstance(value, str) else Number(value, self.scale)

    @property
    def words(self) -> Parts:
        """The value with its unit."""
        if isinstance(self.value, float) and math.isnan(self.value):
            return ("failed",)
        return "", self.number  # a number alone would leave its unit to the head


@dataclass(frozen=True, repr=False)
class Replay(Answer):
    """One trial of a run simulated again, or the nominal trial."""

    title: str  # of the run or the study, and which trial
    trial: int | None  # None for the nominal one
    status: str  # how it ended
    steps: int | None  # None where nothing is integrated
    settings: dict[str, Quantity]  # what a grid changed for it
    deviations: dict[str, float]  # by contributor, SI
    responses: dict[str, Quantity]
    stored: bool = False  # whether there is a stored row to compare with
    # what is not as stored, bit for bit: responses, "status", "steps"
    differences: tuple[str, ...] = ()
    reason: str = ""  # why they may differ, if there is a reason
    damage: str = ""  # what of the run is damaged
    repair: str = field(default="", metadata={"json": False})
    contributors: dict[str, Quantity] = field(
        default_factory=dict, metadata={"json": False}
    )
    # how it moved; None for a model that does not move
    history: Chart | None = field(default=None, metadata={"json": False})
    answers = "trial"
    index = "name"

    @property
    def short(self) -> str:
        """Which trial, and how it ended."""
        return f"{self.title}: {self.status}"

    def document(self) -> Document:
        """Return what deviates, what it answers, and whether that is as stored."""
        moved = {name: each for name, each in self.contributors.items() if each.value}
        inputs = [
            (Name(name), each.words, each.sentence)
            for name, each in (self.settings | moved).items()
        ]
        answered = [
            (Name(name), each.words,
             each.limit + (": out of limit" if each.out_of_limit else ""))
            for name, each in self.responses.items()
        ]  # fmt: skip
        limit, sentence = Column("limit", words=True), Column("", words=True)
        blocks: list[Block] = [table(("response", "value", limit), answered)]
        if inputs:
            heads = "contributor", "deviation", sentence
            blocks.insert(0, table(heads, inputs))
        if self.differences:
            why = f": {self.reason}" if self.reason else ""
            said = f"not bit for bit as stored{why}; different: "
            blocks.append(paragraph(said, listed(self.differences, "")))
        elif self.stored:
            blocks.append(paragraph("bit for bit as stored"))
        if self.damage:
            said = f"the run is damaged: {self.damage}. Repair it with: "
            blocks.append(paragraph(said, Typed(self.repair)))
        if self.history:
            blocks.append(Figure("its histories", self.history, wide=True))
        steps = f", {self.steps} steps" if self.steps is not None else ""
        return Document(f"{self.title}: {self.status}{steps}", tuple(blocks))

    def rows(self) -> list[Row]:
        """Return deviations and responses, a row for each."""
        kinds = ("setting", self.settings), ("deviation", self.contributors)
        return [
            {
                "name": name, "kind": kind, "unit": each.scale.mark,
                "value [unit]": each.number, "limit": each.limit,
                "out of limit": int(each.out_of_limit),
            }
            for kind, some in (*kinds, ("response", self.responses))
            for name, each in some.items()
        ]  # fmt: skip


def replay(
    run: Run | str | os.PathLike[str], index: int | None, model: Model | None = None
) -> Replay:
    """Simulate one trial of a run again and compare.

    Parameters
    ----------
    run : Run or path
        Stored.
    index : int or None
        Number of the trial, from 0; None for the nominal one.
    model : Model, optional
        A custom model, if the run is of one.

    Returns
    -------
    Replay
        With what differs from the stored row, bit for bit.

    Raises
    ------
    ModelError
        If there is no such trial.
    RunFileError
        If it has not run.
    """
    run = run if isinstance(run, Run) else open_run(run, damaged=True)
    if index is not None and not 0 <= index < run.trials:
        raise ModelError(
            f"trial {index}: {run.path} has the trials 0 to {run.trials - 1}"
        )
    if index is not None and run.status[index] == Status.NOT_RUN:
        raise RunFileError(f"{run.path}: trial {index} has not run")
    machine = catalogue.find(model or run.model)
    settings = read(machine, settings_with_links(run.study.table, machine))
    swept, row = dict[str, Quantity](), np.zeros(len(run.contributors))
    if index is not None:
        settings = replace(settings, **_swept(run, index, machine))
        for name in (each.name for each in run.swept):
            value = run.column(name)[index].item()
            swept[name] = Quantity(value, run.scales[name])
        row = np.array([run.column(each.name)[index] for each in run.contributors])
    chart, outcome = _simulated(machine, row, settings)
    contributors = {
        part.name: Quantity(at, run.scales[part.name], part.sentence)
        for part, at in zip(run.contributors, row.tolist(), strict=True)
    }
    return Replay(
        f"{run.title}: {'nominal trial' if index is None else f'trial {index}'}",
        index,
        run.words.get(int(outcome.status[0]), "unknown"),
        _steps(outcome),
        swept,
        dict(zip(contributors, row.tolist(), strict=True)),
        _responses(run.responses, outcome, run.limits, run.scales),
        stored=True,
        differences=tuple(_differences(run, index, outcome)),
        reason="; ".join(run.made_otherwise(machine.source_digest)),
        damage=run.damage.words if run.damage else "",
        repair=to_resume(run.path, run.machine),
        contributors=contributors,
        history=chart,
    )


def nominal_trial(study: Study) -> Replay:
    """Simulate the trial without deviations of a study."""
    contributors, responses = study.description
    nominal = np.zeros(len(contributors))
    chart, outcome = _simulated(study.model, nominal, study.settings)
    scales = {}
    for each, value in zip(responses, outcome.responses[0].tolist(), strict=True):
        scale = scale_of(
            each.unit, study.shown.get(each.name) or each.shown, abs(value)
        )
        limit = study.limits.get(each.name)
        scales[each.name] = scale.telling(0.0, limit.asked if limit else ())
    return Replay(
        f"{study.title}: nominal trial",
        None,
        words_of(study.model.failures)[int(outcome.status[0])],
        _steps(outcome),
        {},
        {part.name: 0.0 for part in contributors},
        _responses(responses, outcome, study.limits, scales),
        history=chart,
    )


def _simulated(
    model: Model, row: np.ndarray[Any, np.dtype[np.float64]], settings: Any
) -> tuple[Chart | None, Answers]:
    if model.moves:
        return history_of(model, row, settings, STEP)
    return None, simulate(model, row[None, :], settings)


def _steps(outcome: Answers) -> int | None:
    return None if outcome.steps is None else int(outcome.steps[0])


def _responses(
    responses: tuple[Response, ...],
    outcome: Answers,
    limits: dict[str, Limit],
    scales: dict[str, Scale],
) -> dict[str, Quantity]:
    found = {}
    for each, value in zip(responses, outcome.responses[0].tolist(), strict=True):
        words, out = "", False
        if limit := limits.get(each.name):
            words, out = limit.words, not limit.lower <= value <= limit.upper
        found[each.name] = Quantity(value, scales[each.name], each.sentence, words, out)
    return found


def _swept(run: Run, index: int, model: Model) -> dict[str, Any]:
    """Read what a grid changed for one trial."""
    changes: dict[str, Any] = {}
    for swept in run.swept:
        name = setting_name(swept.name)
        value, kind = run.column(swept.name)[index].item(), setting_of(model, name).kind
        if isinstance(value, str):
            typed = run.study.table["grid"][name]
            changes[name] = kind.read(next(t for t in typed if as_typed(t) == value))
        else:
            changes[name] = kind.checked(value)
    return changes


def _differences(run: Run, index: int | None, outcome: Answers) -> Iterator[str]:
    """Name what is not bit for bit as stored."""
    stored = run.nominal_values
    if index is not None:
        stored = {each.name: run.column(each.name)[index] for each in run.responses}
        stored["status"] = run.ended_as(index)
        stored["steps"] = None if run.steps is None else run.steps[index]
    for response, found in zip(run.responses, outcome.responses[0], strict=True):
        known = np.float64(stored[response.name])
        both = np.isnan(found) and np.isnan(known)
        if not both and np.float64(found).tobytes() != known.tobytes():
            yield response.name
    if run.words.get(int(outcome.status[0])) != stored["status"]:
        yield "status"
    steps = stored.get("steps")
    if None not in (steps, _steps(outcome)) and steps != _steps(outcome):
        yield "steps"
