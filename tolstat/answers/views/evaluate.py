"""Trials of given deviations: their responses, histories and views."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from tolstat import catalogue
from tolstat.arrays import Array
from tolstat.deviations.names import expand
from tolstat.errors import ModelError, allowed_names
from tolstat.model import settings as model_settings
from tolstat.model.checked import described, simulate
from tolstat.model.checked_views import checked_view, history_of, offers
from tolstat.model.contract import STEP, Model
from tolstat.model.description import Description
from tolstat.model.view import View, in_units
from tolstat.status import status_words, words_of
from tolstat.study.nominal_size import are_sizes
from tolstat.study.study import Source, Study, load

if TYPE_CHECKING:
    import pandas as pd


MOST_SIZES = 2.0  # deviation of a part, over its nominal size


def evaluate(
    model: str | Model,
    deviations: Mapping[str, ArrayLike] | pd.DataFrame | None = None,
    settings: Mapping[str, Any] | None = None,
) -> pd.DataFrame:
    """Return the responses of trials with given deviations.

    Parameters
    ----------
    model : str or Model
        A name of `tolstat.models()`, or a model object.
    deviations : mapping or DataFrame, optional
        By contributor name, SI: numbers, or arrays of one length. A name without its
        number means each of them. Missing ones are zero.
    settings : mapping, optional
        By name, SI; missing ones have their default.

    Returns
    -------
    DataFrame
        One row a trial: the responses in SI, `status` (a word), and `steps` where
        something is integrated; with the index of `deviations` if that is a DataFrame.
        `attrs["units"]` holds the units.

    Raises
    ------
    ModelError
        If a name is unknown, or a value is not a finite number.

    Examples
    --------
    >>> found = tolstat.evaluate("stand", {"crank_difference": [0.0, 1e-3]})
    >>> found["rod_force_1"].round(-2).tolist()
    [103300.0, 104900.0]
    """
    import pandas as pd

    loaded = catalogue.find(model)
    chosen = model_settings.make(loaded, settings)
    description = described(loaded, chosen)
    by_name = {} if deviations is None else {str(k): v for k, v in deviations.items()}
    outcome = simulate(loaded, _deviations(by_name, description), chosen)
    names = [response.name for response in description.responses]
    frame = pd.DataFrame(outcome.responses, columns=names)
    if isinstance(deviations, pd.DataFrame):
        frame.index = deviations.index
    frame["status"] = status_words(outcome.status, words_of(loaded.failures))
    if outcome.steps is not None:
        frame["steps"] = outcome.steps
    frame.attrs["units"] = {r.name: r.unit for r in description.responses}
    return frame


def trajectory(
    model: str | Model,
    deviations: Mapping[str, float] | None = None,
    settings: Mapping[str, Any] | None = None,
    *,
    step: float = STEP,
) -> pd.DataFrame:
    """Return the history of one simulated trial.

    Parameters
    ----------
    model : str or Model
        A name of `tolstat.models()`, or a model object that moves.
    deviations : mapping, optional
        By contributor name, SI. A name without its number means each of them. Missing
        ones are zero.
    settings : mapping, optional
        By name, SI; missing ones have their default.
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
    >>> moved = tolstat.trajectory("stand", {"crank_difference": 1e-3})
    >>> moved["rod_force_1"].max().round(-2).item()
    104900.0
    """
    loaded = catalogue.find(model)
    chosen = model_settings.make(loaded, settings)
    first = _first(loaded, chosen, deviations)
    chart, outcome = history_of(loaded, first[0], chosen, step)
    frame = chart.frame()
    names = [response.name for response in described(loaded, chosen).responses]
    values = outcome.responses[0].tolist()
    frame.attrs["responses"] = dict(zip(names, values, strict=True))
    frame.attrs["status"] = words_of(loaded.failures)[int(outcome.status[0])]
    return frame


def view(
    source: Source | Model,
    name: str,
    deviations: Mapping[str, ArrayLike] | None = None,
    settings: Mapping[str, Any] | None = None,
    *,
    model: Model | None = None,
) -> View:
    """Return a view of a trial: the nominal one, or one with the deviations given.

    Parameters
    ----------
    source : path, mapping, str or Model
        A study, as a .toml file or its content; or a model, by its name or the object
        itself.
    name : str
        Of the view; `tolstat show MODEL` lists them.
    deviations : mapping, optional
        By contributor name, SI: of a trial that is not nominal.
    settings : mapping, optional
        By name, SI; only where `source` is a model, a study has its own.
    model : Model, optional
        A custom model, of the name that the study gives.

    Returns
    -------
    Chart or Listing
        Data, SI; `.frame()` is a DataFrame.

    Raises
    ------
    ModelError
        If there is no such view.

    Examples
    --------
    >>> tolstat.view("rolling_block", "shapes").frame().shape
    (9, 8)
    """
    if isinstance(source, Model) or source in catalogue.names():
        loaded = catalogue.find(source)
        chosen = model_settings.make(loaded, settings)
        return view_of(loaded, chosen, name, deviations)
    if settings:
        raise ModelError("a study has settings; change them in its file")
    study = load(source, model=model)
    return view_of(study.model, study.settings, name, deviations, study)


def view_of(
    model: Model,
    settings: Any,
    name: str,
    deviations: Mapping[str, ArrayLike] | None = None,
    study: Study | None = None,
) -> View:
    """Return a view of a trial; the tolerances of a study give its bands."""
    views = offers(model)
    if name not in views:
        raise model.fault(f"it has no view {name}; {allowed_names(name, views)}")
    offer, rows = views[name], _first(model, settings, deviations)
    if study is not None and offer.n_others:
        rows = np.concatenate([rows, study.machines(offer.n_others)])
    result = checked_view(model, offer, rows, settings)
    return in_units(result, study.shown) if study else result


def _first(
    model: Model, settings: Any, deviations: Mapping[str, ArrayLike] | None
) -> Array:
    """Return the trial that is shown, float64[1, contributor]."""
    table = _deviations(dict(deviations or {}), described(model, settings))
    if len(table) != 1:
        raise ModelError(f"a view shows one trial, not {len(table)}")
    return table


def _deviations(by_name: Mapping[str, Any], description: Description) -> Array:
    """Return deviations by name as float64[trial, contributor]."""
    parts = {part.name: part for part in description.contributors}
    names = list(parts)
    columns: dict[str, Array] = {}
    for name, values in by_name.items():
        try:
            column = np.asarray(values, dtype=np.float64)
            expanded = expand(name, names)
        except (TypeError, ValueError) as error:
            raise ModelError(f"deviation {name}: {error}") from None
        if column.ndim > 1 or not np.all(np.isfinite(column)):
            raise ModelError(f"deviation {name}: give a list of finite numbers")
        for part in expanded:
            if part in columns:
                raise ModelError(f"deviation {part} is given twice, also by {name}")
            if (size := parts[part].size) and are_sizes(column, size):
                raise ModelError(
                    f"deviation {part}: these are sizes of a part of nominally "
                    f"{size:.10g} (SI); give deviations, sizes less {size:.10g}"
                )
            if size and (np.abs(column) > MOST_SIZES * abs(size)).any():
                raise ModelError(
                    f"deviation {part}: more than the nominal {size:.10g}; numbers are "
                    "in SI: m, rad, N"
                )
            columns[part] = column
    lengths = {len(column) for column in columns.values() if column.ndim == 1}
    if len(lengths) > 1:
        sizes = ", ".join(map(str, sorted(lengths)))
        raise ModelError(f"deviations are of different lengths: {sizes}")
    table = np.zeros((lengths.pop() if lengths else 1, len(names)))
    for name, column in columns.items():
        table[:, names.index(name)] = column
    return table
