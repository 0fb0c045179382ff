"""Settings of a model: checked against what its dataclass declares."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from tolstat.errors import ModelError, allowed_names
from tolstat.machines.description import Model


def fields_of(model: Model) -> dict[str, dataclasses.Field[Any]]:
    """Return the declared settings of a model, by name."""
    return {field.name: field for field in dataclasses.fields(model.settings)}


def field_of(model: Model, name: str) -> dataclasses.Field[Any]:
    """Return one declared setting.

    Parameters
    ----------
    model : Model
        The machine.
    name : str
        As typed.

    Raises
    ------
    ModelError
        If the model has no such setting.
    """
    fields = fields_of(model)
    if name not in fields:
        raise ModelError(
            f"model '{model.name}' has no such setting; {allowed_names(name, fields)}"
        )
    return fields[name]


def checked(field: dataclasses.Field[Any], value: Any) -> Any:
    """Return one setting, SI, as its dataclass wants it.

    Parameters
    ----------
    field : dataclasses.Field
        As declared with `tolstat.machines.description.setting`.
    value
        A number in SI, a word, or None where the declaration allows it.

    Raises
    ------
    ModelError
        If it is of the wrong type or out of bounds.
    """
    declared = field.metadata
    presets, choices = declared["presets"], declared["choices"]
    if isinstance(value, str) and value in presets:
        return presets[value]
    if choices:
        if value not in choices:
            raise ModelError(allowed_names(str(value), choices))
        return value
    if value is None and None in presets.values():
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        words = f", or one of {', '.join(presets)}" if presets else ""
        raise ModelError(f"a number is expected{words}")
    if isinstance(field.default, int):
        if value != int(value):
            raise ModelError("a whole number is expected")
        value = int(value)
    else:
        value = float(value)
        if not math.isfinite(value):
            raise ModelError("a finite number is expected")
    above, at_least = declared["above"], declared["at_least"]
    if above is not None and not value > above:
        raise ModelError(f"it must be above {above:g}")
    if at_least is not None and not value >= at_least:
        raise ModelError(f"it must be at least {at_least:g}")
    return value


def make(model: Model, given: Mapping[str, Any] | None) -> Any:
    """Make the settings object of a model.

    Parameters
    ----------
    model : Model
        The machine.
    given : mapping, optional
        Values by name, SI; the others take their defaults.

    Returns
    -------
    object
        An instance of `model.settings`.

    Raises
    ------
    ModelError
        If a name or a value is wrong.
    """
    values = {}
    for name, value in (given or {}).items():
        try:
            values[name] = checked(field_of(model, name), value)
        except ModelError as error:
            raise ModelError(f"setting {name} = {value!r}: {error}") from None
    return model.settings(**values)
