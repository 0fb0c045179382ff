"""Results from elsewhere: rows of a file with inputs, responses and failures."""

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.deviations.rows import ROWS
from tolstat.errors import DataError, StudyError, allowed_names
from tolstat.machines.results.machine import FAILED
from tolstat.model.checked import complete
from tolstat.model.contract import Outcome
from tolstat.study.data_files import (
    named_column,
    naming_column,
    read_data,
    si_factor,
    source_words,
)
from tolstat.study.evaluated_table import not_read, part_of_head, table_entry
from tolstat.study.given_points import Case, Points, Setup
from tolstat.study.nominal_size import FACTORS, NEAR, DeviationReader, Holds
from tolstat.study.repeated_rows import repeated_rows
from tolstat.study.study_schema import TableEntry
from tolstat.tables.table import Table

LEAST, FEW = 2, 30  # rows: fewer are refused, warned of
WITHIN = 2.0  # times as large: rows in one unit that are nearly alike
# what a column of failures says, if the study does not tell the word of `done`
YES, NO = {"1", "true", "yes", "failed"}, {"", "0", "false", "no", "done"}
# heads and words of columns that may tell which rows failed, in some languages
STATE_HEADS = {
    "status", "state", "zustand", "failed", "failure", "fehler", "error", "converged",
    "success", "valid", "ok", "done", "exit code", "exit status", "returncode",
}  # fmt: skip
STATE_WORDS = {
    "ok", "o.k.", "nok", "i.o.", "n.i.o.", "io", "nio", "done", "finished", "fertig",
    "success", "successful", "pass", "passed", "fail", "failed", "error", "fehler",
    "fehlgeschlagen", "aborted", "abort", "abgebrochen", "abbruch", "cancelled",
    "converged", "diverged", "konvergiert", "divergiert", "not converged", "timeout",
    "crashed", "true", "false", "yes", "no", "ja", "nein", "valid", "invalid",
    "completed", "incomplete",
}  # fmt: skip
MOST_STATES = 10  # different words: a column with more names its rows
UNKNOWN = (
    "the study does not say how the rows of {name} were sampled, so they have no "
    'statistics; say it: sampled = "random", or "latin", in [table]'
)


def read_results(setup: Setup) -> Points:
    """Return the trials of a file with their answers.

    Each input and each response of the description is a column, by its name or by that
    of `columns`. Inputs are sizes or deviations. Heads have units; a column without one
    is in the unit of the study.

    Raises
    ------
    DataError
        If a column is missing, or a cell cannot be used: the message has its address.
    """
    document, folder, model, settings, description = setup
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
    columns = _Columns(table, heads)
    if entry.no_value:  # what has no answer failed
        for response in responses:
            failed[[*table.empty_rows(heads[response.name])]] = True
    without = {*np.flatnonzero(failed).tolist()}
    deviations = np.zeros((rows, len(contributors)))
    units, warnings = dict[str, str](), dict[str, None]()
    inputs, outputs = list[Array](), list[Array]()
    for number, part in enumerate(contributors):
        head, unit, holds = columns.of_input(part.name)
        unit, reader = unit or part.shown, DeviationReader(part)
        inputs.append(table.column(head))
        with naming_column(table, head):
            written = inputs[-1].tolist()
            deviations[:, number], _ = reader.column(written, unit, holds, table.places)
        units[part.name] = reader.shown_unit(unit)
        warnings |= dict.fromkeys(reader.warnings)
    answers = np.full((rows, len(responses)), np.nan)
    for number, response in enumerate(responses):
        head, unit = columns.of_response(response.name)
        factor = si_factor(table, head, unit or response.shown, response.unit)
        outputs.append(table.column(head, without))
        answers[:, number] = factor * outputs[-1]
        if units_differ := _two_units(outputs[-1]):
            warnings[f"{name}, column {head}: {units_differ}"] = None
    unnamed = [n for n in table.columns if n not in {*columns.read, entry.failed}]
    if unnamed := [n for n in unnamed if not table.counts_rows(n)]:
        _refuse_states(table, entry, unnamed)
        warnings[not_read(name, unnamed)] = None
        for head in unnamed:
            if words := _words_of(table, head):
                warnings[
                    f"{name}: column {head} has {words}; if it tells failed rows, give "
                    f'failed = "{head}" and done = "WORD" in [table]'
                ] = None
    if repeated := repeated_rows(table, entry, inputs, outputs):
        warnings[repeated] = None
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

    def of_response(self, name: str) -> tuple[str, str]:
        """Return the head of a response, and its unit; empty where it has none."""
        head, unit = named_column(self.table, name, self.heads[name])
        if head in self.read:
            raise DataError(f"{self.table.path}: column {head} is named twice")
        self.read.append(head)
        return head, unit

    def of_input(self, name: str) -> tuple[str, str, Holds]:
        """Return the same of an input, and what the head says that it holds."""
        for head in self.table.columns:
            part, holds = part_of_head(head)
            if holds and part == self.heads[name] and head not in self.read:
                self.read.append(head)
                return head, self.table.units[head], holds
        return *self.of_response(name), ""


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


def _refuse_states(table: Table, entry: TableEntry, heads: Sequence[str]) -> None:
    """Refuse columns that seem to tell failed rows, if the study names none."""
    if entry.failed is not None:
        return
    for head in heads:
        words = Counter(word.casefold() for word in table.texts(head))
        named = head.casefold() in STATE_HEADS
        if 1 < len(words) <= MOST_STATES and (named or STATE_WORDS & {*words}):
            shown = _counted(table, head)
            raise DataError(
                f"{table.path}, column {head} has {shown}: rows that failed seem to be "
                f'among them; give failed = "{head}" and done = the word of rows that '
                'are done, or failed = "" if none failed'
            )


def _two_units(values: Array) -> str:
    """Return how rows fall into two groups, as of two units; empty if they do not."""
    sizes = np.sort(np.abs(values[np.isfinite(values) & (values != 0)]))
    if len(sizes) < LEAST:
        return ""
    small, large = np.split(sizes, [int(np.argmax(sizes[1:] / sizes[:-1])) + 1])
    ratio = float(np.median(large) / np.median(small))
    near = [x for x in FACTORS if abs(ratio / x - 1) < NEAR]
    if not near or max(small[-1] / small[0], large[-1] / large[0]) > WITHIN:
        return ""
    return (
        f"{len(large)} rows are {near[0]} times as large as the other {len(small)}; "
        "check their unit"
    )


def _words_of(table: Table, head: str) -> str:
    """Return the words of a column with counts; empty for one of numbers or names."""
    if head in table.numeric or len({*table.texts(head)}) > MOST_STATES:
        return ""
    return _counted(table, head)


def _counted(table: Table, head: str) -> str:
    counts = Counter(table.texts(head)).most_common()
    return ", ".join(f"'{word}' ({count})" for word, count in counts)
