"""Rows of a file as trials, and whether they are what the study states of them."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tolstat.deviations.names import expand
from tolstat.deviations.rows import ROWS, Correlated, Misfit, Outside, contradictions
from tolstat.errors import DataError, DistributionError, ModelError, UnitError
from tolstat.model.contract import Model
from tolstat.model.description import Contributor, Description
from tolstat.study import study_schema as schema
from tolstat.study.deviations_section import Deviations
from tolstat.study.given_points import Case, Points
from tolstat.study.nominal_size import HOLDS, DeviationReader, Holds
from tolstat.units.scale import figures, scale_of

MOST_PAIRS = 8  # of correlated inputs, in warnings
Reader = Callable[[schema.Document, Path | None, Model, Any, Description], Points]


def reader_of_rows(document: schema.Document) -> Reader:
    """Return what reads the rows: `read_table`, or that of results from elsewhere."""
    if document.model != schema.RESULTS:
        return read_table
    from tolstat.study.results_table import read_results  # seldom needed

    return read_results


def read_table(
    document: schema.Document,
    folder: Path | None,
    model: Model,
    settings: Any,
    description: Description,
) -> Points:
    """Return the trials of a file, which the model evaluates.

    Heads are contributors with their unit, `rod_length_1 [mm]`; a row is a trial, with
    its deviations, or sizes. `rod_length_1 sizes [mm]` says which.
    """
    from tolstat.study.data_files import read_data, source_words  # few studies do

    entry = table_entry(document)
    for key in schema.OF_RESULTS:
        if getattr(entry, key):
            raise DataError(f'{key}: only model = "{schema.RESULTS}" has this key')
    table = read_data(folder, entry)
    path = table.path
    parts = {part.name: part for part in description.contributors}
    deviations = np.zeros((len(table.rows), len(parts)))
    names, units, warnings = [*parts], dict[str, str](), dict[str, None]()
    for head, written in table.units.items():
        part, holds = part_of_head(head)
        try:
            members = expand(part, names)
        except ModelError as error:
            raise DataError(f"{path}, column {head}: {error}") from None
        for member in members:
            if member in units:
                raise DataError(f"{path}: {member} is given twice")
            reader = DeviationReader(parts[member])
            try:
                column, sizes = reader.column(
                    table.column(head), written, holds, table.places
                )
            except (UnitError, DistributionError) as error:
                raise DataError(f"{path}, column {head}: {error}") from None
            warnings |= dict.fromkeys(reader.warnings)
            units[member] = reader.shown_unit(written)
            deviations[:, names.index(member)] = column
            if sizes and not holds:
                warnings[f"{path.name}: column {head} is taken as sizes"] = None
    return Points(
        deviations,
        (Case(0, len(deviations), settings),),
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


def part_of_head(head: str) -> tuple[str, Holds]:
    """Return the contributor of a column's head, and what it says that it holds."""
    name, _, last = head.rpartition(" ")
    return (name.strip(), last) if last in HOLDS else (head, "")


def with_row_warnings(
    points: Points, deviating: Deviations, description: Description
) -> Points:
    """Return rows with warnings about statements of the study that they contradict."""
    warnings = _contradicted(points, deviating, description)
    return replace(points, warnings=(*points.warnings, *warnings))


def _contradicted(
    points: Points, deviating: Deviations, description: Description
) -> Iterator[str]:
    """Yield a sentence for each statement that rows contradict."""
    parts = {part.name: part for part in description.contributors}
    columns = dict(zip(parts, points.deviations.T, strict=True))
    deviations = {name: values for name, values in columns.items() if np.any(values)}
    stated = {n: d for n, d in deviating.distributions.items() if n in deviations}
    sampled, pairs = points.sampler is not None, 0
    for contradiction in contradictions(
        deviations, stated, deviating.dependence, sample=sampled
    ):
        match contradiction:
            case Outside(name, rows):
                row, more = int(rows[0]), len(rows) - 1
                others = f"; in {more} more rows, too" if more else ""
                yield (
                    f"{points.places[row]}: {name} is "
                    f"{_words(parts[name], deviations[name][row])}, outside its "
                    f"tolerance ({deviating.words[name]}){others}"
                )
            case Misfit(name, p_value):
                yield (
                    f"{name}: the rows are not distributed as stated "
                    f"({deviating.words[name]}; Kolmogorov-Smirnov, p = "
                    f"{figures(p_value, 2)}); what-if rests on that distribution"
                )
            case Correlated((first, second), correlation) if pairs < MOST_PAIRS:
                pairs += 1
                yield (
                    f"{first} and {second}: rank correlation "
                    f"{figures(correlation, 2)} in the rows, none in the study"
                )


def _words(part: Contributor, deviation: float) -> str:
    """Return a deviation in words, or of a part with a nominal value its size."""
    return scale_of(part.unit, part.shown).words((part.size or 0.0) + deviation)
