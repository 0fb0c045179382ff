"""The contract checked: what a machine says and answers, before anybody builds on."""

from __future__ import annotations

import math
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.deviations.spread import Spread
from tolstat.errors import ModelError, TolstatError, UnitError
from tolstat.model.contract import Answers, Model, Outcome
from tolstat.model.description import Contributor, Description, Response, StudyNumber
from tolstat.model.view import Chart, Listing, Offer, View
from tolstat.status import FIRST_OWN, Status, words_of
from tolstat.units.conversion import check_si, to_si

Array = NDArray[np.float64]

# what a run file and a frame call by these names
RESERVED = (
    "trial", "status", "steps", "nominal", "reference", "audit", "rerun", "settings",
    "numbers", "diagnostics", "checks", "provenance",
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
    _check_words(model)
    for word in model.failures:
        if word in words_of().values():
            raise ModelError(
                f"model '{model.name}': the failure {word!r} is no new word"
            )
    for word, sentence in dict(model.conditions).items():
        if word not in model.failures or not _printable(sentence):
            raise ModelError(
                f"model '{model.name}': conditions are sentences, each for one of its "
                f"failures, not {word!r}: {sentence!r}"
            )
    if len(model.failures) > MOST_FAILURES:
        raise ModelError(f"model '{model.name}': at most {MOST_FAILURES} failures")
    return model


def _check_words(model: Model) -> None:
    """Refuse sentences and failures that are no lists of texts."""
    where = f"model '{model.name}'"
    for what in ("failures", "assumptions"):
        words = getattr(model, what)
        if not isinstance(words, tuple | list) or not all(map(_printable, words)):
            raise ModelError(
                f'{where}: {what} is a tuple of texts, such as ("cuts air",), not '
                f"{words!r}"
            )
        if len(set(words)) < len(words):
            raise ModelError(f"{where}: {what} names something twice")
    for offer in model.views:
        if not isinstance(offer, Offer) or not _printable(offer.name):
            raise ModelError(f"{where}: views is a tuple of Offer, not {offer!r}")


def _printable(text: object) -> bool:
    """Tell texts that can be stored and printed: no control characters."""
    return isinstance(text, str) and text != "" and text.isprintable()


@contextmanager
def _asking(model: Model, what: str) -> Iterator[None]:
    """Name the machine, the fault and its line, where the machine's own code fails."""
    try:
        yield
    except TolstatError:
        raise
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise ModelError(
            f"model '{model.name}': {what} fails: {type(error).__name__}: {error} "
            f"({Path(last.filename).name}, line {last.lineno})"
        ) from error


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
        If a name cannot be typed, stands twice or is taken, a unit is unknown, a range
        is none, or there is no response; naming the machine and the fault.
    """
    where = f"model '{model.name}'"
    with _asking(model, "describe"):
        contributors, responses = model.describe(settings)
        found = Description(tuple(contributors), tuple(responses))
    if not found.responses:
        raise ModelError(f"{where} has no response")
    names: set[str] = set()
    for what in (*found.contributors, *found.responses):
        kind = "contributor" if isinstance(what, Contributor) else "response"
        if not isinstance(what, Contributor | Response):
            raise ModelError(f"{where}: {what!r} is neither contributor nor response")
        for text in (what.symbol, what.sentence, what.source, what.unit, what.shown):
            if text != "" and not _printable(text):
                raise ModelError(f"{where}: {what.name}: {text!r} is no text to print")
        if not isinstance(what.name, str) or not what.name.isidentifier():
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
            check_si(what.unit)
            to_si(1.0, what.shown or what.unit, what.unit)
        except UnitError as error:
            raise ModelError(f"{where}: {kind} {what.name}: {error}") from None
        if isinstance(what, Response) and what.range is not None:
            try:
                lower, upper = map(float, what.range)
            except (TypeError, ValueError):
                lower = upper = math.nan
            if not lower < upper:
                raise ModelError(
                    f"{where}: {what.name}: its range {what.range!r} is none; two "
                    "numbers, the lower first"
                )
    return found


def numbers_of(
    model: Model,
    settings: Any,
    spreads: Mapping[str, Spread],
    *,
    independent: bool = True,
) -> tuple[StudyNumber, ...]:
    """Return the numbers of a study, their names and units checked.

    Parameters
    ----------
    model : Model
        The machine.
    settings : object
        Of it.
    spreads : mapping of str to Spread
        By contributor that deviates.
    independent : bool
        Whether these deviate independently of each other.
    """
    where = f"model '{model.name}'"
    units = {each.name: each.unit for each in described(model, settings).responses}
    with _asking(model, "numbers"):
        found = tuple(model.numbers(settings, spreads, independent=independent))
        names = [number.name for number in found]
    for number in found:
        if not str(number.name).isidentifier() or names.count(number.name) > 1:
            raise ModelError(f"{where}: number {number.name!r} has no name of its own")
        texts = (number.sentence, number.shown, number.of, number.caveat)
        if not all(text == "" or _printable(text) for text in texts):
            raise ModelError(f"{where}: number {number.name}: {texts!r} are no texts")
        if isinstance(number.value, bool) or not isinstance(number.value, int | float):
            raise ModelError(
                f"{where}: number {number.name}: {number.value!r} is no number"
            )
        try:
            check_si(number.unit)
            to_si(1.0, number.shown or number.unit, number.unit)
        except UnitError as error:
            raise ModelError(f"{where}: number {number.name}: {error}") from None
        if number.of and units.get(number.of) != number.unit:
            raise ModelError(
                f"{where}: number {number.name}: no response {number.of} has its unit, "
                f"{number.unit}"
            )
    return found


def simulate(model: Model, deviations: Array, settings: Any) -> Answers:
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
    Answers
        With the status of every trial; the responses of failed ones are NaN.

    Raises
    ------
    ModelError
        If shapes, statuses or numbers are not what the contract asks for.
    """
    rows = deviations.view()
    rows.flags.writeable = False  # what is stored is what was drawn
    ruled_out = impossible(model, rows, settings)
    if not ruled_out.any():
        return _evaluated(model, rows, settings)
    status, possible = ruled_out.copy(), ruled_out == 0
    responses = np.full((len(rows), len(model.describe(settings).responses)), np.nan)
    steps = np.zeros(len(rows), np.int64) if model.integrates else None
    if possible.any():
        found = _evaluated(model, rows[possible], settings)
        status[possible], responses[possible] = found.status, found.responses
        if steps is not None and found.steps is not None:
            steps[possible] = found.steps
    return Answers(responses, status, steps)


def _evaluated(model: Model, rows: Array, settings: Any) -> Answers:
    """Evaluate machines that can be built."""
    with _asking(model, "evaluate"):
        outcome = model.evaluate(rows, settings)
    return complete(model, outcome, len(rows), settings)


def impossible(model: Model, deviations: Array, settings: Any) -> NDArray[np.int64]:
    """Tell which machines cannot be built, and why.

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
    int64[trial]
        0 where a machine can be built, else the status that its trial ends with.
    """
    where = f"model '{model.name}'"
    with _asking(model, "impossible"):
        told = {**model.impossible(deviations, settings)}
    status = np.zeros(len(deviations), np.int64)
    for word, ruled_out in told.items():
        if word not in model.conditions:
            raise ModelError(f"{where}: '{word}' is none of its conditions")
        shape = (len(deviations),)
        those = _shaped(where, f"impossible '{word}'", ruled_out, shape) != 0
        status[those & (status == 0)] = FIRST_OWN + model.failures.index(word)
    return status


def complete(model: Model, outcome: Outcome, trials: int, settings: Any) -> Answers:
    """Check an outcome of so many trials, and complete it; see `simulate`."""
    where = f"model '{model.name}'"
    with _asking(model, "describe"):
        _, described_now = model.describe(settings)
        names = [each.name for each in described_now]
    if not isinstance(outcome, Outcome):
        raise ModelError(
            f"{where}: evaluate returns {type(outcome).__name__}, no Outcome"
        )
    responses = _shaped(where, "responses", outcome.responses, (trials, len(names)))
    status = np.where(
        np.isfinite(responses).all(axis=1), Status.DONE, Status.NOT_FINITE
    )
    if outcome.status is not None:
        status = _whole(where, "status", outcome.status, trials)
    steps = outcome.steps
    if model.integrates != (steps is not None):
        said = "counts no steps, but integrates" if model.integrates else "counts steps"
        raise ModelError(f"{where} {said}; `integrates` says whether it does")
    if steps is not None:
        steps = _whole(where, "steps", steps, trials)
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
    for column, each in enumerate(described_now):
        lower, upper = each.range or (-math.inf, math.inf)
        values = responses[done, column]
        beyond = values[(values < lower) | (values > upper)]
        if len(beyond):
            raise ModelError(
                f"{where}: {each.name} is {beyond[0]:.17g} in {len(beyond)} of "
                f"{trials} trials of a block, and its range is declared as {lower:g} "
                f".. {upper:g}; where rounding does that, clip it where it is made"
            )
    return Answers(np.where(done[:, None], responses, np.nan), status, steps)


def _whole(where: str, what: str, values: ArrayLike, trials: int) -> NDArray[np.int64]:
    found = _shaped(where, what, values, (trials,))
    if not (np.isfinite(found) & (found >= 0) & (found == np.round(found))).all():
        raise ModelError(f"{where}: {what} are whole numbers from 0")
    return found.astype(np.int64)


def _shaped(where: str, what: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    try:
        given = np.asarray(values)
        if given.dtype.kind not in "biuf":
            raise TypeError
        found = given.astype(np.float64)
    except (TypeError, ValueError):
        raise ModelError(f"{where}: {what} are no real numbers") from None
    if found.shape != shape:
        hint = "; write y[:, None]" if found.shape == shape[:1] else ""
        wanted, there = (" x ".join(map(str, s)) or "one" for s in (shape, found.shape))
        raise ModelError(
            f"{where}: {what} of {wanted} numbers are expected, a row for each trial; "
            f"these are {there}" + hint
        )
    return found


def tightened(model: Model, settings: Any) -> Any | None:
    """Return settings that evaluate more precisely, checked; None without any."""
    with _asking(model, "tightened"):
        tight = model.tightened(settings)
    if tight is not None and (type(tight) is not type(settings) or tight == settings):
        raise ModelError(
            f"model '{model.name}': tightened returns other settings of its own kind"
        )
    return tight


def history_of(
    model: Model, deviations: Array, settings: Any, step: float
) -> tuple[Chart, Answers]:
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
    with _asking(model, "history"):
        chart, outcome = model.history(deviations, settings, step)
    _check_view(model, chart)
    if impossible(model, deviations[None, :], settings).any():
        return chart, simulate(model, deviations[None, :], settings)
    return chart, complete(model, outcome, 1, settings)


def offers(model: Model) -> dict[str, Offer]:
    """Return what a machine can show, by name."""
    moving = (
        [Offer("history", "how the machine moves, over time")] if model.moves else []
    )
    return {offer.name: offer for offer in (*moving, *model.views)}


def shown(model: Model, name: str, deviations: Array, settings: Any) -> View:
    """Show a view other than the history, and check what it holds; see `Model.view`."""
    with _asking(model, f"view {name}"):
        view = model.view(name, deviations, settings)
    _check_view(model, view)
    return view


def _check_view(model: Model, view: object) -> None:
    if not isinstance(view, Chart | Listing):
        raise ModelError(
            f"model '{model.name}': a view is a Chart or a Listing, not "
            f"{type(view).__name__}"
        )
    where = f"model '{model.name}'"
    try:
        parts = list(view.parts())
    except ValueError as error:
        raise ModelError(f"{where}: heads and columns of a view: {error}") from None
    for name, at, values in parts:
        for each in (at, values):
            if not isinstance(each, np.ndarray) or each.ndim != 1:
                raise ModelError(f"{where}: {name} is no array of one dimension")
            if each.dtype.kind not in "iufU":
                raise ModelError(f"{where}: {name} holds neither numbers nor texts")
        if len(at) != len(values):
            raise ModelError(
                f"{where}: {name} has {len(values)} values over {len(at)} points"
            )
    names = [name for name, _, _ in parts]
    if twice := {name for name in names if names.count(name) > 1}:
        raise ModelError(f"{where}: a view has {min(twice)} twice")
    if isinstance(view, Chart):
        curves = {curve.name for curve in view.curves}
        asked = [(f"panel '{p.title}'", n) for p in view.panels for n in p.every]
        asked += [("a mark", mark.curve) for mark in view.marks]
        known = {*curves, *(b.name for b in view.bands)}
        known |= {region.name for region in view.regions}
        units = {c.name: c.unit for c in view.curves}
        units |= {b.name: b.unit for b in view.bands}
        units |= {r.name: r.unit for r in view.regions}
        for panel in view.panels:
            for side in (panel.names, panel.right):
                if len({units.get(name) for name in side} - {None}) > 1:
                    raise ModelError(
                        f"{where}: panel '{panel.title}' mixes units on one axis: "
                        f"{', '.join(side)}; put one of them to the right"
                    )
        for what, name in asked:
            if name not in (curves if what == "a mark" else known):
                raise ModelError(
                    f"{where}: {what} shows {name}, which the view does not have"
                )
    if not parts:
        raise ModelError(f"{where}: a view shows nothing")
