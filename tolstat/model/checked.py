"""Checks of a model: its declarations, and its answers."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tolstat.arrays import Array, Integers, Truths
from tolstat.errors import ModelError, UnitError, told
from tolstat.literal import visible
from tolstat.model.contract import (
    NO_OUTPUT,
    Model,
    Outcome,
    Spreads,
    TrialResults,
    guarded,
)
from tolstat.model.description import Contributor, Description, Response, StudyNumber
from tolstat.model.view import Offer
from tolstat.status import Status, words_of
from tolstat.units.conversion import check_si, to_si

# names of columns that every run file and frame has
RESERVED = (
    "trial", "status", "steps", "nominal", "reference", "audit", "rerun", "settings",
    "assumed", "numbers", "diagnostics", "checks", "provenance",
)  # fmt: skip
DECLARED = {Contributor: "contributor", Response: "response", StudyNumber: "number"}
DECLARATIONS = "name", "failures", "assumptions", "views", "moves", "integrates"
SIDES = "least", "largest"  # of a worst case
TEXTS = "unit", "symbol", "sentence", "source", "shown", "of", "caveat", "worst"
LONGEST_OUTPUT = 2000  # characters of the output of a failed trial
# model, settings and responses that were asked for last: threads replace it whole
_LATEST: list[tuple[Model | None, Any, Sequence[Response]]] = [(None, None, ())]
HUGE = 1e150  # the squares of smaller numbers are finite, too


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
    failures, assumptions, views = model.failures, model.assumptions, model.views
    if not isinstance(failures, Mapping) or not _printable(
        *failures, *failures.values()
    ):
        raise model.fault(
            "failures must map a word to the sentence that has to be true, such as "
            f'{{"cuts air": "the tool stays in the cut"}}, not {failures!r}'
        )
    for word in failures:
        if word in words_of().values():
            raise model.fault(f"the failure {word!r} is a word of tolstat; use another")
    if not isinstance(assumptions, tuple | list) or not _printable(*assumptions):
        raise model.fault(f"assumptions must be a tuple of texts, not {assumptions!r}")
    for offer in views if isinstance(views, tuple | list) else ("",):
        named = isinstance(offer, Offer) and _printable(offer.name)
        if not (named and callable(offer.function)):
            raise model.fault(f"views must be a tuple of Offer, not {offer!r}")
    return model


def _printable(*texts: object) -> bool:
    """Return whether objects are texts that can be stored and printed."""
    return all(isinstance(t, str) and t != "" and t.isprintable() for t in texts)


def described(model: Model, settings: Any) -> Description:
    """Return contributors and responses, their names and units checked.

    They may depend on the settings. Raises ModelError if a name cannot be typed, is
    given twice or reserved, a unit is unknown, a range is wrong, or there is no
    response. The message names model and fault.
    """
    with guarded(model, "describe"):
        contributors, responses = model.describe(settings)
        description = Description(tuple(contributors), tuple(responses))
    if not description.responses:
        raise model.fault("describe gives no response")
    declared: list[Contributor | Response] = [*description.contributors]
    declared += description.responses
    _check_declared(model, declared)
    for column in declared:
        if column.name in RESERVED:
            words = f"the name {column.name} is reserved for a column of every run"
            raise model.fault(f"{words} ({', '.join(RESERVED)})")
    for response in description.responses:
        ends = (0, 1) if response.range is None else response.range
        try:
            lower, upper = map(float, ends)
        except (TypeError, ValueError):
            lower = upper = math.nan
        if not lower < upper:
            raise model.fault(
                f"{response.name}: the range {response.range!r} must be two numbers, "
                "the lower first"
            )
    return description


def numbers_of(
    model: Model, settings: Any, spreads: Spreads, *, independent: bool = True
) -> tuple[StudyNumber, ...]:
    """Return the checked numbers of a study; see `Model.numbers`."""
    units = {r.name: r.unit for r in described(model, settings).responses}
    with guarded(model, "numbers"):
        numbers = tuple(model.numbers(settings, spreads, independent=independent))
    _check_declared(model, numbers)
    for number in numbers:
        value, response, worst = number.value, number.of, number.worst
        if isinstance(value, bool) or not isinstance(value, int | float):
            wrong = f"{value!r} is not a number"
        elif response and units.get(response) != number.unit:
            wrong = f"no response {response} with its unit, {number.unit}"
        elif worst and not (response and worst in SIDES):
            words = f"{' or '.join(SIDES)} is allowed, of the response that `of` names"
            wrong = f"worst = {worst!r}; {words}"
        else:
            continue
        raise model.fault(f"number {number.name}: {wrong}")
    return numbers


def model_warnings(model: Model, settings: Any, spreads: Spreads) -> tuple[str, ...]:
    """Return the checked warnings of a model about a study; see `Model.warnings`."""
    with guarded(model, "warnings"):
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
    for column in declared:
        kind, name = DECLARED.get(type(column)), getattr(column, "name", None)
        if kind is None:
            raise model.fault(f"{column!r} is not a {' or '.join(DECLARED.values())}")
        if not isinstance(name, str) or not name.isidentifier():
            raise model.fault(
                f"the {kind} {name!r} cannot be typed; letters, digits and _ are "
                "allowed, a letter first"
            )
        if name in names:
            raise model.fault(f"{name} is given twice")
        names.add(name)
        for text in (getattr(column, field, "") for field in TEXTS):
            if text != "" and not _printable(text):
                raise model.fault(f"{kind} {name}: {text!r} cannot be printed")
        try:
            check_si(column.unit)
            to_si(1.0, column.shown or column.unit, column.unit)
        except UnitError as error:
            raise model.fault(f"{kind} {name}: {error}") from None


def simulate(model: Model, deviations: Array, settings: Any) -> TrialResults:
    """Return the checked answers of deviations[trial, contributor], SI.

    Every trial has a status; the responses of failed trials are NaN. Raises ModelError
    if shapes, statuses or numbers do not fit the contract.
    """
    rows = deviations.view()
    rows.flags.writeable = False  # the stored deviations stay as they were sampled
    status = impossible(model, rows, settings)
    possible = status == 0
    if possible.all():
        return evaluated(model, rows, settings)
    responses = np.full((len(rows), len(_responses(model, settings))), np.nan)
    steps = np.zeros(len(rows), np.int64) if model.integrates else None
    output = NO_OUTPUT
    if possible.any():
        answers = evaluated(model, rows[possible], settings)
        status[possible], responses[possible] = answers.status, answers.responses
        if steps is not None and answers.steps is not None:
            steps[possible] = answers.steps
        numbers = np.flatnonzero(possible)
        output = {int(numbers[row]): text for row, text in answers.output.items()}
    return TrialResults(responses, status, steps, output)


def evaluated(model: Model, rows: Array, settings: Any) -> TrialResults:
    """Return the answers of trials that can be built."""
    with guarded(model, "evaluate"):
        outcome = model.evaluate(rows, settings)
    with guarded(model, "evaluate"):  # an outcome may have properties of its own
        return complete(model, outcome, len(rows), settings)


def impossible(model: Model, deviations: Array, settings: Any) -> Integers:
    """Return which trials of deviations[trial, contributor], SI, cannot be built.

    int64[trial]: 0 if a trial can be built, else its status.
    """
    with guarded(model, "impossible"):
        by_word = {**model.impossible(deviations, settings)}
    status = np.zeros(len(deviations), np.int64)
    for code, failing in _failing(model, "impossible", by_word, len(deviations)):
        status[failing & (status == 0)] = code
    return status


def check_possible(model: Model, trial: Array, settings: Any, called: str) -> None:
    """Refuse one trial, float64[1, contributor], that cannot be built."""
    if status := int(impossible(model, trial, settings)[0]):
        word = words_of(model.failures)[status]
        required = model.failures[word]
        raise ModelError(f"{called} cannot be built: {word} ({required})")


def _failing(
    model: Model, where: str, by_word: Mapping[str, ArrayLike], trials: int
) -> Iterator[tuple[int, Truths]]:
    """Yield the status of each word, and the trials that end with it."""
    if not isinstance(by_word, Mapping):
        raise model.fault(f"{where} must be a mapping by failure, not {by_word!r}")
    codes = {word: code for code, word in words_of(model.failures).items()}
    for word, failing in by_word.items():
        if word not in model.failures:
            words = ", ".join(model.failures) or "there are none"
            raise model.fault(f"'{word}' is not in its failures ({words})")
        if np.asarray(failing).dtype != np.bool_:
            raise model.fault(f"{where} '{word}' must be true or false for each trial")
        name = f"{where} '{word}'"
        yield codes[word], _shaped(model, name, failing, (trials,)) != 0


def complete(
    model: Model, outcome: Outcome, trials: int, settings: Any
) -> TrialResults:
    """Return the checked answers of an outcome of so many trials; see `simulate`."""
    declared = _responses(model, settings)
    names = [response.name for response in declared]
    if not isinstance(outcome, Outcome):
        raise model.fault(f"evaluate returns {type(outcome).__name__}, not Outcome")
    responses = _shaped(model, "responses", outcome.responses, (trials, len(names)))
    finite = np.abs(responses) < HUGE
    status = np.where(finite.all(axis=1), Status.DONE, Status.NOT_FINITE)
    if outcome.status is not None:
        status = _integers(model, "status", outcome.status, trials)
    steps = np.zeros(trials, np.int64) if model.integrates else None
    if outcome.steps is not None:
        if steps is None:
            raise model.fault("evaluate returns steps; this needs a setting rtol")
        steps = _integers(model, "steps", outcome.steps, trials)
    for code, failing in _failing(model, "failed", outcome.failed, trials):
        status = np.where(failing & (status != Status.NOT_RUN), code, status)
    unknown = set(np.unique(status).tolist()) - set(words_of(model.failures))
    stopped = model.isolation and model.isolation.stopping()
    if unknown or (np.any(status == Status.NOT_RUN) and not stopped):
        wrong = sorted(unknown) or "0, not run"
        raise model.fault(f"a trial cannot end with status {wrong}")
    done = status == Status.DONE
    if not finite[done].all():
        trial, column = np.argwhere(done[:, None] & ~finite)[0]
        raise model.fault(
            f"{names[column]} is {responses[trial, column]} in a trial whose "
            f"status is done ({trial} of the block of {trials})"
        )
    for response, values in zip(declared, responses[done].T, strict=True):
        lower, upper = response.range or (-math.inf, math.inf)
        beyond = values[(values < lower) | (values > upper)]
        if len(beyond):
            raise model.fault(
                f"{response.name} is {beyond[0]:.17g} in {len(beyond)} of {trials} "
                f"trials of a block, outside its declared range {lower:g} .. {upper:g};"
                " if rounding causes this, clip it in evaluate"
            )
    output = {
        int(row): visible(text)[-LONGEST_OUTPUT:]
        for row, text in outcome.output.items()
        if 0 <= row < trials and not done[row]
    }
    responses = np.where(done[:, None], responses, np.nan)
    return TrialResults(responses, status, steps, output)


def _responses(model: Model, settings: Any) -> Sequence[Response]:
    """Return the responses of a model; it describes itself once for many blocks."""
    known, with_settings, responses = _LATEST[0]
    if known is not model or with_settings is not settings:
        with guarded(model, "describe"):
            responses = tuple(model.describe(settings).responses)
        _LATEST[0] = model, settings, responses
    return responses


def _integers(model: Model, name: str, values: ArrayLike, trials: int) -> Integers:
    numbers = _shaped(model, name, values, (trials,))
    if not (
        np.isfinite(numbers) & (numbers >= 0) & (numbers == np.round(numbers))
    ).all():
        raise model.fault(f"{name} must be whole numbers from 0")
    return numbers.astype(np.int64)


def _shaped(
    model: Model, name: str, values: ArrayLike, shape: tuple[int, ...]
) -> Array:
    if np.ma.is_masked(values):
        raise model.fault(f"{name} are masked in some trials; write NaN there")
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "biuf":
            raise TypeError
    except (TypeError, ValueError):
        raise model.fault(f"{name} are not real numbers") from None
    if array.shape != shape:
        hint = "; write y[:, None]" if array.shape == shape[:1] else ""
        sizes = [" x ".join(map(str, s)) or "one" for s in (shape, array.shape)]
        raise model.fault(
            f"{name} of {sizes[0]} numbers are expected, a row for each trial; these "
            f"are {sizes[1]}{hint}"
        )
    return array.astype(np.float64)


def tightened(model: Model, settings: Any, times: int = 1) -> Any | None:
    """Return settings that evaluate more precisely, checked; None without any.

    `times`: how often they are tightened.
    """
    for number in range(times):
        with guarded(model, "tightened"):
            tight = model.tightened(settings)
        if tight is None or (number and tight == settings):
            return None
        if type(tight) is not type(settings) or tight == settings:
            raise model.fault("tightened must return other settings of the same class")
        settings = tight
    return settings
