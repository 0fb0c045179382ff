"""Tables of files by their kind: text, workbook, Parquet, HDF5 or Q-DAS."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tolstat.errors import DataError
from tolstat.tables import named_arrays, qdas, workbook_reader
from tolstat.tables.delimited import read_delimited
from tolstat.tables.encodings import text_of_data
from tolstat.tables.no_value import without_codes
from tolstat.tables.table import Table

MOST_MEGABYTES = 32  # of a file


@dataclass(frozen=True)
class Form:
    """What a study says of how a file is written; empty for what the file tells."""

    decimal: str = ""  # sign, "." or ","
    delimiter: str = ""  # between columns of a text
    encoding: str = ""  # of a text, as Python names it
    sheet: str = ""  # of a workbook, or the group of an HDF5 file
    part: str = ""  # of a Q-DAS file
    # codes of cells without a value; None: what looks like one is refused
    no_value: tuple[str, ...] | None = None
    only: tuple[
        tuple[str, str], ...
    ] = ()  # what the rows that are read have, by column


AS_IS = Form()


def read_table(
    path: Path, raw: bytes, form: Form = AS_IS, requested: Sequence[str] = ()
) -> Table:
    """Return the table of a text, a workbook, a Parquet or an HDF5 file.

    Parameters
    ----------
    raw : bytes
        Content of the file.
    requested : sequence of str
        Columns that will be read: they tell the head among similar lines.

    Raises
    ------
    DataError
        If it cannot be read, or in two ways.
    """
    digest = hashlib.sha256(raw).hexdigest()
    ending = path.suffix.lower()
    if ending in qdas.ENDINGS:
        raise DataError(
            f"{path}: a Q-DAS file has measured parts, and no rows of trials"
        )
    if ending in workbook_reader.ENDINGS or raw.startswith(workbook_reader.ZIP):
        grid = workbook_reader.read_workbook(
            path, raw, digest, sheet=form.sheet, requested=requested
        )
    elif ending in named_arrays.PARQUET:
        grid = named_arrays.read_parquet(path, raw, digest)
    elif ending in named_arrays.HDF5:
        grid = named_arrays.read_hdf5(
            path, raw, digest, group=form.sheet, requested=requested
        )
    else:
        grid = read_delimited(
            path, digest, text_of_data(path, raw, form.encoding),
            delimiter=form.delimiter, decimal=form.decimal, requested=requested,
        )  # fmt: skip
    if form.no_value:
        grid = without_codes(grid, form.no_value)
    return Table(grid, form.decimal, form.no_value, dict(form.only))


def read_qdas(
    path: Path, raw: bytes, values: tuple[Path, bytes] | None, form: Form
) -> qdas.QdasFile:
    """Return the characteristics of a Q-DAS file; `values`: the DFX file beside it."""
    digest = hashlib.sha256(raw + (values[1] if values else b"")).hexdigest()
    return qdas.QdasFile(
        path, raw, digest, values=values, encoding=form.encoding, part=form.part,
        codes=form.no_value,
    )  # fmt: skip
