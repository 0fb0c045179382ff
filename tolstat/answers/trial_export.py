"""The trials of a run as a table for other programs: CSV or Parquet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tolstat.answers.output_file import check_ending, replace
from tolstat.errors import Advice, BrokenError, Remedy, RunFileError
from tolstat.literal import csv_cell
from tolstat.store.stored_run import Run
from tolstat.units.scale import PLAIN

if TYPE_CHECKING:
    import pandas as pd

ENDINGS = (".csv", ".parquet")


def export(run: Run, path: Path, *, force: bool = False) -> None:
    """Write all trials of a run: a row for each, with units in the heads, SI.

    Raises
    ------
    RunFileError
        If the ending is not allowed, the file exists, or Parquet is not installed.
    BrokenError
        If it cannot be written; no part of it remains.
    """
    ending = path.suffix.lower()
    check_ending(path, "a table", ENDINGS)
    if path.exists() and not (force and path.is_file()):
        raise RunFileError(
            f"{path} already exists, and is replaced only by force",
            Advice(Remedy.REPLACE, path),
        )
    frame = run.frame()
    units = frame.attrs.pop("units")
    heads = {n: f"{n} [{u}]" for n, u in units.items() if u not in ("", PLAIN)}
    table = frame.rename(columns=heads)

    def write(aside: Path) -> None:
        if ending == ".csv":
            _as_cells(table).to_csv(aside, lineterminator="\n")
        else:
            table.to_parquet(aside, engine="pyarrow")

    try:
        replace(path, write)
    except ImportError as error:
        raise RunFileError(
            f"{path}: Parquet needs pyarrow, pip install 'tolstat[parquet]'; or name a "
            "file that ends in .csv"
        ) from error
    except RunFileError as error:
        raise BrokenError(str(error)) from error


def _as_cells(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table in which no text is a formula to a spreadsheet."""
    cells = table.copy(deep=False)
    for name, column in table.items():
        if column.dtype.kind not in "iuf":
            cells[name] = column.astype(object).map(csv_cell)
    return cells.rename(columns=csv_cell)
