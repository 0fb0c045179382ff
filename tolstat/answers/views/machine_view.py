"""What a machine can show: a view by its name, a trajectory as a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat import catalogue
from tolstat.answers.views.evaluate import deviations_table
from tolstat.errors import ModelError, allowed_names
from tolstat.model import settings as model_settings
from tolstat.model.checked import described, history_of, offers, shown
from tolstat.model.contract import STEP, Model
from tolstat.model.view import View
from tolstat.status import words_of
from tolstat.study.study import Source, Study, load

if TYPE_CHECKING:
    import pandas as pd


def view(
    source: Source | Model,
    name: str,
    deviations: Mapping[str, ArrayLike] | None = None,
    settings: Mapping[str, Any] | None = None,
    *,
    model: Model | None = None,
) -> View:
    """Show a machine: the nominal one, or one with the deviations given.

    Parameters
    ----------
    source : path, mapping, str or Model
        A study, as a .toml file or as what one would hold; or a machine, by its name
        or the object itself.
    name : str
        Of the view; `tolstat show MODEL` lists them.
    deviations : mapping, optional
        By contributor name, SI: of a machine that is not nominal.
    settings : mapping, optional
        By name, SI; only where `source` is a machine, a study has its own.
    model : Model, optional
        A machine of your own, of the name that the study gives.

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
    >>> tolstat.view("stand", "history", {"crank_difference": 1e-3}).frame()
    """
    if isinstance(source, Model) or source in catalogue.names():
        machine = catalogue.find(source)
        chosen = model_settings.make(machine, settings)
        first = _first(machine, chosen, deviations)
        return view_of(machine, chosen, name, first)
    if settings:
        raise ModelError("a study has its own settings; change them there")
    study = load(source, model=model)
    first = _first(study.model, study.settings, deviations)
    return view_of(study.model, study.settings, name, first, study)


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
    first = _first(machine, chosen, deviations)
    chart, outcome = history_of(machine, first[0], chosen, step)
    frame = chart.frame()
    names = [response.name for response in described(machine, chosen).responses]
    values = outcome.responses[0].tolist()
    frame.attrs["responses"] = dict(zip(names, values, strict=True))
    frame.attrs["status"] = words_of(machine.failures)[int(outcome.status[0])]
    return frame


def _first(
    model: Model, settings: Any, deviations: Mapping[str, ArrayLike] | None
) -> NDArray[np.float64]:
    """Return the machine that is shown, float64[1, contributor]."""
    table = deviations_table(dict(deviations or {}), described(model, settings))
    if len(table) != 1:
        raise ModelError(f"one machine is shown, not {len(table)}")
    return table


def view_of(
    model: Model,
    settings: Any,
    name: str,
    first: NDArray[np.float64],
    study: Study | None = None,
) -> View:
    """Show a machine.

    `first` is the machine that is shown, float64[1, contributor]; the tolerances of a
    study open the bands of a view that has such.
    """
    known = offers(model)
    if name not in known:
        raise model.fault(f"it has no view {name}; {allowed_names(name, known)}")
    offer, rows = known[name], first
    if study is not None and offer.n_others:
        rows = np.concatenate([first, study.machines(offer.n_others)])
    return shown(model, offer, rows, settings)
