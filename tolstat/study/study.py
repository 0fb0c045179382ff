"""A study: what is asked, checked and in SI."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from tolstat import catalogue
from tolstat.deviations import samplers
from tolstat.deviations.draw import Spread
from tolstat.deviations.names import expand
from tolstat.deviations.parts import names_in
from tolstat.errors import ModelError, StudyError, allowed_names
from tolstat.machines import settings as model_settings
from tolstat.machines.description import Description, Model
from tolstat.study.document import Document, read
from tolstat.study.problems import Problems
from tolstat.study.spread import read_spread
from tolstat.units.grammar import Range, limit, quantity

Given = TypeVar("Given")
Read = TypeVar("Read")


@dataclass(frozen=True)
class Study:
    """A study that can be run.

    Attributes
    ----------
    path : Path
        Its file.
    text : str
        The file as it was written.
    title : str
        In the user's words.
    model : Model
        The machine.
    settings : object
        Instance of `model.settings`, SI.
    trials, seed : int
        How many machines are built, and from which random numbers.
    sampling : str
        How the deviations are drawn.
    spreads : dict of str to Spread
        By contributor, SI.
    limits : dict of str to Range
        By response, SI.
    """

    path: Path
    text: str
    title: str
    model: Model
    settings: Any
    trials: int
    seed: int
    sampling: str
    spreads: dict[str, Spread]
    limits: dict[str, Range]

    @property
    def description(self) -> Description:
        """Contributors and responses of the model at these settings."""
        return self.model.describe(self.settings)


def load(
    path: str | os.PathLike[str],
    *,
    model: Model | None = None,
    trials: int | None = None,
    seed: int | None = None,
) -> Study:
    """Read a study file and check all of it.

    Parameters
    ----------
    path : path
        A TOML file.
    model : Model, optional
        A machine of your own; else the study names one of the catalogue.
    trials, seed : int, optional
        Instead of the study's.

    Returns
    -------
    Study
        Ready to run.

    Raises
    ------
    StudyError
        With every problem found: key, value, what is allowed.
    """
    path = Path(path)
    problems = Problems(str(path))
    text, document = read(path, problems)
    machine = _machine(document, model, problems)
    if document.sampling not in names_in(samplers):
        allowed = allowed_names(document.sampling, names_in(samplers))
        problems.add("sampling", document.sampling, f"no such sampling; {allowed}")
    settings = _settings(document, machine, problems)
    description = machine.describe(settings)
    study = Study(
        path,
        text,
        document.title or path.stem,
        machine,
        settings,
        document.trials,
        document.seed,
        document.sampling,
        _spreads(document, description, problems),
        _limits(document, description, problems),
    )
    problems.raise_if_any()
    for name, value, least in (("trials", trials, 1), ("seed", seed, 0)):
        if value is not None and value < least:
            raise StudyError(f"{name} = {value}: it must be at least {least}")
    return replace(
        study,
        trials=study.trials if trials is None else trials,
        seed=study.seed if seed is None else seed,
    )


def _machine(document: Document, model: Model | None, problems: Problems) -> Model:
    if model is not None:
        if model.name != document.model:
            message = f"the model given is called '{model.name}'"
            problems.add("model", document.model, message)
        return model
    with problems.noting("model", document.model):
        return catalogue.find(document.model)
    problems.raise_if_any()
    raise AssertionError("a problem was noted")


def _settings(document: Document, model: Model, problems: Problems) -> Any:
    values = {}
    for name, given in document.settings.items():
        with problems.noting(f"[settings] {name}", given):
            field = model_settings.field_of(model, name)
            value: Any = given
            unit, presets = field.metadata["unit"], field.metadata["presets"]
            if unit and not isinstance(given, str):
                raise ModelError(
                    f'a quantity with its unit is expected, "{given} {unit}"'
                )
            if unit and given not in presets:
                value = quantity(str(given), unit)
            values[name] = model_settings.checked(field, value)
    return model.settings(**values)


def _spreads(
    document: Document, description: Description, problems: Problems
) -> dict[str, Spread]:
    units = {each.name: each.unit for each in description.contributors}
    return _by_name("deviations", document.deviations, units, read_spread, problems)


def _limits(
    document: Document, description: Description, problems: Problems
) -> dict[str, Range]:
    units = {each.name: each.unit for each in description.responses}
    return _by_name("limits", document.limits, units, limit, problems)


def _by_name(
    section: str,
    given: Mapping[str, Given],
    units: Mapping[str, str],
    read_one: Callable[[Given, str], Read],
    problems: Problems,
) -> dict[str, Read]:
    """Read one section: a name without number stands for each of its numbers."""
    found: dict[str, Read] = {}
    for name, value in given.items():
        with problems.noting(f"[{section}] {name}", value):
            for each in expand(name, list(units)):
                if each in found:
                    raise ModelError(f"{each} stands there already; give it once")
                found[each] = read_one(value, units[each])
    return found
