"""A study, checked and in SI."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from tolstat import catalogue
from tolstat.arrays import Array
from tolstat.deviations.distributions import Constant
from tolstat.deviations.draw import (
    SAMPLERS,
    Course,
    draw_in_stages,
    drawn_between,
    streams_of,
)
from tolstat.deviations.names import LOT
from tolstat.deviations.samplers import Sampler, Stage
from tolstat.errors import StudyError, UnitError
from tolstat.model.checked import check_possible
from tolstat.model.contract import Model, TrialResults
from tolstat.model.description import Description
from tolstat.model.setting_kinds import as_typed
from tolstat.statistics.limits.limit import Limit
from tolstat.study.deviations_section import Deviations, read_deviations
from tolstat.study.editor import StudyEditor
from tolstat.study.files import path_of_study, read_toml
from tolstat.study.given_points import Case, Points, Setup, read_grid, read_reference
from tolstat.study.limits_section import read_limits
from tolstat.study.memory_needed import large, too_large
from tolstat.study.nominal_size import SHARES
from tolstat.study.problems import Problems
from tolstat.study.sampling import (
    Rule,
    Until,
    aim_of,
    note_faults,
    read_sampling,
    read_until,
    warnings_of,
    with_slow,
)
from tolstat.study.settings_section import (
    NOMINAL,
    described_with_sizes,
    link_columns,
    read_settings,
    with_link_tables,
)
from tolstat.study.study_schema import Document, checked
from tolstat.units.conversion import CELSIUS, dimension, known_name
from tolstat.units.grammar import quantity, unit_of
from tolstat.units.scale import KNOWN, SIZES, figures

CONDITIONS = ("cases", "grid", "limits")
SECTIONS = ("settings", "links", "deviations", *CONDITIONS)
UNAUDITED = (
    "integration errors are not audited: the model moves, but has no setting rtol"
)
AT_WORST_MEANS = (
    "means lie within their ranges: a response at_least and at_largest has all means "
    "where they make it so; the yield of all limits counts units that meet both"
)
Source = str | os.PathLike[str] | Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study that can be run."""

    path: Path | None  # its file; None if it was given in Python
    text: str  # the file as it was written, or would be
    document: Document  # its keys; links are among settings and deviations
    model: Model
    settings: Any  # instance of `model.settings`, SI
    # contributors and responses of the model at these settings
    description: Description
    trials: int  # how many, at most
    until: Until | None  # a stopping rule; None for a fixed number of trials
    seed: int | None  # of the random numbers; None where nothing is sampled
    sampling: str  # how the deviations are chosen
    deviating: Deviations  # distributions and correlations
    points: Points | None  # the trials of a grid or a table
    # known points to show with a grid: their label, and columns
    reference: tuple[str, dict[str, Array]] | None
    limits: dict[str, Limit]  # by response, SI
    # the unit in which each contributor, response or swept setting is written; and by
    # dimension, see `typed_units`
    shown: dict[str, str]
    # the response at whose limit the sampler aims; empty for any other study
    aim: str = ""
    # random trials before the first thinned stage; 0 without any
    thinned: int = 0

    @property
    def title(self) -> str:
        """The title of the study, or the name of its file or model."""
        name = self.path.stem if self.path else self.model.name
        return self.document.title or name

    @property
    def typed(self) -> dict[str, str]:
        """The settings that are given, as they are written."""
        return {n: as_typed(value) for n, value in self.document.settings.items()}

    @property
    def cases(self) -> tuple[Case, ...]:
        """The settings of all trials, in order."""
        if self.points:
            return self.points.cases
        return (Case(0, self.trials, self.settings),)

    @property
    def answers(self) -> TrialResults | None:
        """The answers of all trials; None where its model evaluates them."""
        return self.points.answers if self.points else None

    @property
    def sampler(self) -> Sampler | None:
        """How the trials are sampled; None if they are no sample."""
        return self.points.sampler if self.points else SAMPLERS[self.sampling]

    @property
    def unfit(self) -> str:
        """Why it cannot have so many trials; empty if it can."""
        wrong = too_large(self.trials, self.description)
        if wrong or self.points:
            return wrong
        return SAMPLERS[self.sampling].unfit(self.trials, len(self.factors))

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings about it that are known before it is run."""
        much = large(self.trials, self.description)
        return (*self._warnings, much) if much else self._warnings

    @property
    def _warnings(self) -> tuple[str, ...]:
        """The warnings that are the same on every computer."""
        if self.points:
            return ()
        return warnings_of(self.sampling, self.trials, len(self.factors))

    @property
    def reading_warnings(self) -> tuple[str, ...]:
        """The warnings about how its values were read, for readers of the results."""
        plain = {r.name for r in self.description.responses if r.shown == "1"}
        return (
            *self.deviating.warnings,
            *(self.points.warnings if self.points else ()),
            *(
                f'{name} is a plain number: its limit "{limit.words}" is '
                f"{'..'.join(figures(end, KNOWN) for end in limit.finite)}"
                for name, limit in self.limits.items()
                if name in plain and self.shown.get(name) in SHARES
            ),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes for the summary of the run: warnings, trials, deviations."""
        notes = [*self._warnings]
        if self.points and self.points.note:
            notes.append(self.points.note)
        model = self.model
        if model.moves and not (model.integrates or model.audits_steps):
            notes.append(UNAUDITED)
        if self.deviating.means:
            notes.append(AT_WORST_MEANS)
        return (*notes, *self.deviating.notes)

    @property
    def factors(self) -> tuple[str, ...]:
        """The independent factors, in the order in which they are sampled."""
        deviating = self.deviating
        return tuple(
            streams_of(
                self._contributors, deviating.distributions, deviating.dependence
            )
        )

    def deviations(self) -> Array:
        """Return the deviations that are known before any trial has run, SI.

        float64[trial, contributor]: of all trials, or of the first of its `stages`.
        """
        return next(self.stages())[1]

    def random_trials(self, first: int, stop: int) -> Array:
        """Return the deviations of random trials between two numbers, SI."""
        return drawn_between(
            self._contributors,
            self.deviating.distributions,
            seed=cast(int, self.seed),
            between=(first, stop),
            dependence=self.deviating.dependence,
        )

    def first_trials(self, number: int) -> Array:
        """Return deviations of the first trials, SI; of a rare study random ones."""
        if self.sampler and not self.sampler.sample:
            return self.at_random(cast(int, self.seed), number).deviations()
        return self.deviations()[:number]

    def at_random(self, seed: int, trials: int) -> Study:
        """Return the study with random trials, whatever its sampling."""
        return replace(
            self, sampling="random", aim="", until=None, seed=seed, trials=trials
        )

    def editor(self) -> StudyEditor:
        """Return the editor of this study."""
        return StudyEditor(
            tomllib.loads(self.text),
            self.description.contributors,
            (NOMINAL, *link_columns(self.model)),
        )

    def stages(self) -> Course:
        """Yield all trials stage by stage: see `draw_in_stages`."""
        names = self._contributors
        if self.points:
            table = self.points.deviations.copy()
            for name, part in self.deviating.distributions.items():
                if isinstance(part, Constant):
                    table[:, names.index(name)] = part.value
            yield Stage(table, np.zeros(len(table))), table
            return
        assert self.seed is not None  # checked when the study was loaded
        yield from draw_in_stages(
            names,
            self.deviating.distributions,
            sampling=self.sampling,
            seed=self.seed,
            trials=self.trials,
            dependence=self.deviating.dependence,
        )

    @property
    def _contributors(self) -> list[str]:
        return [contributor.name for contributor in self.description.contributors]


def load(
    source: Source,
    *,
    model: Model | None = None,
    trials: int | Rule | None = None,
    seed: int | None = None,
    folder: Path | None = None,
    longest_trial: float | None = None,
) -> Study:
    """Return a study, read and checked.

    Trials (or their rule), seed and a custom model replace those of the study. Its data
    files lie in the folder, by default that of the study. With a longest trial, s, or
    that of the study, trials are evaluated in other processes. A StudyError lists every
    problem: key, value, what is allowed.
    """
    model = model.unwrapped if isinstance(model, Model) else model
    path = path_of_study(source)
    folder = folder or (path.parent if path else None)
    problems = Problems(str(path or "the study"))
    text, table = read_toml(path or cast(Mapping[str, Any], source))
    typed = {"trials": with_slow(trials, table.get("trials")), "seed": seed}
    table |= {key: value for key, value in typed.items() if value is not None}
    document = checked(table, problems, partial(_section_of, model))
    document = with_link_tables(document, problems)
    note_two_scales(document.model_dump(), problems)
    shown = typed_units(document.model_dump())
    sampling, response = read_sampling(document, problems)

    chosen = None
    try:
        chosen = _model(document, model, problems)
        chosen = _isolated(document, chosen, longest_trial, problems)
        settings, document = read_settings(document, chosen, problems)
        if any(name.endswith(LOT) for name in document.deviations):
            from tolstat.model.in_lots import in_lots  # seldom needed

            chosen = in_lots(document.deviations, chosen, settings)
        if document.cases:
            from tolstat.study.cases_section import read_cases  # seldom needed

            cases, axes = document.cases, document.grid
            chosen = read_cases(cases, chosen, settings, problems, axes)
        description = problems.required(  # some settings may not fit each other
            "[settings]", None, lambda: described_with_sizes(chosen, settings)
        )
    except StudyError:  # without these the rest cannot be read
        from tolstat.study.slips import note_readable

        note_faults(document, sampling, Deviations(), None, problems)
        note_readable(document, chosen, problems)
        raise problems.refusal from None

    deviating = read_deviations(
        document.deviations, document.correlation, description.contributors, folder,
        problems, linked=document.links,
    )  # fmt: skip
    evaluated = chosen
    if deviating.means:
        evaluated = _at_worst_means(chosen, settings, deviating)
        description = described_with_sizes(evaluated, settings)
    points, setup = None, Setup(document, folder, evaluated, settings, description)
    if sampling == "grid" and document.grid:
        points = read_grid(setup, problems)
    if sampling == "table" and document.table:
        from tolstat.study.stated_rows import read_rows  # few studies have rows

        with problems.noting("table", document.table):
            points = read_rows(setup, deviating)
    note_faults(document, sampling, deviating, points, problems)
    reference = None
    if document.reference:
        with problems.noting("[reference]", document.reference):
            reference = read_reference(setup, points.swept if points else ())

    limits = read_limits(document.limits, description.responses, problems)
    aim = ""
    if limits or not document.limits:  # a wrong one has been noted
        with problems.noting("sampling", document.sampling):
            names = [response.name for response in description.responses]
            aim = aim_of(sampling, response, limits, names)
    until = None
    if isinstance(document.trials, dict | str):
        with problems.noting("trials", document.trials):
            # a wrong limit has been noted
            limited = limits or document.limits
            until = read_until(document.trials, description, limited)
    problems.raise_if_any()
    nominal, what = np.zeros((1, len(description.contributors))), "the nominal trial"
    problems.required(
        "[settings]", None, lambda: check_possible(evaluated, nominal, settings, what)
    )
    number = len(points.deviations) if points else cast(int, document.trials)
    study = Study(
        path=path,
        text=text,
        document=document,
        model=evaluated,
        settings=settings,
        description=description,
        trials=until.at_most if until else number,
        until=until,
        seed=document.seed,
        sampling=sampling,
        deviating=deviating,
        points=points,
        reference=reference,
        limits=limits,
        shown={
            **shown,
            **(points.units if points else {}),
            **deviating.units,
            **(until.units if until else {}),
            **{name: unit_of(limit.words) for name, limit in limits.items()},
        },
        aim=aim,
    )
    if wrong := study.unfit:
        raise StudyError(f"{problems.source}: trials = {study.trials}: {wrong}")
    return study


def _section_of(
    model: Model | None, name: str, value: Any, table: Mapping[str, Any]
) -> str:
    """Return the section where a key belongs that stands outside of one."""
    from tolstat.study.slips import section_of  # right studies have none

    return section_of(name, value, table, model)


def typed_units(study: Mapping[str, Any]) -> dict[str, str]:
    """Return by dimension the unit in which all such quantities of a study are typed.

    With all speeds in rpm that is {"[angle] / [time]": "rpm"}. Those whose unit follows
    their size, mm or um, are left out, unless all lengths are in inches.
    """
    typed: dict[str, set[str]] = {}
    for text in texts_in([study.get(section) for section in SECTIONS]):
        with suppress(UnitError):  # a word, a formula, the name of a file
            unit = unit_of(text)
            typed.setdefault(str(dimension(unit)), set()).add(unit)
    sized = {str(dimension(unit)) for unit in SIZES}
    agreed = {kind: units.pop() for kind, units in typed.items() if len(units) == 1}
    return {k: unit for k, unit in agreed.items() if k not in sized or unit == "in"}


def note_two_scales(study: Mapping[str, Any], problems: Problems) -> None:
    """Note temperatures in K where others are in degC: one may be absolute.

    Tolerances are left out: those of 20 degC may be in K.
    """
    first = ""
    for section in ("links", "settings", *CONDITIONS):
        for name, entry in study.get(section, {}).items():
            size = entry.get(NOMINAL) if section == "links" else entry
            for text in texts_in(size):
                scale = _scale_of_temperature(text)
                place = f"[{section}] {name}"
                if scale and not first:
                    first, example = scale, f"{place} in {scale}"
                elif scale not in ("", first) and section != "links":
                    problems.add(
                        place,
                        entry,
                        f"{example}, and this in {scale}: both are differences of "
                        "temperature; give both in one unit",
                    )
                    break


def _scale_of_temperature(text: str) -> str:
    """Return K or degC; empty for another text."""
    with suppress(UnitError):
        unit = unit_of(text)
        if dimension(unit) == dimension("K"):
            return CELSIUS if known_name(unit) == CELSIUS else "K"
    return ""


def texts_in(value: Any) -> Iterator[str]:
    """Yield the texts among the values of a study."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        yield from texts_in([*value.values()])
    elif isinstance(value, Sequence):
        for item in value:
            yield from texts_in(item)


def _at_worst_means(model: Model, settings: Any, deviating: Deviations) -> Model:
    """Return a model at the worst means of its parts."""
    from tolstat.model.worst_means import at_worst_means  # seldom needed

    distributions = deviating.distributions.items()
    middle = {
        name: float(d.deviations(np.full(1, 0.5))[0]) for name, d in distributions
    }
    return at_worst_means(model, settings, deviating.means, middle)


def _isolated(
    document: Document, model: Model, longest: float | None, problems: Problems
) -> Model:
    """Return a model in other processes, if the study or its run limits its trials."""
    with problems.noting("longest_trial", document.longest_trial):
        if (typed := document.longest_trial) is not None:
            longest = quantity(typed, "s")
            if not 0 < longest < math.inf:
                raise UnitError("a time above 0 s is expected")
        return model if longest is None else catalogue.isolated(model, longest)
    return model


def _model(document: Document, model: Model | None, problems: Problems) -> Model:
    if problems.noted("model"):
        raise problems.refusal
    chosen = problems.required(
        "model", document.model, lambda: catalogue.find(model or document.model)
    )
    if chosen.name != document.model:
        message = f"the model given is called '{chosen.name}'"
        problems.add("model", document.model, message)
    return chosen
