"""The machines that a study can name."""

from __future__ import annotations

import importlib

from tolstat.errors import ModelError, allowed_names
from tolstat.machines.description import Model

# name in study files: module and class
MACHINES = {
    "stand": ("tolstat.machines.stand.machine", "Stand"),
}


def names() -> list[str]:
    """List the models by name."""
    return list(MACHINES)


def find(model: str | Model) -> Model:
    """Return a model by its name; a model object stands for itself.

    Parameters
    ----------
    model : str or Model
        A name of `names()`, or any object that is a model.

    Raises
    ------
    ModelError
        If there is no such model.
    """
    if not isinstance(model, str):
        return model
    if model not in MACHINES:
        raise ModelError(
            f"no model is called '{model}'; {allowed_names(model, MACHINES)}"
        )
    module, kind = MACHINES[model]
    found: Model = getattr(importlib.import_module(module), kind)()
    return found
