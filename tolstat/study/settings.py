"""Settings of a model as a study file has them."""

from __future__ import annotations

from typing import Any

from tolstat.errors import ModelError
from tolstat.machines import settings as model_settings
from tolstat.machines.description import Model
from tolstat.units.grammar import quantity


def read_setting(model: Model, name: str, given: Any) -> Any:
    """Read one setting: a quantity with its unit, a number or a word.

    Parameters
    ----------
    model : Model
        The machine.
    name : str
        Of the setting.
    given
        As written.

    Returns
    -------
    object
        As the model's dataclass wants it, SI.

    Raises
    ------
    ModelError, UnitError
        If there is no such setting or the value does not fit.
    """
    field = model_settings.field_of(model, name)
    value = given
    unit, presets = field.metadata["unit"], field.metadata["presets"]
    if unit and not isinstance(given, str):
        raise ModelError(f'a quantity with its unit is expected, "{given} {unit}"')
    if unit and given not in presets:
        value = quantity(str(given), unit)
    return model_settings.checked(field, value)
