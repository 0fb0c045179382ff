"""The section [cases] of a study: conditions in which the same units are judged.

A case is a table of the settings and sizes of links that it changes; `b = [...]` makes
numbered cases.
"""

import re
from collections.abc import Container, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from tolstat.deviations.names import IN_CASE
from tolstat.errors import ModelError, UnitError, allowed_names
from tolstat.model.case_changes import MOST_CASES, changes_of, condition_words
from tolstat.model.checked import check_possible, described, tightened
from tolstat.model.contract import Model
from tolstat.model.in_cases import Condition, ModelInCases
from tolstat.model.setting_kinds import as_typed
from tolstat.model.settings import settings_of
from tolstat.study.given_points import columns_of
from tolstat.study.problems import Problems
from tolstat.study.settings_section import NOMINAL, SETTING, link_columns
from tolstat.units.grammar import measure

_NAME = re.compile(r"\w+")


def read_cases(
    cases: Mapping[str, Any],
    model: Model,
    settings: Any,
    problems: Problems,
    swept: Container[str] = (),
) -> Model:
    """Return a model in the cases of a study.

    Problems are noted: a name that is neither a setting nor a link, a setting that is
    also swept, a value that cannot be read or fits no other.
    """
    before = len(problems.found)
    conditions = list[Condition]()
    with problems.noting("[cases]", None):
        changes = changes_of(cases)
        if len(changes) > MOST_CASES:
            raise ModelError(f"{len(changes)} cases; at most {MOST_CASES}")
        for name, typed in changes.items():
            with problems.noting(f"[cases] {name}", typed):
                if both := [key for key in typed if key in swept]:
                    raise ModelError(f"{both[0]} is in [grid], too; give it once")
                conditions.append(_condition(name, typed, model, settings))
    if len(problems.found) > before:
        return model
    return ModelInCases(model, tuple(conditions))


def _condition(
    name: str, typed: Mapping[str, Any], model: Model, settings: Any
) -> Condition:
    """Return one case, its changes read and checked."""
    if not _NAME.fullmatch(name) or IN_CASE in name:
        raise ModelError("letters, digits and _ are allowed in the name of a case")
    declared, changes = settings_of(model), dict[str, Any]()
    links = getattr(settings, SETTING) if NOMINAL in link_columns(model) else {}
    precise = _precision(model, settings)
    for key, value in typed.items():
        if key in precise:
            raise ModelError(f"{key} is the same in all cases; give it in [settings]")
        if key in declared:
            changes[key] = declared[key].kind.read(value)
        elif key in links:
            nominal = links[key][NOMINAL]
            size = None
            with suppress(UnitError):
                size = measure(str(value))
            if size is None or size.unit != nominal.unit:
                shown = nominal.shown or nominal.unit
                unit = "as a plain number" if shown == "1" else f"in {shown}"
                unread = "cannot be read; " if size is None else ""
                raise ModelError(
                    f"{key} = {as_typed(value)}: {unread}the size of the link is "
                    f"expected {unit}; its tolerance is that of [links]"
                )
            changes.setdefault(SETTING, {})[key] = {NOMINAL: size}
        else:
            names = [n for n in (*links, *declared) if n not in precise]
            raise ModelError(
                f"{key} is neither a setting nor a link; {allowed_names(key, names)}"
            )
    condition = Condition(name, condition_words(typed), changes)
    changed = condition.settings(settings)
    expected = columns_of(described(model, settings))
    if columns_of(described(model, changed)) != expected:
        raise ModelError(
            f"{', '.join(typed)}: the case changes which contributors or responses "
            "the model has; write a study for each"
        )
    trial = np.zeros((1, len(described(model, settings).contributors)))
    check_possible(model, trial, changed, "the nominal trial")
    return condition


def _precision(model: Model, settings: Any) -> set[str]:
    """Return the settings that an audit tightens: they are the same in all cases."""
    tight = tightened(model, settings)
    if tight is None:
        return set()
    return {
        name
        for name in settings_of(model)
        if getattr(tight, name) != getattr(settings, name)
    }
