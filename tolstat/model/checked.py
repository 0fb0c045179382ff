"""Checks of a model: its declarations, and its answers."""

import math
import os
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping
from contextlib import chdir, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from threading import current_thread, main_thread
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tolstat.arrays import Array, Integers, Truths
from tolstat.errors import ModelError, TolstatError, UnitError, told
from tolstat.model.contract import STEP, Answers, Model, Outcome, Spreads
from tolstat.model.description import Contributor, Description, Response, StudyNumber
from tolstat.model.view import Chart, Listing, Offer, View
from tolstat.status import Status, words_of
from tolstat.units.conversion import check_si, to_si

# names of columns that every run file and frame has
RESERVED = (
    "trial", "status", "steps", "nominal", "reference", "audit", "rerun", "settings",
    "numbers", "diagnostics", "checks", "provenance",
)  # fmt: skip
DECLARED = {Contributor: "contributor", Response: "response", StudyNumber: "number"}
DECLARATIONS = "name", "failures", "assumptions", "views", "moves", "integrates"
SIDES = "least", "largest"  # of a worst case
STREAMS = {"stdout": 1, "stderr": 2}  # of the process, with their descriptors
TEXTS = "unit", "symbol", "sentence", "source", "shown", "of", "caveat", "worst"


def check_model(model: object) -> Model:
    """Return an object that is a model; refuse any other.

    Raises ModelError if it is something else, or lacks a part that every model has.
    """
    try:
        if isinstance(model, type) and issubclass(model, Model):
            model = model()
        for name in DECLARATIONS:  # properties may fail
            getattr(model, name, None)
    except (Exception, SystemExit, GeneratorExit) as error:
        kind = model if isinstance(model, type) else type(model)
        raise ModelError(f"{kind.__name__}: {told(error)}") from error
    if not isinstance(model, Model):
        raise ModelError(
            f"{model!r} is not a model; a class that inherits from tolstat.Model, or "
            "an instance of one, is expected"
        )
    if not isinstance(getattr(model, "name", None), str) or not model.name:
        raise ModelError(f"{type(model).__name__}: a model needs a name")
    failures, assumptions = model.failures, model.assumptions
    if not isinstance(failures, Mapping) or not all(
        map(_printable, (*failures, *failures.values()))
    ):
        raise model.fault(
            "failures must map a word to the sentence that has to be true, such as "
            f'{{"cuts air": "the tool stays in the cut"}}, not {failures!r}'
        )
    for word in failures:
        if word in words_of().values():
            raise model.fault(f"the failure {word!r} is a word of tolstat; use another")
    listed = isinstance(assumptions, tuple | list)
    if not listed or not all(map(_printable, assumptions)):
        raise model.fault(f"assumptions must be a tuple of texts, not {assumptions!r}")
    for offer in model.views if isinstance(model.views, tuple | list) else ("",):
        named = isinstance(offer, Offer) and _printable(offer.name)
        if not (named and callable(offer.function)):
            raise model.fault(f"views must be a tuple of Offer, not {offer!r}")
    return model


def _printable(text: object) -> bool:
    """Return whether an object is a text that can be stored and printed."""
    return isinstance(text, str) and text != "" and text.isprintable()


@contextmanager
def _asking(model: Model, what: str) -> Iterator[None]:
    """Name the model, the fault and its line, where the model's own code fails."""
    before = {name: getattr(sys, name) for name in STREAMS}
    try:  # a model may leave the working directory, which all threads share
        with chdir(".") if current_thread() is main_thread() else nullcontext():
            yield
        if lost := [name for name, each in before.items() if _mended(name, each)]:
            raise model.fault(f"{what} closes or breaks sys.{lost[0]}; leave it open")
    except (TolstatError, KeyboardInterrupt):
        raise
    except BaseException as error:
        for name, each in before.items():
            _mended(name, each)
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise model.fault(
            f"{what} fails: {told(error)} "
            f"({Path(last.filename).name}, line {last.lineno})"
        ) from error


def _mended(name: str, before: Any) -> bool:
    """Mend a stream of the process that is closed or broken; return whether it was."""
    if not _writable(before, closed=True) or _writable(getattr(sys, name)):
        return False
    if not _writable(before):  # closed, but not its descriptor
        encoding = getattr(before, "encoding", None)
        before = os.fdopen(STREAMS[name], "w", encoding=encoding, closefd=False)
    setattr(sys, name, before)
    return True


def _writable(stream: Any, *, closed: bool = False) -> bool:
    """Return whether a stream can be written, or could before it was closed."""
    return hasattr(stream, "write") and (closed or not getattr(stream, "closed", False))


def described(model: Model, settings: Any) -> Description:
    """Return contributors and responses, their names and units checked.

    They may depend on the settings. Raises ModelError if a name cannot be typed, is
    given twice or reserved, a unit is unknown, a range is wrong, or there is no
    response. The message names model and fault.
    """
    with _asking(model, "describe"):
        contributors, responses = model.describe(settings)
        found = Description(tuple(contributors), tuple(responses))
    if not found.responses:
        raise model.fault("describe gives no response")
    every: list[Contributor | Response] = [*found.contributors, *found.responses]
    _check_declared(model, every)
    for name in [each.name for each in every if each.name in RESERVED]:
        words = f"the name {name} is reserved for a column of every run"
        raise model.fault(f"{words} ({', '.join(RESERVED)})")
    for each in found.responses:
        try:
            lower, upper = map(float, (0, 1) if each.range is None else each.range)
        except (TypeError, ValueError):
            lower = upper = math.nan
        if not lower < upper:
            raise model.fault(
                f"{each.name}: the range {each.range!r} must be two numbers, the lower "
                "first"
            )
    return found


def numbers_of(
    model: Model, settings: Any, spreads: Spreads, *, independent: bool = True
) -> tuple[StudyNumber, ...]:
    """Return the checked numbers of a study; see `Model.numbers`."""
    units = {each.name: each.unit for each in described(model, settings).responses}
    with _asking(model, "numbers"):
        found = tuple(model.numbers(settings, spreads, independent=independent))
    _check_declared(model, found)
    for each in found:
        if isinstance(each.value, bool) or not isinstance(each.value, int | float):
            raise model.fault(f"number {each.name}: {each.value!r} is not a number")
        if each.of and units.get(each.of) != each.unit:
            raise model.fault(
                f"number {each.name}: no response {each.of} with its unit, {each.unit}"
            )
        if each.worst and not (each.of and each.worst in SIDES):
            raise model.fault(
                f"number {each.name}: worst = {each.worst!r}; {' or '.join(SIDES)} is "
                "allowed, of the response that `of` names"
            )
    return found


def model_warnings(model: Model, settings: Any, spreads: Spreads) -> tuple[str, ...]:
    """Return the checked warnings of a model about a study; see `Model.warnings`."""
    with _asking(model, "warnings"):
        warnings = tuple(model.warnings(settings, spreads))
    for sentence in warnings:
        if not _printable(sentence):
            raise model.fault(f"warnings: {sentence!r} cannot be printed")
    return warnings


def _check_declared(
    model: Model, declared: Iterable[Contributor | Response | StudyNumber]
) -> None:
    """Refuse names that cannot be typed, texts that cannot be printed, wrong units."""
    names: set[str] = set()
    for each in declared:
        kind = DECLARED.get(type(each))
        if kind is None:
            raise model.fault(f"{each!r} is not a {' or '.join(DECLARED.values())}")
        if not isinstance(each.name, str) or not each.name.isidentifier():
            raise model.fault(
                f"the {kind} {each.name!r} cannot be typed; letters, digits and _ are "
                "allowed, a letter first"
            )
        if each.name in names:
            raise model.fault(f"{each.name} is given twice")
        names.add(each.name)
        for text in (getattr(each, name, "") for name in TEXTS):
            if text != "" and not _printable(text):
                raise model.fault(f"{kind} {each.name}: {text!r} cannot be printed")
        try:
            check_si(each.unit)
            to_si(1.0, each.shown or each.unit, each.unit)
        except UnitError as error:
            raise model.fault(f"{kind} {each.name}: {error}") from None


def simulate(model: Model, deviations: Array, settings: Any) -> Answers:
    """Return the checked answers of deviations[trial, contributor], SI.

    Every trial has a status; the responses of failed trials are NaN. Raises ModelError
    if shapes, statuses or numbers do not fit the contract.
    """
    rows = deviations.view()
    rows.flags.writeable = False  # the stored deviations stay as they were sampled
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
    """Return the outcome of trials that can be built."""
    with _asking(model, "evaluate"):
        outcome = model.evaluate(rows, settings)
    with _asking(model, "evaluate"):  # an outcome may have properties of its own
        return complete(model, outcome, len(rows), settings)


def impossible(model: Model, deviations: Array, settings: Any) -> Integers:
    """Return which trials of deviations[trial, contributor], SI, cannot be built.

    int64[trial]: 0 if a trial can be built, else its status.
    """
    with _asking(model, "impossible"):
        told = {**model.impossible(deviations, settings)}
    status = np.zeros(len(deviations), np.int64)
    for code, those in _failing(model, "impossible", told, len(deviations)):
        status[those & (status == 0)] = code
    return status


def check_possible(model: Model, trial: Array, settings: Any, called: str) -> None:
    """Refuse one trial, float64[1, contributor], that cannot be built."""
    if status := int(impossible(model, trial, settings)[0]):
        word = words_of(model.failures)[status]
        required = model.failures[word]
        raise ModelError(f"{called} cannot be built: {word} ({required})")


def _failing(
    model: Model, where: str, told: Mapping[str, ArrayLike], trials: int
) -> Iterator[tuple[int, Truths]]:
    """Yield the status of each word, and the trials that end with it."""
    if not isinstance(told, Mapping):
        raise model.fault(f"{where} must be a mapping by failure, not {told!r}")
    codes = {word: code for code, word in words_of(model.failures).items()}
    for word, those in told.items():
        if word not in model.failures:
            words = ", ".join(model.failures) or "there are none"
            raise model.fault(f"'{word}' is not in its failures ({words})")
        if np.asarray(those).dtype != np.bool_:
            raise model.fault(f"{where} '{word}' must be true or false for each trial")
        yield codes[word], _shaped(model, f"{where} '{word}'", those, (trials,)) != 0


def complete(model: Model, outcome: Outcome, trials: int, settings: Any) -> Answers:
    """Return the checked answers of an outcome of so many trials; see `simulate`."""
    with _asking(model, "describe"):
        _, described_now = model.describe(settings)
        names = [each.name for each in described_now]
    if not isinstance(outcome, Outcome):
        raise model.fault(f"evaluate returns {type(outcome).__name__}, not Outcome")
    responses = _shaped(model, "responses", outcome.responses, (trials, len(names)))
    finite = np.abs(responses) < 1e150  # their squares are finite, too
    status = np.where(finite.all(axis=1), Status.DONE, Status.NOT_FINITE)
    if outcome.status is not None:
        status = _whole(model, "status", outcome.status, trials)
    steps = np.zeros(trials, np.int64) if model.integrates else None
    if outcome.steps is not None:
        if steps is None:
            raise model.fault("evaluate returns steps; this needs a setting rtol")
        steps = _whole(model, "steps", outcome.steps, trials)
    for code, failing in _failing(model, "failed", outcome.failed, trials):
        status = np.where(failing & (status != Status.NOT_RUN), code, status)
    unknown = set(np.unique(status).tolist()) - set(words_of(model.failures))
    if unknown or np.any(status == Status.NOT_RUN):
        wrong = sorted(unknown) or "0, not run"
        raise model.fault(f"a trial cannot end with status {wrong}")
    done = status == Status.DONE
    if not finite[done].all():
        trial, response = np.argwhere(done[:, None] & ~finite)[0]
        raise model.fault(
            f"{names[response]} is {responses[trial, response]} in a trial whose "
            f"status is done ({trial} of the block of {trials})"
        )
    for column, each in enumerate(described_now):
        lower, upper = each.range or (-math.inf, math.inf)
        values = responses[done, column]
        beyond = values[(values < lower) | (values > upper)]
        if len(beyond):
            raise model.fault(
                f"{each.name} is {beyond[0]:.17g} in {len(beyond)} of {trials} trials "
                f"of a block, outside its declared range {lower:g} .. {upper:g}; "
                "if rounding causes this, clip it in evaluate"
            )
    return Answers(np.where(done[:, None], responses, np.nan), status, steps)


def _whole(model: Model, what: str, values: ArrayLike, trials: int) -> Integers:
    found = _shaped(model, what, values, (trials,))
    if not (np.isfinite(found) & (found >= 0) & (found == np.round(found))).all():
        raise model.fault(f"{what} must be whole numbers from 0")
    return found.astype(np.int64)


def _shaped(
    model: Model, what: str, values: ArrayLike, shape: tuple[int, ...]
) -> Array:
    if np.ma.is_masked(values):
        raise model.fault(f"{what} are masked in some trials; write NaN there")
    try:
        given = np.asarray(values)
        if given.dtype.kind not in "biuf":
            raise TypeError
        found = given.astype(np.float64)
    except (TypeError, ValueError):
        raise model.fault(f"{what} are not real numbers") from None
    if found.shape != shape:
        hint = "; write y[:, None]" if found.shape == shape[:1] else ""
        wanted, there = (" x ".join(map(str, s)) or "one" for s in (shape, found.shape))
        raise model.fault(
            f"{what} of {wanted} numbers are expected, a row for each trial; these are "
            f"{there}{hint}"
        )
    return found


def tightened(model: Model, settings: Any, times: int = 1) -> Any | None:
    """Return settings that evaluate more precisely, checked; None without any.

    `times`: how often they are tightened.
    """
    for number in range(times):
        with _asking(model, "tightened"):
            tight = model.tightened(settings)
        if tight is None or (number and tight == settings):
            return None
        if type(tight) is not type(settings) or tight == settings:
            raise model.fault("tightened must return other settings of the same class")
        settings = tight
    return settings


def history_of(
    model: Model, deviations: Array, settings: Any, step: float
) -> tuple[Chart, Answers]:
    """Return the checked history of one trial of deviations[contributor], SI.

    Raises ModelError if the model does not move, or the step, s, is not above zero.
    """
    if not 0 < step < np.inf:
        raise ModelError(f"step = {step:g}: a time above 0 s is expected")
    possible = not impossible(model, deviations[None, :], settings).any()
    with _asking(model, "history"):
        # a trial that cannot be built has the curves of the nominal one, emptied
        shown = deviations if possible else np.zeros_like(deviations)
        chart, outcome = model.history(shown, settings, step)
    _check_view(model, chart)
    if possible:
        return chart, complete(model, outcome, 1, settings)
    curves = [c._replace(values=np.full_like(c.values, np.nan)) for c in chart.curves]
    empty = replace(chart, curves=tuple(curves), bands=(), marks=(), regions=())
    return empty, simulate(model, deviations[None, :], settings)


def offers(model: Model) -> dict[str, Offer]:
    """Return the views of a model, by name."""

    def history(deviations: Array, settings: Any) -> Chart:
        return history_of(model, deviations[0], settings, STEP)[0]

    own = Offer("history", "motion of one trial over time", history)
    found = (own, *model.views) if model.moves else model.views
    return {offer.name: offer for offer in found}


def shown(model: Model, offer: Offer, deviations: Array, settings: Any) -> View:
    """Return one of the model's views, checked; see `Offer`.

    Rows of `deviations` that cannot be built are left out. Raises ModelError if the
    first row of `deviations` cannot be built: there is nothing to show.
    """
    check_possible(model, deviations[:1], settings, "this machine")
    possible = impossible(model, deviations, settings) == 0
    with _asking(model, f"view {offer.name}"):
        view = offer.function(deviations[possible], settings)
    _check_view(model, view)
    return view


def _check_view(model: Model, view: object) -> None:
    if not isinstance(view, Chart | Listing):
        kind = type(view).__name__
        raise model.fault(f"a view is a Chart or a Listing, not {kind}")
    try:
        parts = list(view.parts())
    except ValueError as error:
        raise model.fault(f"heads and columns of a view: {error}") from None
    names = [name for name, _, _ in parts]
    for name, at, values in parts:
        for each in (at, values):
            array = isinstance(each, np.ndarray) and each.ndim == 1
            if not array or each.dtype.kind not in "iufU":
                raise model.fault(f"{name} is no array of numbers or texts")
        if len(at) != len(values):
            raise model.fault(f"{name} has {len(values)} values over {len(at)} points")
        if names.count(name) > 1:
            raise model.fault(f"a view has {name} twice")
    if isinstance(view, Chart):
        _check_panels(model, view)


def _check_panels(model: Model, chart: Chart) -> None:
    """Refuse panels and marks of missing curves, and axes with two units."""
    units, curves = chart.units, {curve.name for curve in chart.curves}
    shown = [(f"panel '{p.title}'", n) for p in chart.panels for n in p.every]
    shown += [("a mark", mark.curve) for mark in chart.marks]
    for what, name in shown:
        if name not in (curves if what == "a mark" else units):
            raise model.fault(f"{what} shows {name}, which the view does not have")
    for panel in chart.panels:
        for side in (panel.names, panel.right):
            if len({units[name] for name in side}) > 1:
                raise model.fault(
                    f"panel '{panel.title}' mixes units on one axis: "
                    f"{', '.join(side)}; put one of them to the right"
                )
