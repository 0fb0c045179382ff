"""Output files: which may be replaced, and how; trials of a run as a table."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tolstat.errors import Advice, BrokenError, Remedy, RunFileError
from tolstat.literal import csv_cell
from tolstat.operating_system import held_open
from tolstat.regular_files import content as content_of
from tolstat.store.files_beside import create_aside
from tolstat.store.integrity import is_run
from tolstat.store.stored_run import Run
from tolstat.units.scale import PLAIN

if TYPE_CHECKING:
    import pandas as pd

KEPT = {".h5": "a run", ".toml": "a study"}  # by the ending of its name
MEGABYTES = 1  # of a study
TABLES = (".csv", ".parquet")


def check_folder(path: Path) -> None:
    """Refuse a file whose folder does not exist, before anything is computed.

    Raises
    ------
    RunFileError
        If there is no such folder.
    """
    if not path.parent.is_dir():
        raise RunFileError(f"{path} cannot be written: no such folder")
    try:
        path.resolve()
    except (OSError, RuntimeError) as error:  # links in a circle
        raise RunFileError(f"{path} cannot be written: {error}") from error


def check_output(path: Path) -> None:
    """Refuse a file that no answer may replace, before anything is computed.

    Parameters
    ----------
    path : Path
        File for a page, a picture or numbers. The file of an earlier answer is
        replaced.

    Raises
    ------
    RunFileError
        If the folder does not exist, the ending is that of a run or a study, or the
        file is a run or is read by a study.
    """
    check_folder(path)
    for name in (path, path.resolve()):
        if kind := KEPT.get(name.suffix.lower()):
            raise RunFileError(
                f"{path} is not written: {name.suffix} is the ending of {kind}; give "
                "another name"
            )
    if not path.is_file():
        return
    if is_run(path):
        raise RunFileError(f"{path} is a run and is not replaced; give another name")
    if study := _reader(path.resolve()):
        raise RunFileError(
            f"{path} is named in {study} and is not replaced; give another name"
        )


def check_ending(path: Path, kind: str, endings: Sequence[str]) -> None:
    """Refuse a file of another ending, or one that no answer may replace."""
    check_output(path)
    if path.suffix.lower() not in endings:
        *others, last = endings
        raise RunFileError(
            f"{path}: the name of {kind} ends in {', '.join(others)} or {last}"
        )


def _reader(path: Path) -> Path | None:
    """Return a study that names a file: studies read in their folder and below."""
    named = re.compile(rb"""["'/]""" + re.escape(os.fsencode(path.name)) + rb"""["']""")
    for folder in path.parents:
        for study in sorted(folder.glob("*.toml")):
            with suppress(OSError):
                if named.search(content_of(study, MEGABYTES)):
                    return study
    return None


def replace(path: Path, content: bytes | Callable[[Path], object]) -> Path:
    """Write a file under a temporary name, then rename it; return its path.

    An earlier file stays until then. The content is bytes, or a function that writes.

    Raises
    ------
    RunFileError
        If it cannot be written.
    """

    def write(target: Path) -> object:
        return content(target) if callable(content) else target.write_bytes(content)

    try:
        if path.exists() and not path.is_file():  # a pipe, a terminal
            with held_open(path):
                write(path)
            return path
        target = path.resolve()  # a link stays one
        aside, file = create_aside(target)
        file.close()
        try:
            write(aside)
            os.replace(aside, target)
        finally:
            with suppress(OSError):
                aside.unlink()
    except OSError as error:
        raise RunFileError(f"{path} cannot be written: {error}") from error
    return path


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
    check_ending(path, "a table", TABLES)
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
            table.to_parquet(aside, engine="pyarrow", index=True)

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
