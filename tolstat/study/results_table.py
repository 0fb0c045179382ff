"""Results from elsewhere: rows of a file with inputs, responses and failures."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.deviations.rows import ROWS
from tolstat.errors import (
    DataError,
    DistributionError,
    StudyError,
    UnitError,
    allowed_names,
)
from tolstat.machines.results.machine import FAILED
from tolstat.model.checked import complete
from tolstat.model.contract import Model, Outcome
from tolstat.model.description import Description
from tolstat.study.data_files import counts_rows, read_data, source_words
from tolstat.study.evaluated_table import part_of_head, table_entry
from tolstat.study.given_points import Case, Points
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.study_schema import Document, TableEntry
from tolstat.tables.table import Table
from tolstat.units.conversion import to_si

LEAST, FEW = 2, 30  # rows: fewer are refused, warned of
NAMED = 5  # columns or rows in a sentence
# what a column of failures says, if the study does not tell the word of `done`
YES, NO = {"1", "true", "yes", "failed"}, {"", "0", "false", "no", "done"}
UNKNOWN = (
    "the study does not say how the rows of {name} were sampled, so they have no "
    'statistics; say it: sampled = "random", or "latin", in [table]'
)


def read_results(
    document: Document,
    folder: Path | None,
    model: Model,
    settings: Any,
    description: Description,
) -> Points:
    """Return the trials of a file with their answers.

    Each input and each response of the description is a column, by its name or by that
    of `columns`. Inputs are sizes or deviations. Heads have units; a column without one
    is in the unit of the study.

    Raises
    ------
    DataError
        If a column is missing, or a cell cannot be used: the message has its address.
    """
    entry, (contributors, responses) = table_entry(document), description
    if not document.responses:
        raise StudyError(
            "[responses] is missing: name the responses and their units, such as "
            'stroke = "mm"'
        )
    if model is not model.unwrapped:
        raise StudyError(
            "each row of the file has one answer; leave out [cases], lots and "
            "mean_within"
        )
    names = [column.name for part in description for column in part]
    for name in entry.columns:
        if name not in names:
            raise DataError(f"columns, {name}: {allowed_names(name, names)}")
    heads = {name: entry.columns.get(name, name) for name in names}
    requested = [*heads.values(), *filter(None, [entry.failed])]
    table = read_data(folder, entry, requested)
    rows, name = len(table.rows), table.path.name
    if rows < LEAST:
        raise DataError(f"{table.path}: {rows} row; trials are {LEAST} rows or more")
    failed = _failed(table, entry)
    without = {*np.flatnonzero(failed).tolist()}
    columns = _Columns(table, heads)
    deviations = np.zeros((rows, len(contributors)))
    units, warnings = dict[str, str](), dict[str, None]()
    for number, part in enumerate(contributors):
        head, holds = columns.of_input(part.name)
        unit, reader = table.units[head] or part.shown, DeviationReader(part)
        try:
            deviations[:, number], _ = reader.column(
                table.column(head), unit, holds, table.places
            )
        except (UnitError, DistributionError) as error:
            raise DataError(f"{table.path}, column {head}: {error}") from None
        units[part.name] = reader.shown_unit(unit)
        warnings |= dict.fromkeys(reader.warnings)
    answers = np.full((rows, len(responses)), np.nan)
    for number, response in enumerate(responses):
        head = columns.of_response(response.name)
        unit = table.units[head] or response.shown
        try:
            factor = to_si(1.0, "" if unit == "1" else unit, response.unit)
        except UnitError as error:
            raise DataError(f"{table.path}, column {head}: {error}") from None
        answers[:, number] = factor * np.array(table.column(head, without))
    unnamed = [n for n in table.columns if n not in {*columns.read, entry.failed}]
    if unnamed := [n for n in unnamed if not counts_rows(table, n)]:
        warnings[f"{name}: no entry names {_listed('column', unnamed)}; not read"] = (
            None
        )
    for sentence in _repeated(table, np.hstack([deviations, answers])):
        warnings[sentence] = None
    if rows < FEW:
        warnings[f"{name}: only {rows} rows; most statistics need more"] = None
    if entry.sampled == "unknown":
        warnings[UNKNOWN.format(name=name)] = None
    return Points(
        deviations,
        (Case(0, rows, settings),),
        units,
        note=f"{rows} rows of {name} ({source_words(table)})",
        warnings=tuple(warnings),
        sampler=ROWS[entry.sampled],
        places=table.places,
        answers=complete(
            model, Outcome(answers, failed={FAILED: failed}), rows, settings
        ),
    )


class _Columns:
    """Columns of a table by the names that a study has for them."""

    def __init__(self, table: Table, heads: Mapping[str, str]) -> None:
        self.table, self.heads = table, heads
        self.read: list[str] = []

    def of_response(self, name: str) -> str:
        """Return the head of a response."""
        if (head := self.heads[name]) not in self.table.columns:
            raise DataError(
                f"{self.table.path} has no column '{head}'; "
                f"{allowed_names(head, self.table.columns)}; [table] names another one "
                f"by columns = {{ {name} = ... }}"
            )
        if head in self.read:
            raise DataError(f"{self.table.path}: column {head} is named twice")
        self.read.append(head)
        return head

    def of_input(self, name: str) -> tuple[str, Any]:
        """Return the head of an input, and what it says that the column holds."""
        for head in self.table.columns:
            part, holds = part_of_head(head)
            if holds and part == self.heads[name] and head not in self.read:
                self.read.append(head)
                return head, holds
        return self.of_response(name), ""


def _failed(table: Table, entry: TableEntry) -> NDArray[np.bool_]:
    """Return which rows failed: bool[row]."""
    if not entry.failed:
        if entry.done:
            raise DataError('done: it needs failed = "COLUMN", the column that has it')
        return np.zeros(len(table.rows), np.bool_)
    words = [word.casefold() for word in table.texts(entry.failed)]
    if entry.done:
        return np.array([word != entry.done.casefold() for word in words])
    for word, place in zip(words, table.places, strict=True):
        if word not in YES | NO:
            raise DataError(
                f"{place}, column {entry.failed}: '{word}' may be a failure or none; "
                'give the word of rows that are done, such as done = "converged"'
            )
    return np.array([word in YES for word in words])


def _repeated(table: Table, numbers: Array) -> Iterator[str]:
    """Yield a sentence about rows that have the same numbers in all columns."""
    if numbers.shape[1] < LEAST:
        return  # of one column equal numbers are no surprise
    first = dict[bytes, int]()
    pairs = [
        (before, row)
        for row, values in enumerate(numbers)
        if (before := first.setdefault(values.tobytes(), row)) != row
    ]
    if pairs:
        before, row = pairs[0]
        more = f", and {len(pairs) - 1} more" if len(pairs) > 1 else ""
        yield (
            f"{table.places[row]} has the same numbers as row {table.rows[before].line}"
            f"{more}: a row that stands twice counts twice"
        )


def _listed(kind: str, names: Sequence[str]) -> str:
    words = f"the {kind}s" if len(names) > 1 else f"the {kind}"
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"{words} {', '.join(names[:NAMED])}{more}"
