"""Machines of given deviations, simulated: the shortest way in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat import catalogue
from tolstat.deviations.names import expand
from tolstat.errors import ModelError
from tolstat.model import settings as model_settings
from tolstat.model.checked import described, simulate
from tolstat.model.contract import Model
from tolstat.model.description import Description
from tolstat.status import status_words, words_of

if TYPE_CHECKING:
    import pandas as pd


def evaluate(
    model: str | Model,
    deviations: Mapping[str, ArrayLike] | pd.DataFrame | None = None,
    settings: Mapping[str, Any] | None = None,
) -> pd.DataFrame:
    """Simulate machines of given deviations.

    Parameters
    ----------
    model : str or Model
        A name of `tolstat.models()`, or a model object.
    deviations : mapping or DataFrame, optional
        By contributor name, SI: numbers, or arrays of one length. A name without its
        number means each of them. What is missing is zero.
    settings : mapping, optional
        By name, SI; what is missing takes its default.

    Returns
    -------
    DataFrame
        One row a machine: the responses in SI, `status` (a word), and `steps` where
        something is integrated; with the index of `deviations` if that is a DataFrame.
        `attrs["units"]` holds the units.

    Raises
    ------
    ModelError
        If a name is unknown, or a value is not a finite number.

    Examples
    --------
    >>> tolstat.evaluate("stand", {"crank_difference": [0.0, 1e-3]})
    """
    import pandas as pd

    machine = catalogue.find(model)
    chosen = model_settings.make(machine, settings)
    description = described(machine, chosen)
    given = {} if deviations is None else {str(k): v for k, v in deviations.items()}
    outcome = simulate(machine, deviations_table(given, description), chosen)
    names = [response.name for response in description.responses]
    frame = pd.DataFrame(outcome.responses, columns=names)
    if isinstance(deviations, pd.DataFrame):
        frame.index = deviations.index
    frame["status"] = status_words(outcome.status, words_of(machine.failures))
    if outcome.steps is not None:
        frame["steps"] = outcome.steps
    frame.attrs["units"] = {r.name: r.unit for r in description.responses}
    return frame


def deviations_table(
    given: Mapping[str, Any], description: Description
) -> NDArray[np.float64]:
    """Arrange deviations by name as float64[trial, contributor]."""
    names = [contributor.name for contributor in description.contributors]
    columns: dict[str, NDArray[np.float64]] = {}
    for name, values in given.items():
        try:
            column = np.asarray(values, dtype=np.float64)
            expanded = expand(name, names)
        except (TypeError, ValueError) as error:
            raise ModelError(f"deviation {name}: {error}") from None
        if column.ndim > 1 or not np.all(np.isfinite(column)):
            raise ModelError(f"deviation {name}: finite numbers are expected, in a row")
        for each in expanded:
            if each in columns:
                raise ModelError(f"deviation {each} is given twice, also by {name}")
            columns[each] = column
    lengths = {len(column) for column in columns.values() if column.ndim == 1}
    if len(lengths) > 1:
        found = ", ".join(str(length) for length in sorted(lengths))
        raise ModelError(f"deviations are of different lengths: {found}")
    table = np.zeros((lengths.pop() if lengths else 1, len(names)))
    for name, column in columns.items():
        table[:, names.index(name)] = column
    return table
