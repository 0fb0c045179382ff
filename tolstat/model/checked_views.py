"""Checks of what a model shows: its views, and histories of one trial."""

from dataclasses import replace
from typing import Any

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.model.checked import check_possible, complete, impossible, simulate
from tolstat.model.contract import STEP, Model, TrialResults, guarded
from tolstat.model.mechanism import Mechanism
from tolstat.model.view import Chart, Listing, Offer, View


def history_of(
    model: Model, deviations: Array, settings: Any, step: float
) -> tuple[Chart, TrialResults]:
    """Return the checked history of one trial of deviations[contributor], SI.

    Raises ModelError if the model does not move, or the step, s, is not above zero.
    """
    if not 0 < step < np.inf:
        raise ModelError(f"step = {step:g}: a time above 0 s is expected")
    trial = deviations[None, :]
    possible = not impossible(model, trial, settings).any()
    with guarded(model, "history"):
        # a trial that cannot be built has the curves of the nominal one, emptied
        moving = deviations if possible else np.zeros_like(deviations)
        chart, outcome = model.history(moving, settings, step)
    _check_view(model, chart)
    if possible:
        return chart, complete(model, outcome, 1, settings)
    curves = [c._replace(values=np.full_like(c.values, np.nan)) for c in chart.curves]
    empty = replace(chart, curves=tuple(curves), bands=(), marks=(), regions=())
    return empty, simulate(model, trial, settings)


def offers(model: Model) -> dict[str, Offer]:
    """Return the views of a model, by name."""

    def history(deviations: Array, settings: Any) -> Chart:
        return history_of(model, deviations[0], settings, STEP)[0]

    motion = Offer("history", "motion of one trial over time", history)
    views = (motion, *model.views) if model.moves else model.views
    return {offer.name: offer for offer in views}


def checked_view(model: Model, offer: Offer, deviations: Array, settings: Any) -> View:
    """Return one of the model's views, checked; see `Offer`.

    Rows of `deviations` that cannot be built are left out. Raises ModelError if the
    first row of `deviations` cannot be built: there is nothing to show.
    """
    check_possible(model, deviations[:1], settings, "this machine")
    possible = impossible(model, deviations, settings) == 0
    with guarded(model, f"view {offer.name}"):
        view = offer.function(deviations[possible], settings)
    _check_view(model, view)
    return view


def mechanism_of(model: Model, deviations: Array, settings: Any) -> Mechanism:
    """Return the checked mechanism of one trial of deviations[contributor], SI.

    Raises ModelError if the model has none, or the trial cannot be built.
    """
    check_possible(model, deviations[None, :], settings, "this machine")
    with guarded(model, "mechanism"):
        mechanism = model.mechanism(deviations, settings)
        if not isinstance(mechanism, Mechanism):
            kind = type(mechanism).__name__
            raise model.fault(f"mechanism returns a Mechanism, not {kind}")
        fault = mechanism.fault
    if fault:
        raise model.fault(fault)
    return mechanism


def _check_view(model: Model, view: object) -> None:
    if not isinstance(view, Chart | Listing):
        kind = type(view).__name__
        raise model.fault(f"a view is a Chart or a Listing, not {kind}")
    try:
        parts = list(view.parts())
    except ValueError as error:
        raise model.fault(f"heads and columns of a view: {error}") from None
    names = [name for name, _, _ in parts]
    for name, points, values in parts:
        for array in (points, values):
            flat = isinstance(array, np.ndarray) and array.ndim == 1
            if not flat or array.dtype.kind not in "iufU":
                raise model.fault(f"{name} is no array of numbers or texts")
        if len(points) != len(values):
            words = f"{len(values)} values over {len(points)} points"
            raise model.fault(f"{name} has {words}")
        if names.count(name) > 1:
            raise model.fault(f"a view has {name} twice")
    if isinstance(view, Chart):
        _check_panels(model, view)


def _check_panels(model: Model, chart: Chart) -> None:
    """Refuse panels and marks of missing curves, and axes with two units."""
    units, curves = chart.units, {curve.name for curve in chart.curves}
    for mark in chart.marks:
        if mark.curve not in curves:
            words = f"a mark shows {mark.curve}, which the view does not have"
            raise model.fault(words)
    for panel in chart.panels:
        for name in panel.every:
            if name not in units:
                words = f"shows {name}, which the view does not have"
                raise model.fault(f"panel '{panel.title}' {words}")
        for side in (panel.names, panel.right):
            if len({units[name] for name in side}) > 1:
                raise model.fault(
                    f"panel '{panel.title}' mixes units on one axis: "
                    f"{', '.join(side)}; put one of them to the right"
                )
