"""Rows of a file as trials, which a model evaluates."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.names import expand
from tolstat.deviations.rows import ROWS
from tolstat.errors import DataError, ModelError
from tolstat.literal import some_of
from tolstat.study import study_schema as schema
from tolstat.study.given_points import Case, Points, Setup
from tolstat.study.nominal_size import HOLDS, DeviationReader, Holds

NAMED = 5  # columns in a sentence


def read_table(setup: Setup) -> Points:
    """Return the trials of a file, which the model evaluates.

    Heads are contributors with their unit, `rod_length_1 [mm]`, or have their names by
    `columns`; a row is a trial, with its deviations, or sizes. `rod_length_1 sizes
    [mm]` says which.
    """
    from tolstat.study.data_files import (  # few studies do
        named_column,
        naming_column,
        read_data,
        source_words,
    )
    from tolstat.study.repeated_rows import SAMPLES, repeated_rows

    entry = table_entry(setup.document)
    for key in schema.OF_RESULTS:
        if getattr(entry, key):
            raise DataError(f'{key}: only model = "{schema.RESULTS}" has this key')
    table = read_data(setup.folder, entry, [*entry.columns.values()])
    path, renamed, typed_units = table.path, dict[str, str](), dict[str, str]()
    for name, typed in entry.columns.items():
        head, typed_units[head] = named_column(table, name, typed)
        renamed[head] = name
    parts = {part.name: part for part in setup.description.contributors}
    deviations = np.zeros((len(table.rows), len(parts)))
    names, units, warnings = [*parts], dict[str, str](), dict[str, None]()
    columns, unnamed = list[Array](), list[str]()
    for head in table.columns:
        written = typed_units.get(head, table.units[head])
        part, holds = part_of_head(head)
        try:
            members = expand(renamed.get(head, part), names)
        except ModelError as error:
            if renamed and head not in renamed:  # a table of another program
                unnamed += [] if table.counts_rows(head) else [head]
                continue
            raise DataError(f"{path}, column {head}: {error}") from None
        columns.append(table.column(head))
        for member in members:
            if member in units:
                raise DataError(f"{path}: {member} is given twice")
            reader = DeviationReader(parts[member])
            with naming_column(table, head):
                column, sizes = reader.column(
                    columns[-1].tolist(), written, holds, table.places
                )
            warnings |= dict.fromkeys(reader.warnings)
            units[member] = reader.shown_unit(written)
            deviations[:, names.index(member)] = column
            if sizes and not holds:
                warnings[f"{path.name}: column {head} is taken as sizes"] = None
    if unnamed:
        warnings[not_read(path.name, unnamed)] = None
    if entry.sampled in SAMPLES:
        repeated_rows(table, entry, columns, ())
    return Points(
        deviations,
        (Case(0, len(deviations), setup.settings),),
        units,
        note=f"{len(deviations)} trials of {path.name} ({source_words(table)})",
        warnings=tuple(warnings),
        sampler=ROWS[entry.sampled],
        places=table.places,
    )


def table_entry(document: schema.Document) -> schema.TableEntry:
    """Return the key `table` of a study, which may be the name of a file."""
    file = document.table
    keys: Mapping[str, Any] = file if isinstance(file, dict) else {"data": file}
    return schema.read_entry(schema.TableEntry, keys, "a table has")


def not_read(file: str, heads: Sequence[str]) -> str:
    """Return a warning about columns that no entry names."""
    words = f"the column{'s' * (len(heads) > 1)} {some_of(heads, NAMED)}"
    return f"{file}: no entry names {words}; not read"


def part_of_head(head: str) -> tuple[str, Holds]:
    """Return the contributor of a column's head, and what it says that it holds."""
    name, _, last = head.rpartition(" ")
    return (name.strip(), last) if last in HOLDS else (head, "")
