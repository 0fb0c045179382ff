"""The contract checked: what a machine says and answers, before anybody builds on."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.errors import ModelError, UnitError
from tolstat.model.contract import History, Model, Outcome
from tolstat.model.description import Contributor, Description, Response
from tolstat.model.view import Chart, Listing, Offer, View
from tolstat.status import FIRST_OWN, Status, words_of
from tolstat.units.conversion import to_si

Array = NDArray[np.float64]

# what a run file and a frame call by these names
RESERVED = (
    "trial", "status", "steps", "nominal", "reference", "audit", "evidence", "settings",
)  # fmt: skip
MOST_FAILURES = 256 - FIRST_OWN


def check_model(model: object) -> Model:
    """Return a machine, if it is one.

    Raises
    ------
    ModelError
        If it is something else, or lacks a part that every machine has.
    """
    if isinstance(model, type) and issubclass(model, Model):
        try:
            model = model()
        except TypeError as error:
            raise ModelError(f"{error}") from None
    if not isinstance(model, Model):
        raise ModelError(
            f"{model!r} is no machine: a class that inherits from tolstat.Model, or an "
            "object of one, is expected"
        )
    if not isinstance(getattr(model, "name", None), str) or not model.name:
        raise ModelError(f"{type(model).__name__}: a machine needs a name")
    for word in model.failures:
        if not isinstance(word, str) or word in words_of().values():
            raise ModelError(
                f"model '{model.name}': the failure {word!r} is no new word"
            )
    if len(model.failures) > MOST_FAILURES:
        raise ModelError(f"model '{model.name}': at most {MOST_FAILURES} failures")
    return model


def described(model: Model, settings: Any) -> Description:
    """Return contributors and responses, their names and units checked.

    Parameters
    ----------
    model : Model
        The machine.
    settings : object
        Of it; they may decide what there is.

    Raises
    ------
    ModelError
        If a name cannot be typed, stands twice or is taken, a unit is unknown, or
        there is no response; naming the machine and the fault.
    """
    contributors, responses = model.describe(settings)
    found = Description(tuple(contributors), tuple(responses))
    where = f"model '{model.name}'"
    if not found.responses:
        raise ModelError(f"{where} has no response")
    names: set[str] = set()
    for what in (*found.contributors, *found.responses):
        kind = "contributor" if isinstance(what, Contributor) else "response"
        if not isinstance(what, Contributor | Response):
            raise ModelError(f"{where}: {what!r} is neither contributor nor response")
        if not what.name.isidentifier():
            raise ModelError(
                f"{where}: the {kind} {what.name!r} cannot be typed; letters, digits "
                "and _ are allowed, a letter first"
            )
        if what.name in RESERVED:
            raise ModelError(
                f"{where}: no {kind} can be called {what.name}; that is a column of "
                f"every run ({', '.join(RESERVED)})"
            )
        if what.name in names:
            raise ModelError(f"{where}: {what.name} stands twice")
        names.add(what.name)
        try:
            to_si(1.0, what.shown or what.unit, what.unit)
        except UnitError as error:
            raise ModelError(f"{where}: {kind} {what.name}: {error}") from None
    return found


def simulate(model: Model, deviations: Array, settings: Any) -> Outcome:
    """Evaluate a machine, and check its answer.

    Parameters
    ----------
    model : Model
        The machine.
    deviations : float64[trial, contributor]
        SI.
    settings : object
        Of it.

    Returns
    -------
    Outcome
        With the status of every trial; the responses of failed ones are NaN.

    Raises
    ------
    ModelError
        If shapes, statuses or numbers are not what the contract asks for.
    """
    return complete(
        model, model.evaluate(deviations, settings), len(deviations), settings
    )


def complete(model: Model, outcome: Outcome, trials: int, settings: Any) -> Outcome:
    """Check an outcome of so many trials, and complete it; see `simulate`."""
    where = f"model '{model.name}'"
    names = [each.name for each in model.describe(settings).responses]
    if not isinstance(outcome, Outcome):
        raise ModelError(
            f"{where}: evaluate returns {type(outcome).__name__}, no Outcome"
        )
    responses = _shaped(where, "responses", outcome.responses, (trials, len(names)))
    status = np.where(
        np.isfinite(responses).all(axis=1), Status.DONE, Status.NOT_FINITE
    )
    if outcome.status is not None:
        status = _shaped(where, "status", outcome.status, (trials,)).astype(np.int64)
    steps = outcome.steps
    if model.integrates != (steps is not None):
        said = "counts no steps, but integrates" if model.integrates else "counts steps"
        raise ModelError(f"{where} {said}; `integrates` says whether it does")
    if steps is not None:
        steps = _shaped(where, "steps", steps, (trials,)).astype(np.int64)
    for word, failed in outcome.failed.items():
        if word not in model.failures:
            raise ModelError(
                f"{where}: '{word}' is none of its failures {model.failures}"
            )
        failing = _shaped(where, f"failed '{word}'", failed, (trials,)).astype(bool)
        code = FIRST_OWN + model.failures.index(word)
        status = np.where(failing & (status != Status.NOT_RUN), code, status)
    unknown = set(np.unique(status).tolist()) - set(words_of(model.failures))
    if unknown or np.any(status == Status.NOT_RUN):
        wrong = sorted(unknown) or "0, not run"
        raise ModelError(f"{where}: status {wrong} is none that a trial ends with")
    done = status == Status.DONE
    if not np.isfinite(responses[done]).all():
        trial, response = np.argwhere(done[:, None] & ~np.isfinite(responses))[0]
        raise ModelError(
            f"{where}: {names[response]} is {responses[trial, response]} in a trial "
            f"whose status is done ({trial} of the block of {trials})"
        )
    return Outcome(np.where(done[:, None], responses, np.nan), status, steps)


def _shaped(where: str, what: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    try:
        found = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ModelError(f"{where}: {what} are no numbers") from None
    if found.shape != shape:
        wanted, there = (" x ".join(map(str, s)) or "one" for s in (shape, found.shape))
        raise ModelError(
            f"{where}: {what} of {wanted} numbers are expected, a row for each trial; "
            f"these are {there}"
        )
    return found


def history_of(model: Model, deviations: Array, settings: Any, step: float) -> History:
    """Tell how one machine of deviations[contributor] moved, and check its outcome.

    Parameters
    ----------
    model : Model
        The machine.
    deviations : float64[contributor]
        SI.
    settings : object
        Of it.
    step : float
        Time between two points, s.

    Raises
    ------
    ModelError
        If the machine does not move, or the step is no time above zero.
    """
    if not 0 < step < np.inf:
        raise ModelError(f"step = {step:g}: a time above 0 s is expected")
    chart, outcome = model.history(deviations, settings, step)
    _check_view(model, chart)
    return History(chart, complete(model, outcome, 1, settings))


def offers(model: Model) -> dict[str, Offer]:
    """Return what a machine can show, by name."""
    moving = (
        [Offer("history", "how the machine moves, over time")] if model.moves else []
    )
    return {offer.name: offer for offer in (*moving, *model.views)}


def shown(model: Model, name: str, deviations: Array, settings: Any) -> View:
    """Show a view other than the history, and check what it holds; see `Model.view`."""
    view = model.view(name, deviations, settings)
    _check_view(model, view)
    return view


def _check_view(model: Model, view: object) -> None:
    if not isinstance(view, Chart | Listing):
        raise ModelError(
            f"model '{model.name}': a view is a Chart or a Listing, not "
            f"{type(view).__name__}"
        )
    columns = list(view.columns())
    for axis, values in columns:
        if len(values) != len(columns[0][1]):
            raise ModelError(
                f"model '{model.name}': {axis.name} has {len(values)} values over "
                f"{len(columns[0][1])} points"
            )
    if isinstance(view, Chart):
        known = {curve.name for curve in view.curves}
        known |= {band.name for band in view.bands}
        known |= {region.name for region in view.regions}
        for panel in view.panels:
            for each in (*panel.names, *panel.right):
                if each not in known:
                    raise ModelError(
                        f"model '{model.name}': panel '{panel.title}' shows {each}, "
                        "which the view does not have"
                    )
