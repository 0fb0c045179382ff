"""One machine over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat import catalogue
from tolstat.errors import ModelError
from tolstat.machines import settings as model_settings
from tolstat.machines.description import History, Model, MovingModel
from tolstat.study.evaluate import deviations_table

if TYPE_CHECKING:
    import pandas as pd

STEP = 1e-4  # s


def trajectory(
    model: str | Model,
    deviations: Mapping[str, float] | None = None,
    settings: Mapping[str, Any] | None = None,
    *,
    step: float = STEP,
) -> pd.DataFrame:
    """Simulate one machine and return how it moved.

    Parameters
    ----------
    model : str or Model
        A name of `tolstat.models()`, or a model object that moves.
    deviations : mapping, optional
        By contributor name, SI. A name without its number means each of them. What is
        missing is zero.
    settings : mapping, optional
        By name, SI; what is missing takes its default.
    step : float
        Time between two rows, s.

    Returns
    -------
    DataFrame
        Indexed by time (s), a column for each curve, SI; NaN after a failure.
        `attrs["units"]` holds the units, `attrs["responses"]` the responses of the
        trial, `attrs["status"]` how it ended.

    Raises
    ------
    ModelError
        If a name is unknown, a value is not finite, or the model does not move.

    Examples
    --------
    >>> tolstat.trajectory("stand", {"crank_difference": 1e-3})["shaft_9_moment"].plot()
    """
    import pandas as pd

    from tolstat.status import WORDS

    machine = catalogue.find(model)
    chosen = model_settings.make(machine, settings)
    description = machine.describe(chosen)
    table = deviations_table(dict(deviations or {}), description)
    if len(table) != 1:
        raise ModelError(f"one machine has a trajectory, not {len(table)}")
    found = history_of(machine, table[0], chosen, step)
    index = pd.Index(found.time, name="time")
    frame = pd.DataFrame({c.name: c.values for c in found.curves}, index=index)
    frame.attrs["units"] = {"time": "s", **{c.name: c.unit for c in found.curves}}
    names = [response.name for response in description.responses]
    values = found.outcome.responses[0].tolist()
    frame.attrs["responses"] = dict(zip(names, values, strict=True))
    frame.attrs["status"] = WORDS[int(found.outcome.status[0])]
    return frame


def history_of(
    model: Model, deviations: NDArray[np.float64], settings: Any, step: float = STEP
) -> History:
    """Simulate one machine of deviations[contributor], SI, seen every `step` s.

    Raises
    ------
    ModelError
        If the model does not move, or the step is not above zero.
    """
    if not isinstance(model, MovingModel):
        raise ModelError(f"model '{model.name}' does not move: it has no histories")
    if not 0 < step < 1:
        raise ModelError(f"step = {step:g}: a time above 0 and below 1 s is expected")
    return model.history(deviations, settings, step)
