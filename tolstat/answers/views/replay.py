"""One trial simulated again: its deviations, its responses, how it moved."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from tolstat import catalogue
from tolstat.answers.answer import Answer
from tolstat.answers.next_steps import to_resume
from tolstat.answers.views.trajectory import STEP
from tolstat.document.blocks import Block, Column, Document, Figure, paragraph, table
from tolstat.document.inline import Name, Number, Parts, Typed, listed
from tolstat.errors import ModelError, RunFileError
from tolstat.model.checked import history_of, simulate
from tolstat.model.contract import Answers, Model
from tolstat.model.description import Response
from tolstat.model.settings import as_typed, read, setting_of
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
    """A setting, a deviation or a response of one trial.

    Attributes
    ----------
    value : float or str
        SI.
    scale : Scale
        How it is shown.
    sentence : str
        What it is.
    limit : str
        Of a response, in words; empty where it has none.
    out_of_limit : bool
        Whether it is outside.
    """

    value: float | str
    scale: Scale
    sentence: str = ""
    limit: str = ""
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
    """One trial of a run simulated again, or the nominal trial.

    Attributes
    ----------
    title : str
        Of the run or the study, and which trial.
    trial : int or None
        Its number; None for the nominal one.
    status : str
        How it ended.
    steps : int or None
        Of the integration; None where nothing is integrated.
    settings : dict of str to Quantity
        What a grid changed for it.
    deviations : dict of str to float
        By contributor, SI.
    responses : dict of str to Quantity
        By name.
    stored : bool
        Whether there is a stored row to compare with.
    differences : tuple of str
        What is not as stored: responses, bit for bit; "status", "steps".
    reason : str
        Why they may differ, if there is a reason.
    damage : str
        What of the run is damaged.
    history : Chart or None
        How it moved; None for a model that does not move.
    """

    title: str
    trial: int | None
    status: str
    steps: int | None
    settings: dict[str, Quantity]
    deviations: dict[str, float]
    responses: dict[str, Quantity]
    stored: bool = False
    differences: tuple[str, ...] = ()
    reason: str = ""
    damage: str = ""
    repair: str = field(default="", metadata={"json": False})
    contributors: dict[str, Quantity] = field(
        default_factory=dict, metadata={"json": False}
    )
    history: Chart | None = field(default=None, metadata={"json": False})
    answers = "trial"
    index = "name"

    @property
    def short(self) -> str:
        """Which trial, and how it ended."""
        return f"{self.title}: {self.status}"

    def document(self) -> Document:
        """Return what deviates, what it answers, and whether that is as stored."""
        steps = f", {self.steps} steps" if self.steps is not None else ""
        title = f"{self.title}: {self.status}{steps}"
        blocks = [*self._inputs(), self._answered(), *self._compared()]
        if self.history:
            blocks.append(Figure("its histories", self.history, wide=True))
        return Document(title, tuple(blocks))

    def _inputs(self) -> list[Block]:
        moved = {name: each for name, each in self.contributors.items() if each.value}
        rows = [
            (Name(name), each.words, each.sentence)
            for name, each in [*self.settings.items(), *moved.items()]
        ]
        columns = "contributor", "deviation", Column("", words=True)
        return [table(columns, rows)] if rows else []

    def _answered(self) -> Block:
        rows = [
            (Name(name), each.words,
             each.limit + (": out of limit" if each.out_of_limit else ""))
            for name, each in self.responses.items()
        ]  # fmt: skip
        return table(("response", "value", Column("limit", words=True)), rows)

    def _compared(self) -> list[Block]:
        if not self.stored:
            return []
        said = [paragraph("bit for bit as stored")]
        if self.differences:
            why = f": {self.reason}" if self.reason else ""
            said = [
                paragraph(
                    f"not bit for bit as stored{why}; different: ",
                    listed(self.differences, ""),
                )
            ]
        if self.damage:
            said.append(
                paragraph(
                    f"the run is damaged: {self.damage}. Repair it with: ",
                    Typed(self.repair),
                )
            )  # fmt: skip
        return [*said]

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
    swept: dict[str, Quantity] = {}
    row = np.zeros(len(run.contributors))
    if index is not None:
        settings = replace(settings, **_swept(run, index, machine))
        swept = {
            name: Quantity(run.column(name)[index].item(), run.scales[name])
            for name in (each.name for each in run.swept)
        }
        row = np.array([run.column(each.name)[index] for each in run.contributors])
    chart, outcome = _simulated(machine, row, settings)
    word = run.words.get(int(outcome.status[0]), "unknown")
    deviations = dict(
        zip([p.name for p in run.contributors], row.tolist(), strict=True)
    )
    return Replay(
        f"{run.title}: {'nominal trial' if index is None else f'trial {index}'}",
        index,
        word,
        _steps(outcome),
        swept,
        deviations,
        _responses(run.responses, outcome, run.limits, run.scales),
        stored=True,
        differences=_differences(run, index, outcome),
        reason="; ".join(run.made_otherwise(machine.source_digest)),
        damage=run.damage.words if run.damage else "",
        repair=to_resume(run.path, run.machine),
        contributors={
            part.name: Quantity(at, run.scales[part.name], part.sentence)
            for part, at in zip(run.contributors, row.tolist(), strict=True)
        },
        history=chart,
    )


def nominal_trial(study: Study) -> Replay:
    """Simulate the trial without deviations of a study."""
    contributors, responses = study.description
    chart, outcome = _simulated(
        study.model, np.zeros(len(contributors)), study.settings
    )
    scales = {
        each.name: scale_of(
            each.unit, study.shown.get(each.name) or each.shown, abs(float(value))
        ).telling(
            0.0, study.limits[each.name].asked if each.name in study.limits else ()
        )
        for each, value in zip(responses, outcome.responses[0], strict=True)
    }
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
