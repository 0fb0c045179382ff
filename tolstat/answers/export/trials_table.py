"""The trials of a run in a file: CSV, Parquet or a workbook, in SI or as shown."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tolstat.answers.output_file import check_ending, replace
from tolstat.errors import Advice, BrokenError, Remedy, RunFileError
from tolstat.literal import csv_cell
from tolstat.store.stored_run import SHOWN, SI, Run
from tolstat.units.scale import PLAIN

if TYPE_CHECKING:
    import pandas as pd

TABLES = (".csv", ".parquet", ".xlsx")


def export(run: Run, path: Path, *, units: str = "", force: bool = False) -> None:
    """Write all trials of a run: a row for each, with units in the heads.

    Parameters
    ----------
    units : str
        "SI" or "shown", as of `Run.frame`. By default workbooks are as shown on pages,
        other tables in SI.

    Raises
    ------
    RunFileError
        If the ending is not allowed, the file exists, a library is not installed, or
        a workbook has not enough rows.
    BrokenError
        If it cannot be written; no part of it remains.
    """
    ending = path.suffix.lower()
    check_ending(path, "a table", TABLES)
    if path.exists() and not (force and path.is_file()):
        raise RunFileError(
            f"{path} already exists, and is replaced only by force",
            Advice(Remedy.REPLACE, path),
        )
    table = trials_table(run, units or (SHOWN if ending == ".xlsx" else SI))
    if ending == ".xlsx":
        from tolstat.answers.export.run_workbook import run_workbook

        content: Any = run_workbook(run, path, table)
    else:
        content = partial(_write_csv if ending == ".csv" else _write_parquet, table)
    try:
        replace(path, content)
    except ImportError as error:
        raise RunFileError(
            f"{path}: Parquet needs pyarrow, pip install 'tolstat[parquet]'; or name a "
            "file that ends in .csv"
        ) from error
    except RunFileError as error:
        raise BrokenError(str(error)) from error


def trials_table(run: Run, units: str = SI) -> pd.DataFrame:
    """Return the trials as a table with units in its heads.

    `attrs["units"]` has the unit of each column, by its head; none for a plain number.
    """
    frame = run.frame(units)
    marks = frame.attrs.pop("units")
    plain = ("", PLAIN)
    heads = {n: f"{n} [{u}]" for n, u in marks.items() if u not in plain}
    table = frame.rename(columns=heads)
    table.attrs = {"units": {head: marks[name] for name, head in heads.items()}}
    return table


def _write_parquet(table: pd.DataFrame, path: Path) -> None:
    """Write a table with the unit of each column in the metadata of its field."""
    import pyarrow
    from pyarrow import parquet

    units = table.attrs["units"]
    arrow = pyarrow.Table.from_pandas(table, preserve_index=True)
    fields = [
        field.with_metadata({"unit": units[field.name]})
        if field.name in units
        else field
        for field in arrow.schema
    ]
    metadata = {**(arrow.schema.metadata or {}), b"units": json.dumps(units).encode()}
    schema = pyarrow.schema(fields, metadata)
    parquet.write_table(arrow.cast(schema), path)


def _write_csv(table: pd.DataFrame, path: Path) -> None:
    """Write a table in which no text is a formula to a spreadsheet."""
    cells = table.copy(deep=False)
    for name, column in table.items():
        if column.dtype.kind not in "iuf":
            cells[name] = column.astype(object).map(csv_cell)
    cells.rename(columns=csv_cell).to_csv(path, lineterminator="\n")
