"""One trial simulated again: its deviations, responses and history."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from tolstat import catalogue
from tolstat.answers.answer import Answer
from tolstat.answers.next_steps import to_resume
from tolstat.answers.views.animation import Animation, animation_of
from tolstat.document.inline import Number, Parts, Row, Typed
from tolstat.errors import ModelError, RunFileError
from tolstat.execution.compatibility import made_differently, study_of
from tolstat.execution.stages import rows_of
from tolstat.integrator.integrate import observed
from tolstat.model.checked import described, simulate
from tolstat.model.checked_views import history_of
from tolstat.model.contract import STEP, Model, TrialResults
from tolstat.model.description import Description, Response
from tolstat.model.setting_kinds import as_typed
from tolstat.model.settings import read, setting_of
from tolstat.model.view import Chart, in_units, typed_unit
from tolstat.statistics.limits.limit import NO_LIMIT, Limit
from tolstat.status import Status, words_of
from tolstat.store.open_run import RunSource
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.study.given_points import columns_of, setting_name
from tolstat.study.settings_section import settings_with_links
from tolstat.study.study import Study, typed_units
from tolstat.study.study_schema import RESULTS
from tolstat.units.scale import Scale, scale_of


class Quantity(NamedTuple):
    """A setting, a deviation or a response of one trial."""

    value: float | str  # SI
    scale: Scale  # how it is shown
    sentence: str = ""  # its description
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
    failed_at: str  # where and by which state, if the integration failed
    settings: dict[str, Quantity]  # those that a grid changed
    deviations: dict[str, float]  # by contributor, SI
    responses: dict[str, Quantity]
    stored: bool = False  # whether there is a stored row to compare with
    # not bit for bit as stored: responses, "status", "steps"
    differences: tuple[str, ...] = ()
    # what it printed last, or why it failed, if its process did not answer
    output: str = ""
    reason: str = ""  # why they may differ, if there is a reason
    damage: str = ""  # the damage of the run
    repair: Typed | None = field(default=None, metadata={"json": False})
    contributors: dict[str, Quantity] = field(
        default_factory=dict, metadata={"json": False}
    )
    # how it moved; None for a model that does not move
    history: Chart | None = field(default=None, metadata={"json": False})
    # the model and its settings, with which it is simulated
    built: tuple[Model, Any] | None = field(default=None, metadata={"json": False})
    answers = "trial"
    index = "name"

    @property
    def _short(self) -> str:
        return f"{self.title}: {self.status}"

    def rows(self) -> list[Row]:
        """Return deviations and responses, a row for each."""
        kinds = ("setting", self.settings), ("deviation", self.contributors)
        return [
            {
                "name": name, "kind": kind, "unit": quantity.scale.mark,
                "value [unit]": quantity.number, "limit": quantity.limit,
                "out of limit": int(quantity.out_of_limit),
            }
            for kind, quantities in (*kinds, ("response", self.responses))
            for name, quantity in quantities.items()
        ]  # fmt: skip

    def animate(self) -> Animation:
        """Return the mechanism of the trial in motion, before the nominal one.

        It is shown in a notebook; `save` writes it as .html or .gif.

        Raises
        ------
        ModelError
            If the model has no mechanism, or the trial cannot be built.
        """
        assert self.built
        model, settings = self.built
        row, nominal = np.array([*self.deviations.values()]), self.trial is None
        return animation_of(model, settings, row, self.title, nominal=nominal)


def replay(run: RunSource, index: int | None, model: Model | None = None) -> Replay:
    """Return one trial of a run, simulated again and compared.

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
        With the differences from the stored row, bit for bit.

    Raises
    ------
    ModelError
        If there is no such trial.
    RunFileError
        If it has not run.

    Examples
    --------
    >>> tolstat.replay("runs/stack-up.h5", 7).differences
    ()
    """
    run = open_run(run, damaged=True)
    if index is not None and not 0 <= index < run.trials:
        raise ModelError(
            f"trial {index}: {run.path} has the trials 0 to {run.trials - 1}"
        )
    if index is not None and run.status[index] == Status.NOT_RUN:
        raise RunFileError(f"{run.path}: trial {index} has not run")
    loaded, scales = catalogue.find(model or run.model), run.scales
    if run.isolation:
        loaded = catalogue.isolated(loaded, run.isolation.longest_trial)
    settings = read(loaded, settings_with_links(run.study.table, loaded))
    stored = Description(run.contributors, run.responses)
    if columns_of(described(loaded, settings)) != columns_of(stored):
        loaded = study_of(run, model=model).model  # in cases or lots
    swept, row = dict[str, Quantity](), {part.name: 0.0 for part in run.contributors}
    if index is not None:
        swept = {
            setting_name(column.name): Quantity(
                run.column(column.name)[index].item(), scales[column.name]
            )
            for column in run.swept
        }
        settings = replace(settings, **dict(_changed_settings(run, swept, loaded)))
        row = {name: float(run.column(name)[index]) for name in row}
    typed = {response.name: response.shown for response in run.responses}
    typed |= typed_units(run.study.table)
    known = None
    if run.model == RESULTS and index is not None:
        answers = study_of(run).answers
        known = answers and rows_of(answers, [index])
    trial = _simulated(
        loaded, settings, row, run.responses, run.limits, typed, scales, known
    )
    which = "nominal trial" if index is None else f"trial {index}"
    return replace(
        trial,
        title=f"{run.title}: {which}",
        trial=index,
        settings=swept,
        stored=True,
        differences=tuple(_differences(run, index, trial)),
        reason="; ".join(made_differently(run, loaded.source_digest)),
        damage=run.damage.words,
        repair=to_resume(run.path, run.machine),
        contributors={
            part.name: Quantity(row[part.name], scales[part.name], part.sentence)
            for part in run.contributors
        },
    )


def nominal_trial(study: Study) -> Replay:
    """Return the simulated nominal trial of a study."""
    contributors, responses = study.description
    row = {part.name: 0.0 for part in contributors}
    model, settings, limits = study.model, study.settings, study.limits
    trial = _simulated(model, settings, row, responses, limits, study.shown, {})
    return replace(trial, title=f"{study.title}: nominal trial")


def _simulated(
    model: Model,
    settings: Any,
    row: dict[str, float],
    responses: tuple[Response, ...],
    limits: Mapping[str, Limit],
    typed: Mapping[str, str],
    scales: Mapping[str, Scale],
    known: TrialResults | None = None,
) -> Replay:
    """Return the simulated trial of a row of deviations, SI, or its `known` answers.

    A response without a scale is shown in its typed unit, by its size and limit.
    """
    deviations, chart = np.array(list(row.values())), None
    with observed() as seen:
        output = ""
        if not model.moves or model.isolation:  # its process may end
            outcome = known or simulate(model, deviations[None, :], settings)
            output = outcome.output.get(0, "")
        if model.moves and not output:
            history, outcome = history_of(model, deviations, settings, STEP)
            chart = in_units(history, typed)
    ended = next((response.failure for response in seen if response.failure), "")
    quantities = {}
    for response, value in zip(responses, outcome.responses[0].tolist(), strict=True):
        limit, name = limits.get(response.name, NO_LIMIT), response.name
        unit = typed_unit(response, typed)
        fitting = scale_of(response.unit, unit, abs(value)).telling(0.0, limit.asked)
        quantity = Quantity(value, scales.get(name, fitting), response.sentence)
        if name in limits:
            out = not limit.lower <= value <= limit.upper
            quantity = quantity._replace(limit=limit.words, out_of_limit=out)
        quantities[name] = quantity
    status = words_of(model.failures)[int(outcome.status[0])]
    steps = None if outcome.steps is None else int(outcome.steps[0])
    return Replay(
        "", None, status, steps, ended, {}, row, quantities,
        history=chart, built=(model, settings), output=output,
    )  # fmt: skip


def _changed_settings(
    run: Run, swept: Mapping[str, Quantity], model: Model
) -> Iterator[tuple[str, Any]]:
    """Yield the settings that a grid changed for one trial, as the model reads them."""
    for name, (value, *_) in swept.items():
        kind = setting_of(model, name).kind
        if isinstance(value, str):
            typed = run.study.table["grid"][name]
            yield name, kind.read(next(t for t in typed if as_typed(t) == value))
        else:
            yield name, kind.checked(value)


def _differences(run: Run, index: int | None, trial: Replay) -> Iterator[str]:
    """Yield the names that are not bit for bit as stored."""
    stored = run.nominal_values
    if index is not None:
        stored = {name: run.column(name)[index] for name in trial.responses}
        stored["status"] = run.ended_as(index)
        stored["steps"] = None if run.steps is None else run.steps[index]
    for name, quantity in trial.responses.items():
        values = np.array([quantity.value, stored[name]], dtype=np.float64)
        if len({*values.view(np.uint64).tolist()}) > 1 and not np.isnan(values).all():
            yield name
    if trial.status != stored["status"]:
        yield "status"
    steps = stored.get("steps")
    if None not in (steps, trial.steps) and steps != trial.steps:
        yield "steps"
