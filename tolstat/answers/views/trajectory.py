"""One machine over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tolstat import catalogue
from tolstat.answers.views.evaluate import deviations_table
from tolstat.errors import ModelError
from tolstat.model import settings as model_settings
from tolstat.model.checked import described, history_of
from tolstat.model.contract import Model
from tolstat.status import words_of

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
    machine = catalogue.find(model)
    chosen = model_settings.make(machine, settings)
    description = described(machine, chosen)
    table = deviations_table(dict(deviations or {}), description)
    if len(table) != 1:
        raise ModelError(f"one machine has a trajectory, not {len(table)}")
    chart, outcome = history_of(machine, table[0], chosen, step)
    frame = chart.frame()
    names = [response.name for response in description.responses]
    values = outcome.responses[0].tolist()
    frame.attrs["responses"] = dict(zip(names, values, strict=True))
    frame.attrs["status"] = words_of(machine.failures)[int(outcome.status[0])]
    return frame
